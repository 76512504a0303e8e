//! The words of `--free`, `--fix` and `--add`: names of camera parameters, and effects with their start values.

use super::Usage;
use crate::camera::{GROUPS, PARAMETERS, parameter_indices};
use crate::effects::{Descriptor, Parameter, Role};
use crate::model::{EffectRef, EffectTerm, PRIOR_KEY};
use std::collections::BTreeMap;

/// Indices into [`PARAMETERS`] of all names of the lists.
pub(super) fn indices(lists: &[String], option: &str) -> Result<Vec<usize>, Usage> {
    let names = lists.iter().flat_map(|list| list.split([',', ' '])).filter(|name| !name.is_empty());
    let mut found = Vec::new();
    for name in names {
        found.extend(parameter_indices(name).ok_or_else(|| {
            let groups: Vec<&str> = GROUPS.iter().map(|(group, _)| *group).collect();
            Usage(format!(
                "{option} {name}: no such parameter; there are the groups {} all none and the parameters {}",
                groups.join(" "),
                PARAMETERS.join(" ")
            ))
        })?);
    }
    Ok(found)
}

/// Parses `EFFECT[:param=start,...]` of an option. One value of a scoped parameter is `param[flight]=start`.
pub(super) fn effect_term(
    option: &str,
    text: &str,
    find: &dyn Fn(&str) -> Option<EffectRef>,
) -> Result<EffectTerm, Usage> {
    let (id, list) = text.split_once(':').unwrap_or((text, ""));
    let effect = find(id).ok_or_else(|| Usage(format!("{option} {text}: {}", super::effects::unknown(id))))?;
    let mut values = BTreeMap::new();
    for setting in list.split(',').filter(|setting| !setting.is_empty()) {
        let (key, value) = setting
            .split_once('=')
            .ok_or_else(|| Usage(format!("{option} {text}: `{setting}` is not of the form param=value")))?;
        let number = if key.trim() == PRIOR_KEY {
            let not_one = || Usage(format!("{option} {text}: `{}` is not a number", value.trim()));
            value.trim().parse().map_err(|_| not_one())?
        } else {
            let parameter =
                parameter(effect.descriptor(), key.trim()).map_err(|what| Usage(format!("{option} {text}: {what}")))?;
            number(parameter, value.trim()).map_err(|what| Usage(format!("{option} {text}: {what}")))?
        };
        if values.insert(key.trim().to_string(), number).is_some() {
            return Err(Usage(format!("{option} {text}: `{key}` stands there twice")));
        }
    }
    Ok(EffectTerm { effect, values, held: Vec::new() })
}

fn parameter<'a>(descriptor: &'a Descriptor, key: &str) -> Result<&'a Parameter, String> {
    let name = key.split_once('[').map_or(key, |(name, _)| name);
    descriptor.parameters.iter().find(|parameter| parameter.name == name).ok_or_else(|| {
        let names: Vec<&str> = descriptor.parameters.iter().map(|parameter| parameter.name.as_ref()).collect();
        format!("`{}` has no parameter `{name}`; it has: {}", descriptor.id, names.join(", "))
    })
}

/// A finite number, or the name of a value of a given parameter.
fn number(parameter: &Parameter, text: &str) -> Result<f64, String> {
    let named: &[(&str, f64)] = match &parameter.role {
        Role::Given(names) => names,
        _ => &[],
    };
    if let Some((_, value)) = named.iter().find(|(name, _)| *name == text) {
        return Ok(*value);
    }
    let expected = || {
        let names: String = named.iter().map(|(name, _)| format!(" or `{name}`")).collect();
        format!("`{}={text}`: expected a number ({}){names}", parameter.name, parameter.unit)
    };
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(expected)?;
    match parameter.expected_instead_of(value) {
        Some(expected) => Err(format!("`{}={text}`: expected {expected}", parameter.name)),
        None => Ok(value),
    }
}
