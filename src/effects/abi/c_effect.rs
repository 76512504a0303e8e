//! An effect that comes as a table of C: what the table says is checked before the first call.

#![allow(unsafe_code)] // the ABI

use super::*;
use crate::effects::{Descriptor, Domain, Kind, Need, Parameter, Picture, Role, Scope, Stage};
use std::borrow::Cow;
use std::ffi::CStr;

/// Parameters of an effect, names of a value and needs at most, as a count beyond is no count: five times what the largest effect of the
/// catalogue has.
const MOST: u32 = 256;

/// `MISCLOSURE_DONE`: what an effect answers where it has written its values.
pub(super) const DONE: c_int = 1;
/// `MISCLOSURE_NOT_FINITE`.
const NOT_FINITE: c_int = 2;
/// `MISCLOSURE_THREW`.
const THREW: c_int = 3;

unsafe extern "C" {
    /// `eval` of an effect; see `cpp/guarded.h`.
    #[link_name = "misclosure_guarded_eval"]
    pub(super) fn guarded_eval(
        effect: *const RawEffect,
        context: *const RawContext,
        input: *const f64,
        theta: *const f64,
        out: *mut f64,
        d_in: *mut f64,
        d_theta: *mut f64,
    ) -> c_int;
}

/// What an answer that is not [`DONE`] says.
pub(super) fn fault_of(answer: c_int) -> EvalFault {
    match answer {
        NOT_FINITE => EvalFault::NotFinite,
        THREW => EvalFault::Threw,
        _ => EvalFault::Outside,
    }
}

fn field<T>(what: &str, value: Option<T>) -> Result<T, AbiError> {
    value.ok_or_else(|| AbiError::Field(format!("the effect's table has no valid {what}")))
}

/// # Safety
/// `text` is null or a C string that lives while this runs.
unsafe fn text(what: &str, text: *const c_char) -> Result<Cow<'static, str>, AbiError> {
    // SAFETY: a C string by the contract of this function.
    let text = unsafe { field(what, (!text.is_null()).then(|| CStr::from_ptr(text))) }?;
    Ok(field(what, text.to_str().ok())?.to_owned().into())
}

/// # Safety
/// `first` is null, or the first of `count` values that live while this runs.
unsafe fn array<'a, T>(what: &str, first: *const T, count: u32) -> Result<&'a [T], AbiError> {
    if count == 0 {
        return Ok(&[]);
    }
    if count > MOST {
        return Err(AbiError::Field(format!("the effect's table has {count} {what}, the most is {MOST}")));
    }
    let usable = !first.is_null() && first.is_aligned();
    // SAFETY: `count` values by the contract of this function.
    field(what, usable.then(|| unsafe { std::slice::from_raw_parts(first, count as usize) }))
}

/// # Safety
/// The pointers of `raw` are as `effect.h` states them.
unsafe fn parameter(raw: &RawParameter) -> Result<Parameter, AbiError> {
    // SAFETY: names, units and lists are C strings and arrays by the contract of this function.
    unsafe {
        let name = text("parameter name", raw.name)?;
        let scopes = [Scope::Global, Scope::Camera, Scope::Flight, Scope::FlightButFirst, Scope::Image];
        let role = match raw.role {
            0 => Role::Estimated,
            1 => Role::Searched(field(
                "search domain",
                match raw.domain {
                    1 => Some(Domain::SensorX),
                    2 => Some(Domain::SensorY),
                    3 => Some(Domain::SensorFraction(raw.domain_min, raw.domain_max)),
                    4 => Some(Domain::Range(raw.domain_min, raw.domain_max)),
                    _ => None,
                },
            )?),
            2 => {
                let mut names = Vec::new();
                for given in array("names of a given parameter", raw.names, raw.name_count)? {
                    // The trait's descriptor has static names; a plug-in is loaded once per run and its few names stay.
                    let name: &'static str =
                        Box::leak(text("name of a value", given.name)?.into_owned().into_boxed_str());
                    names.push((name, given.value));
                }
                Role::Given(names.into())
            }
            3 => Role::Random(Box::leak(text("name of a deviation", raw.deviation)?.into_owned().into_boxed_str())),
            _ => return field("role", None),
        };
        let (nominal, typical) = (raw.nominal, raw.typical);
        let sizes = nominal.is_finite() && typical.is_finite() && typical != 0.0;
        field("nominal value and typical size (finite, not zero)", sizes.then_some(()))?;
        Ok(Parameter {
            name,
            unit: text("unit", raw.unit)?,
            scope: field("scope", scopes.get(raw.scope as usize).copied())?,
            nominal,
            typical,
            role,
            plausible: None,
        })
    }
}

