//! Reads the table of an effect: version and sizes first, then every text, count and number, each refused with the
//! reason.

#![allow(unsafe_code)] // the ABI

use super::layout::{RawEffect, RawEffect2, RawName, RawParameter, RawParameter2};
use super::{ABI_VERSION, ABI_VERSION_BEFORE, AbiError, RawContext};
use crate::effects::{By, Descriptor, Domain, Kind, Need, Parameter, Picture, Plausible, Role, Scope, Stage, Words};
use std::borrow::Cow;
use std::ffi::c_char;

/// Parameters of an effect, names of a value and needs at most, as a count beyond is no count: five times those of the
/// largest effect of the catalogue.
const MOST: u32 = 256;
/// Bytes of a text at most, as a text beyond has no end.
const LONGEST: usize = 16384;

/// What a table says.
pub(super) struct Table {
    /// Its version of `effect.h`.
    pub version: u32,
    /// What both versions have.
    pub two: RawEffect2,
    /// The effect.
    pub descriptor: Descriptor,
}

/// Reads a table of version 2 or 3.
///
/// # Errors
/// What is wrong with it.
///
/// # Safety
/// `raw` is null, or a table as `effect.h` of its version describes it.
pub(super) unsafe fn read(raw: *const RawEffect) -> Result<Table, AbiError> {
    field("address", (!raw.is_null() && raw.is_aligned()).then_some(()))?;
    // SAFETY: the five numbers at the front are the same in every version; nothing else is read until they are right.
    // The rest is as effect.h of that version states it, by the contract of this function.
    unsafe {
        let version = sizes_fit(raw.cast())?;
        let two = raw.cast::<RawEffect2>().read();
        let parameters: Result<Vec<Parameter>, AbiError> = match version {
            ABI_VERSION_BEFORE => {
                let raw = array::<RawParameter2>("parameters", two.parameters.cast(), two.parameter_count)?;
                raw.iter().map(|raw| parameter(raw)).collect()
            }
            _ => {
                let raw = array::<RawParameter>("parameters", two.parameters.cast(), two.parameter_count)?;
                raw.iter().map(|raw| ranged(raw)).collect()
            }
        };
        let parameters = parameters?;
        let stage = field("stage", Stage::ALL.get(two.stage as usize).copied())?;
        let mut descriptor = Descriptor {
            id: text("id", two.id)?,
            stage,
            kind: field("kind", [Kind::Physical, Kind::Empirical].get(two.kind as usize).copied())?,
            summary: text("summary", two.summary)?,
            formula: text("formula", two.formula)?,
            parameters,
            needs: needs(&two)?,
            confused_with: text("confused_with", two.confused_with)?,
            source: text("source", two.source)?,
            picture: Picture::of_stage(stage),
            words: None,
        };
        if version != ABI_VERSION_BEFORE {
            let table = &*raw;
            descriptor.picture = picture(stage, table)?;
            descriptor.words = words(table)?;
        }
        field("eval", two.eval)?;
        Ok(Table { version, two, descriptor })
    }
}

/// The version of a table whose structs have the sizes of that version.
///
/// # Safety
/// The five numbers at the front of `raw` can be read.
unsafe fn sizes_fit(raw: *const RawEffect2) -> Result<u32, AbiError> {
    // SAFETY: by the contract of this function; nothing behind them is read.
    let [version, sizes @ ..] = unsafe {
        [
            (&raw const (*raw).abi_version).read(),
            (&raw const (*raw).effect_size).read(),
            (&raw const (*raw).parameter_size).read(),
            (&raw const (*raw).name_size).read(),
            (&raw const (*raw).context_size).read(),
        ]
    };
    let [effect, parameter] = match version {
        ABI_VERSION_BEFORE => [size_of::<RawEffect2>(), size_of::<RawParameter2>()],
        ABI_VERSION => [size_of::<RawEffect>(), size_of::<RawParameter>()],
        found => return Err(AbiError::Version { found }),
    };
    let expected = [
        ("misclosure_effect", effect),
        ("misclosure_parameter", parameter),
        ("misclosure_name", size_of::<RawName>()),
        ("misclosure_context", size_of::<RawContext>()),
    ];
    for (found, (name, expected)) in sizes.into_iter().zip(expected) {
        if found as usize != expected {
            return Err(AbiError::Size { name, found, expected });
        }
    }
    Ok(version)
}

fn field<T>(what: &str, value: Option<T>) -> Result<T, AbiError> {
    value.ok_or_else(|| AbiError::Field(format!("the effect's table has no valid {what}")))
}

