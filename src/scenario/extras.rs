//! Additions to a planned flight, from a TOML file: each a part of a scenario with its cost.
//!
//! ```toml
//! unit = "images"                     # of the costs
//!
//! [[extra]]
//! name = "ten control points more"
//! cost = 5
//! surveyed.control.count = 20         # a key of the scenario, in the place of its value
//!
//! [[extra]]
//! name = "cross strips"
//! cost = 24
//! [[extra.flight]]                    # flights join those of the scenario
//! name = "cross60"
//! # ... as in a scenario
//! ```
//!
//! Two additions that set the same key, or have a flight of the same name, exclude each other.

use super::{Scenario, ScenarioError};
use std::collections::{BTreeMap, BTreeSet};
use toml::{Table, Value};

/// Additions of a file at most: sets of them are tried one by one.
const MOST: usize = 12;
/// What an addition adds to; all else it replaces.
const FLIGHTS: &str = "flight";

/// An addition.
#[derive(Debug, Clone)]
pub struct Extra {
    /// Its name.
    pub name: String,
    /// Its cost.
    pub cost: f64,
    part: Table,
}

/// The additions of a file.
#[derive(Debug, Clone)]
pub struct Extras {
    /// Unit of the costs.
    pub unit: String,
    /// The additions.
    pub list: Vec<Extra>,
}

/// Why a file has no additions, or a scenario with some of them cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ExtraError {
    /// Of the file.
    #[error("{file}: {message}")]
    File {
        /// Name.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// Of a scenario with additions.
    #[error("with {names}: {error}")]
    Scenario {
        /// The additions.
        names: String,
        /// What is wrong.
        error: ScenarioError,
    },
}

/// The file as it is written.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    unit: String,
    extra: Vec<Table>,
}

impl Extras {
    /// Reads additions; `file` is for the messages.
    ///
    /// # Errors
    /// What is no addition, with its name, or with line and column.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, ExtraError> {
        let wrong = |message: String| ExtraError::File { file: file.into(), message: message.trim().into() };
        let read: File = toml::from_str(text).map_err(|error| wrong(error.to_string()))?;
        if !(1..=MOST).contains(&read.extra.len()) {
            return Err(wrong(format!("{} additions, expected 1 to {MOST}", read.extra.len())));
        }
        let mut list: Vec<Extra> = Vec::new();
        for (number, mut part) in read.extra.into_iter().enumerate() {
            let Some(Value::String(name)) = part.remove("name") else {
                return Err(wrong(format!("extra {}: expected name = \"...\"", number + 1)));
            };
            let cost = match part.remove("cost") {
                Some(Value::Integer(cost)) => cost as f64,
                Some(Value::Float(cost)) => cost,
                _ => f64::NAN,
            };
            if !(cost > 0.0 && cost.is_finite()) {
                return Err(wrong(format!("extra `{name}`: expected cost = a number above 0")));
            }
            if part.is_empty() {
                return Err(wrong(format!("extra `{name}`: expected keys of a scenario, or flights")));
            }
            if list.iter().any(|other| other.name == name) {
                return Err(wrong(format!("extra `{name}` stands there twice")));
            }
            list.push(Extra { name, cost, part });
        }
        Ok(Self { unit: read.unit, list })
    }

    /// Do two additions set the same key, or have a flight of the same name?
    pub fn exclude(&self, a: usize, b: usize) -> bool {
        let [a, b] = [a, b].map(|own| keys(&self.list[own].part));
        a.intersection(&b).next().is_some()
    }

    /// Names of some additions.
    pub fn names(&self, chosen: &[usize]) -> Vec<&str> {
        chosen.iter().map(|own| self.list[*own].name.as_str()).collect()
    }

    /// The scenario of a text with some additions.
    ///
    /// # Errors
    /// A scenario that cannot be used, with the names of the additions.
    pub fn scenario(
        &self,
        text: &str,
        file: &str,
        overrides: &BTreeMap<String, f64>,
        chosen: &[usize],
    ) -> Result<Scenario, ExtraError> {
        let names = || self.names(chosen).join(", ");
        let mut tree: Table = text
            .parse()
            .map_err(|error: toml::de::Error| ExtraError::File { file: file.into(), message: error.to_string() })?;
        chosen.iter().for_each(|own| merge(&mut tree, &self.list[*own].part));
        Scenario::from_toml_with(&tree.to_string(), file, overrides)
            .map_err(|error| ExtraError::Scenario { names: names(), error })
    }
}

