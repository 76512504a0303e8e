//! An error as named on the command line: `ID[:key=value,...]`.

use super::{Cause, ParameterSpec, Values, registry};
use anyhow::{Context, Result, bail};
use std::fmt;

/// A cause with its parameters.
#[derive(Clone)]
pub struct Injection {
    /// The cause.
    pub cause: &'static Cause,
    /// Its parameters, defaults filled in.
    pub values: Values,
}

impl fmt::Debug for Injection {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Injection").field("id", &self.cause.id()).field("values", &self.values).finish()
    }
}

/// Reads `ID[:key=value,...]`, `local-flaw:lambda=10,sigma=200` say.
///
/// # Errors
/// An unknown id (the nearest ones are named), an unknown or repeated key, text that is no value of its type.
pub fn parse(text: &str) -> Result<Injection> {
    let (id, assignments) = text.split_once(':').unwrap_or((text, ""));
    let Some(cause) = super::find(id) else {
        let near = nearest(id, registry().iter().map(|cause| cause.id()).collect());
        bail!("no error is called `{id}`; nearest: {}", near.join(", "));
    };
    let values = assigned(&format!("error `{id}`"), cause.parameters(), assignments)?;
    Ok(Injection { cause, values })
}

/// Reads `key=value,...` into the values of a table; what is not given has its default. Messages begin with `what`.
pub(super) fn assigned(what: &str, specs: &'static [ParameterSpec], assignments: &str) -> Result<Values> {
    let mut values = Values::defaults(specs);
    let mut seen = Vec::new();
    for assignment in assignments.split(',').filter(|assignment| !assignment.is_empty()) {
        let Some((key, value)) = assignment.split_once('=') else {
            bail!("{what}: `{assignment}` is not of the form key=value");
        };
        if seen.contains(&key) {
            bail!("{what}: parameter `{key}` is given twice");
        }
        values.set(specs, key, value).with_context(|| what.to_owned())?;
        seen.push(key);
    }
    Ok(values)
}

/// How many near names an error message lists.
const NEAREST: usize = 3;

/// The names that are nearest to one that is none of them.
pub(super) fn nearest<'a>(id: &str, mut ids: Vec<&'a str>) -> Vec<&'a str> {
    // A stable sort: equally near ids stay in the order of the registry.
    ids.sort_by_key(|candidate| edit_distance(id, candidate));
    ids.truncate(NEAREST);
    ids
}

/// Levenshtein distance of two words.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edit_distance_of_known_words() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("same", "same"), 0);
    }
}
