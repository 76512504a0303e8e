//! Presets, and parameters given from outside.

use super::{Result, Scenario, ScenarioError};
use std::collections::BTreeMap;
use toml::Value;

const PRESETS: [(&str, &str); 4] = [
    ("dike", include_str!("../../data/scenarios/dike.toml")),
    ("corridor", include_str!("../../data/scenarios/corridor.toml")),
    ("mapping", include_str!("../../data/scenarios/mapping.toml")),
    ("closerange", include_str!("../../data/scenarios/closerange.toml")),
];

/// Integers below this are exact in a float.
const MAX_INTEGER: f64 = 9e15;

/// Names of the presets.
pub fn preset_names() -> Vec<&'static str> {
    PRESETS.iter().map(|(name, _)| *name).collect()
}

/// The TOML text of a preset.
pub fn preset_text(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(preset, _)| *preset == name).map(|(_, text)| *text)
}

impl Scenario {
    /// A preset, some of whose [`Scenario::parameters`] are given.
    ///
    /// # Errors
    /// Unknown preset or parameter, a value out of its range.
    pub fn preset(name: &str, overrides: &BTreeMap<String, f64>) -> Result<Self> {
        let text = preset_text(name).ok_or_else(|| ScenarioError::UnknownPreset { name: name.into() })?;
        Self::from_toml_with(text, name, overrides)
    }

    /// The scenario of a TOML text; `file_name` is for the messages.
    ///
    /// # Errors
    /// What is no scenario, with line and column; values that cannot be used, with their key.
    pub fn from_toml(text: &str, file_name: &str) -> Result<Self> {
        Self::from_toml_with(text, file_name, &BTreeMap::new())
    }

    /// [`Scenario::from_toml`], some of whose [`Scenario::parameters`] are given.
    ///
    /// # Errors
    /// As [`Scenario::from_toml`] and [`Scenario::preset`].
    pub fn from_toml_with(text: &str, file_name: &str, overrides: &BTreeMap<String, f64>) -> Result<Self> {
        let wrong = |message: String| ScenarioError::Toml { file: file_name.into(), message: message.trim().into() };
        // From the text first, also with overrides: its messages have line and column.
        let mut scenario: Scenario = toml::from_str(text).map_err(|error| wrong(error.to_string()))?;
        if !overrides.is_empty() {
            let mut tree: Value = toml::from_str(text).map_err(|error| wrong(error.to_string()))?;
            for (name, value) in overrides {
                scenario.apply(&mut tree, name, *value)?;
            }
            scenario = tree.try_into().map_err(|error: toml::de::Error| wrong(error.to_string()))?;
        }
        scenario.flights.retain(|flight| flight.strips != Some(0));
        scenario.validate()?;
        Ok(scenario)
    }

    fn apply(&self, tree: &mut Value, name: &str, value: f64) -> Result<()> {
        let parameter = self.parameters.get(name).ok_or_else(|| ScenarioError::UnknownParameter {
            scenario: self.name.clone(),
            name: name.into(),
            known: match self.parameters.keys().cloned().collect::<Vec<_>>().join(", ") {
                none if none.is_empty() => "none".into(),
                known => format!("one of {known}"),
            },
        })?;
        let wrong = |key: &str, expected: String| ScenarioError::Value {
            scenario: self.name.clone(),
            key: key.into(),
            value: value.to_string(),
            expected,
        };
        if !(parameter.min..=parameter.max).contains(&value) {
            return Err(wrong(name, format!("{} to {}", parameter.min, parameter.max)));
        }
        for path in &parameter.replaces {
            if let Some((table, key)) = parent(tree, path) {
                table.remove(key);
            }
        }
        for path in &parameter.sets {
            let (table, key) = parent(tree, path)
                .ok_or_else(|| wrong(&format!("parameters.{name}.sets"), format!("the path of a value, not {path}")))?;
            // An integer stays one; where nothing stands yet, a whole number is written as one and read as either.
            let whole = value.fract() == 0.0 && value.abs() < MAX_INTEGER;
            let integer = match table.get(key) {
                Some(Value::Integer(_)) if !whole => return Err(wrong(name, "a whole number".into())),
                Some(Value::Float(_)) => false,
                _ => whole,
            };
            table.insert(key.into(), if integer { Value::Integer(value as i64) } else { Value::Float(value) });
        }
        Ok(())
    }
}

/// The table that holds the last name of a dotted path, and that name; numbers index arrays.
fn parent<'t, 'p>(tree: &'t mut Value, path: &'p str) -> Option<(&'t mut toml::Table, &'p str)> {
    let (parents, key) = path.rsplit_once('.').unwrap_or(("", path));
    let mut node = tree;
    for name in parents.split('.').filter(|name| !name.is_empty()) {
        node = match node {
            Value::Table(table) => table.get_mut(name)?,
            Value::Array(array) => array.get_mut(name.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    node.as_table_mut().map(|table| (table, key))
}

/// The value at a dotted path; numbers index arrays.
pub(super) fn at<'t>(tree: &'t Value, path: &str) -> Option<&'t Value> {
    path.split('.').try_fold(tree, |node, name| match node {
        Value::Table(table) => table.get(name),
        Value::Array(array) => array.get(name.parse::<usize>().ok()?),
        _ => None,
    })
}