/// # Safety
/// `text` is null, or a C string that lives while this runs.
unsafe fn text(what: &str, text: *const c_char) -> Result<Cow<'static, str>, AbiError> {
    field(what, (!text.is_null()).then_some(()))?;
    // SAFETY: a C string by the contract of this function: each byte up to its zero can be read, and none behind it is.
    let length = (0..=LONGEST).find(|k| unsafe { text.add(*k).read() } == 0);
    let Some(length) = length else {
        return Err(AbiError::Field(format!("the {what} of the effect's table is longer than {LONGEST} bytes")));
    };
    // SAFETY: as many bytes were read above.
    let bytes = unsafe { std::slice::from_raw_parts(text.cast::<u8>(), length) };
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned().into()),
        Err(_) => Err(AbiError::Field(format!("the effect's table has no valid {what}: it is not UTF-8"))),
    }
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
/// As [`array`], of the needs.
unsafe fn needs(two: &RawEffect2) -> Result<Vec<Need>, AbiError> {
    let all = [Need::Time, Need::Temperature, Need::Flights, Need::Velocity, Need::Gnss, Need::Control, Need::Vertical];
    // SAFETY: by the contract of this function.
    let stated = unsafe { array("needs", two.needs, two.need_count) }?;
    stated.iter().map(|need| field("need", all.get(*need as usize).copied())).collect()
}

/// A parameter without its range.
///
/// # Safety
/// The pointers of `raw` are as `effect.h` states them.
unsafe fn parameter(raw: &RawParameter2) -> Result<Parameter, AbiError> {
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
            4 => Role::VelocityError,
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

/// A parameter with its range, if one is stated.
///
/// # Safety
/// As [`parameter`].
unsafe fn ranged(raw: &RawParameter) -> Result<Parameter, AbiError> {
    // SAFETY: by the contract of this function.
    let parameter = unsafe { parameter(&raw.two) }?;
    let (min, max) = (raw.plausible_min, raw.plausible_max);
    let fail = |what: &str| {
        let name = &parameter.name;
        Err(AbiError::Field(format!("parameter `{name}` has a plausible range from {min} to {max}{what}")))
    };
    if raw.plausible_source.is_null() {
        // Zeros are what C puts where nothing is stated.
        let none = min == 0.0 && max == 0.0;
        return if none { Ok(parameter) } else { fail(", but not its source: state where it comes from") };
    }
    // Infinite and overflowing widths, and NaN, are none.
    if !(min < max && (max - min).is_finite()) {
        return fail(": expected two finite numbers, the smaller one first");
    }
    // SAFETY: a C string by the contract of this function.
    let source = unsafe { text("source of a plausible range", raw.plausible_source) }?;
    Ok(Parameter { plausible: Some(Plausible { min, max, source }), ..parameter })
}

/// The picture that a table states, else that of the stage.
fn picture(stage: Stage, table: &RawEffect) -> Result<Picture, AbiError> {
    let all = [By::Time, By::Temperature, By::Heading, By::Order];
    let by = field("picture_by", all.get(table.picture_by as usize).copied())?;
    field(
        "picture",
        match table.picture {
            0 => Some(Picture::of_stage(stage)),
            1 => Some(Picture::Sensor),
            2 => Some(Picture::Row),
            3 => Some(Picture::Radius),
            4 => Some(Picture::Scale(by)),
            5 => Some(Picture::Shift(by)),
            6 => Some(Picture::Gnss(by)),
            7 => Some(Picture::Surveyed),
            _ => None,
        },
    )
}

/// The words that a table states: all three, or none.
///
/// # Safety
/// The texts are null, or C strings that live while this runs.
unsafe fn words(table: &RawEffect) -> Result<Option<Words>, AbiError> {
    let three = [("what", table.what), ("remedy", table.remedy), ("tell", table.tell)];
    let missing: Vec<&str> = three.iter().filter(|(_, text)| text.is_null()).map(|(name, _)| *name).collect();
    match missing.len() {
        0 => {}
        3 => return Ok(None),
        _ => {
            let missing = missing.join("` and `");
            let text = format!("of the effect's words `{missing}` is missing: state what, remedy and tell, or none");
            return Err(AbiError::Field(text));
        }
    }
    // SAFETY: by the contract of this function.
    unsafe {
        Ok(Some(Words {
            what: text("`what`", table.what)?,
            remedy: text("`remedy`", table.remedy)?,
            tell: text("`tell`", table.tell)?,
        }))
    }
}