/// An effect behind the C ABI.
pub struct CEffect {
    raw: *const RawEffect,
    descriptor: Descriptor,
}

// SAFETY: the table is constant and `eval` is thread-safe by the second law of effect.h.
unsafe impl Send for CEffect {}
// SAFETY: as above.
unsafe impl Sync for CEffect {}

impl CEffect {
    /// Checks version and sizes, then reads the table.
    ///
    /// # Errors
    /// What is wrong with the table.
    ///
    /// # Safety
    /// `raw` is a table as `effect.h` describes it, and it, its strings, arrays and code stay where they are for as long as the result
    /// lives.
    pub unsafe fn new(raw: *const RawEffect) -> Result<Self, AbiError> {
        field("address", (!raw.is_null() && raw.is_aligned()).then_some(()))?;
        // SAFETY: the five numbers at the front are the same in every version; nothing else is read until they are right. What is
        // read then is as effect.h states it, by the contract of this function.
        unsafe {
            let found = (&raw const (*raw).abi_version).read();
            if found != ABI_VERSION {
                return Err(AbiError::Version { found });
            }
            let sizes = [
                ("misclosure_effect", (&raw const (*raw).effect_size).read(), size_of::<RawEffect>()),
                ("misclosure_parameter", (&raw const (*raw).parameter_size).read(), size_of::<RawParameter>()),
                ("misclosure_name", (&raw const (*raw).name_size).read(), size_of::<RawName>()),
                ("misclosure_context", (&raw const (*raw).context_size).read(), size_of::<RawContext>()),
            ];
            for (name, found, expected) in sizes {
                if found as usize != expected {
                    return Err(AbiError::Size { name, found, expected });
                }
            }
            let table = &*raw;
            let parameters = array("parameters", table.parameters, table.parameter_count)?;
            let needs = [
                Need::Time,
                Need::Temperature,
                Need::Flights,
                Need::Velocity,
                Need::Gnss,
                Need::Control,
                Need::Vertical,
            ];
            let stage = field("stage", Stage::ALL.get(table.stage as usize).copied())?;
            let descriptor = Descriptor {
                id: text("id", table.id)?,
                stage,
                kind: field("kind", [Kind::Physical, Kind::Empirical].get(table.kind as usize).copied())?,
                summary: text("summary", table.summary)?,
                formula: text("formula", table.formula)?,
                parameters: parameters.iter().map(|raw| parameter(raw)).collect::<Result<_, _>>()?,
                needs: array("needs", table.needs, table.need_count)?
                    .iter()
                    .map(|need| field("need", needs.get(*need as usize).copied()))
                    .collect::<Result<_, _>>()?,
                confused_with: text("confused_with", table.confused_with)?,
                source: text("source", table.source)?,
                picture: Picture::of_stage(stage),
                words: None,
            };
            field("eval", table.eval)?;
            Ok(Self { raw, descriptor })
        }
    }

    /// The table.
    pub fn raw(&self) -> *const RawEffect {
        self.raw
    }

    /// What it is.
    pub fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    /// As [`Effect::eval`](crate::effects::Effect::eval), derivatives as the table gives them.
    ///
    /// # Errors
    /// Why there are no values.
    ///
    /// # Panics
    /// If a slice has not the length that stage and parameters ask for.
    pub fn evaluate(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), EvalFault> {
        let (n, m, p) =
            (self.descriptor.stage.inputs(), self.descriptor.stage.outputs(), self.descriptor.parameters.len());
        assert_eq!(
            (input.len(), theta.len(), out.len()),
            (n, p, m),
            "input, theta and output of {}",
            self.descriptor.id
        );
        assert!(d_input.as_ref().is_none_or(|d| d.len() == m * n) && d_theta.as_ref().is_none_or(|d| d.len() == m * p));
        let raw = RawContext::new(context);
        let address = |d: &mut Option<&mut [f64]>| d.as_mut().map_or(std::ptr::null_mut(), |d| d.as_mut_ptr());
        let mut d_input = d_input;
        let mut d_theta = d_theta.filter(|d| !d.is_empty());
        // The call looks at what comes back: every number of a result is finite.
        // SAFETY: lengths were checked; the table's code is valid by the contract of `new`.
        let answer = unsafe {
            guarded_eval(
                self.raw,
                &raw,
                input.as_ptr(),
                theta.as_ptr(),
                out.as_mut_ptr(),
                address(&mut d_input),
                address(&mut d_theta),
            )
        };
        if answer == DONE { Ok(()) } else { Err(fault_of(answer)) }
    }
}
