//! The reader of a plug-in's table, of this version and the one before: any numbers, names and counts in it, its
//! pointers valid or null as `effect.h` asks.

#![allow(unsafe_code, reason = "a table of C")]

use super::folder::said;
use arbitrary::{Result, Unstructured};
use misclosure::effects::abi::{ABI_VERSION, ABI_VERSION_BEFORE, CEffect, RawContext};
use std::ffi::{CString, c_char, c_int, c_void};
use std::ptr::null;

/// `misclosure_name`.
#[repr(C)]
struct Name {
    name: *const c_char,
    value: f64,
}

/// `misclosure_parameter` of the version before.
#[derive(Clone, Copy)]
#[repr(C)]
struct ParameterBefore {
    name: *const c_char,
    unit: *const c_char,
    scope: u32,
    role: u32,
    nominal: f64,
    typical: f64,
    domain: u32,
    name_count: u32,
    domain_min: f64,
    domain_max: f64,
    names: *const Name,
    deviation: *const c_char,
}

/// `misclosure_parameter`.
#[repr(C)]
struct Parameter {
    before: ParameterBefore,
    plausible: [f64; 2],
    plausible_source: *const c_char,
}

type Eval =
    unsafe extern "C" fn(*mut c_void, *const c_void, *const f64, *const f64, *mut f64, *mut f64, *mut f64) -> c_int;

/// `misclosure_effect` of the version before.
#[repr(C)]
struct TableBefore {
    numbers: [u32; 9],
    texts: [*const c_char; 5],
    parameters: *const c_void,
    needs: *const u32,
    this: *mut c_void,
    eval: Option<Eval>,
}

/// `misclosure_effect`.
#[repr(C)]
struct Table {
    before: TableBefore,
    picture: [u32; 2],
    words: [*const c_char; 3],
}

/// The version of `effect.h` and the sizes of its structs, which stand before stage, kind and counts.
const fn front(is_before: bool) -> [u32; 5] {
    let (version, table, parameter) = match is_before {
        true => (ABI_VERSION_BEFORE, size_of::<TableBefore>(), size_of::<ParameterBefore>()),
        false => (ABI_VERSION, size_of::<Table>(), size_of::<Parameter>()),
    };
    [version, table as u32, parameter as u32, size_of::<Name>() as u32, size_of::<RawContext>() as u32]
}

/// Texts that live as long as a table.
struct Texts(Vec<CString>);

impl Texts {
    /// A text, or none.
    fn draw(&mut self, u: &mut Unstructured<'_>) -> Result<*const c_char> {
        if u.ratio(1, 16)? {
            return Ok(null());
        }
        let bytes: Vec<u8> = u.arbitrary_iter::<u8>()?.take(12).flatten().filter(|byte| *byte != 0).collect();
        self.0.push(CString::new(bytes).expect("no zero is left"));
        Ok(self.0[self.0.len() - 1].as_ptr())
    }
}

/// Outside its domain everywhere.
unsafe extern "C" fn eval(
    _: *mut c_void,
    _: *const c_void,
    _: *const f64,
    _: *const f64,
    _: *mut f64,
    _: *mut f64,
    _: *mut f64,
) -> c_int {
    0
}

/// A number that is what it should be, mostly.
fn mostly(u: &mut Unstructured<'_>, expected: u32) -> Result<u32> {
    if u.ratio(15, 16)? { Ok(expected) } else { u.arbitrary() }
}

/// One input.
pub fn run(data: &[u8]) {
    // A table that the bytes do not fill has zeros.
    let _ = load(&mut Unstructured::new(data));
}

fn load(u: &mut Unstructured<'_>) -> Result<()> {
    let mut texts = Texts(Vec::new());
    let mut names: Vec<Vec<Name>> = Vec::new();
    let mut parameters = Vec::new();
    let mut before = Vec::new();
    for _ in 0..u.int_in_range(0..=4)? {
        let mut named = Vec::new();
        for _ in 0..u.int_in_range(0..=3)? {
            named.push(Name { name: texts.draw(u)?, value: u.arbitrary()? });
        }
        names.push(named);
        let named = &names[names.len() - 1];
        let parameter = ParameterBefore {
            name: texts.draw(u)?,
            unit: texts.draw(u)?,
            scope: u.int_in_range(0..=5)?,
            role: u.int_in_range(0..=4)?,
            nominal: u.arbitrary()?,
            typical: u.arbitrary()?,
            domain: u.int_in_range(0..=5)?,
            name_count: named.len() as u32,
            domain_min: u.arbitrary()?,
            domain_max: u.arbitrary()?,
            names: named.as_ptr(),
            deviation: texts.draw(u)?,
        };
        before.push(parameter);
        let plausible = [u.arbitrary()?, u.arbitrary()?];
        parameters.push(Parameter { before: parameter, plausible, plausible_source: texts.draw(u)? });
    }
    let mut needs = Vec::new();
    for _ in 0..u.int_in_range(0..=3)? {
        needs.push(u.int_in_range(0..=8)?);
    }
    let is_before = u.ratio(1, 4)?;
    let mut numbers = [0; 9];
    for (number, expected) in numbers.iter_mut().zip(front(is_before)) {
        *number = mostly(u, expected)?;
    }
    // A table that says to be of the version whose structs it has not: sizes tell, and are not both wrong by chance.
    if numbers[..3] == front(!is_before)[..3] {
        return Ok(());
    }
    numbers[5] = u.int_in_range(0..=7)?;
    numbers[6] = u.int_in_range(0..=2)?;
    // A count beyond what is there is refused by its size or not to be seen; null with a count is.
    let (none_there, too_many) = (u.ratio(1, 8)?, u.ratio(1, 8)?);
    numbers[7] = if none_there || too_many { u.int_in_range(5_000..=u32::MAX)? } else { parameters.len() as u32 };
    numbers[8] = needs.len() as u32;
    let mut drawn = [null(); 5];
    for text in &mut drawn {
        *text = texts.draw(u)?;
    }
    let first: *const c_void = if is_before { before.as_ptr().cast() } else { parameters.as_ptr().cast() };
    let table = Table {
        before: TableBefore {
            numbers,
            texts: drawn,
            parameters: if none_there { null() } else { first },
            needs: needs.as_ptr(),
            this: std::ptr::null_mut(),
            eval: if u.ratio(1, 16)? { None } else { Some(eval) },
        },
        picture: [u.int_in_range(0..=8)?, u.int_in_range(0..=4)?],
        words: [texts.draw(u)?, texts.draw(u)?, texts.draw(u)?],
    };
    // SAFETY: the table has the layout of effect.h, and all that it points to lives until the end of this function.
    if let Err(error) = unsafe { CEffect::new((&raw const table).cast()) } {
        said(error);
    }
    Ok(())
}