/// Puts the values of `part` into `tree`; flights are added.
fn merge(tree: &mut Table, part: &Table) {
    for (key, value) in part {
        match (tree.get_mut(key), value) {
            (Some(Value::Table(own)), Value::Table(part)) => merge(own, part),
            (Some(Value::Array(own)), Value::Array(part)) if key == FLIGHTS => own.extend(part.iter().cloned()),
            _ => {
                tree.insert(key.clone(), value.clone());
            }
        }
    }
}

/// Dotted paths of the values that a part sets; of flights their names.
fn keys(part: &Table) -> BTreeSet<String> {
    let below = |(key, value): (&String, &Value)| match value {
        Value::Table(table) => keys(table).into_iter().map(|below| format!("{key}.{below}")).collect(),
        Value::Array(flights) if key == FLIGHTS => {
            let name = |flight: &Value| Some(format!("{key}.{}", flight.get("name")?.as_str()?));
            flights.iter().filter_map(name).collect()
        }
        _ => vec![key.clone()],
    };
    part.iter().flat_map(below).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::preset_text;

    const FILE: &str = "unit = \"points\"\n\
                        [[extra]]\nname = \"some\"\ncost = 5\nsurveyed.control.count = 20\n\
                        [[extra]]\nname = \"many\"\ncost = 9.5\nsurveyed.control.count = 40\n\
                        [[extra]]\nname = \"no check points\"\ncost = 1\nsurveyed.check.count = 0\n";

    #[test]
    fn additions_replace_values_and_add_flights() {
        let extras = Extras::from_toml(FILE, "extra.toml").unwrap();
        assert_eq!((extras.unit.as_str(), extras.list[1].cost), ("points", 9.5));
        assert!(extras.exclude(0, 1) && !extras.exclude(0, 2));
        let flights = |a: &str, b: &str| {
            let extra = |name: &str, flight: &str| {
                format!("[[extra]]\nname = \"{name}\"\ncost = 1\n[[extra.flight]]\nname = \"{flight}\"\n")
            };
            Extras::from_toml(&(extra("one", a) + &extra("two", b)), "extra.toml").unwrap().exclude(0, 1)
        };
        assert!(flights("cross", "cross") && !flights("cross", "along"));
        let text = preset_text("dike").unwrap();
        let scenario = |chosen: &[usize]| extras.scenario(text, "dike", &BTreeMap::new(), chosen).unwrap();
        let changed = scenario(&[1, 2]).surveyed;
        assert_eq!([changed.control.count, changed.check.count], [40, 0]);
        let own: Table = text.parse().unwrap();
        let flight = own["flight"][0].clone();
        let mut part = Table::new();
        part.insert("flight".into(), Value::Array(vec![flight]));
        let mut tree = own.clone();
        merge(&mut tree, &part);
        assert_eq!(tree["flight"].as_array().unwrap().len(), own["flight"].as_array().unwrap().len() + 1);
    }

    #[test]
    fn what_is_no_addition_is_named() {
        for (text, named) in [
            ("[[extra]]\ncost = 1\n", "extra 1: expected name"),
            ("[[extra]]\nname = \"a\"\ncost = -1\nx = 1\n", "extra `a`: expected cost"),
            ("[[extra]]\nname = \"a\"\ncost = 1\n", "extra `a`: expected keys"),
            ("extra = []\n", "0 additions"),
            ("[[extra]\n", "line 1"),
        ] {
            let error = Extras::from_toml(text, "extra.toml").unwrap_err().to_string();
            assert!(error.starts_with("extra.toml: ") && error.contains(named), "{text}: {error}");
        }
        let wrong = "[[extra]]\nname = \"odd\"\ncost = 1\nsurveyed.control.count = -3\n";
        let extras = Extras::from_toml(wrong, "extra.toml").unwrap();
        let error = extras.scenario(preset_text("dike").unwrap(), "dike", &BTreeMap::new(), &[0]).unwrap_err();
        assert!(error.to_string().starts_with("with odd: "), "{error}");
    }
}
