//! The numbers of a scenario that a planner turns: its parameters, with where they stand.

use super::preset::at;
use super::{Result, Scenario, ScenarioError};
use serde::Serialize;
use toml::Value;

/// A number that can be turned, as `--set` sets it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dial {
    /// Name of the parameter.
    pub name: String,
    /// What it is.
    pub about: String,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Is it a whole number?
    pub whole: bool,
    /// What the scenario says: the first of the values that it sets. Nothing where that value is in the place of
    /// another one.
    pub value: Option<f64>,
}

impl Scenario {
    /// The parameters of a scenario's text in its order; `file_name` is for the messages.
    ///
    /// # Errors
    /// What is no scenario, with line and column.
    pub fn dials(text: &str, file_name: &str) -> Result<Vec<Dial>> {
        let scenario = Self::from_toml(text, file_name)?;
        let wrong = |error: toml::de::Error| ScenarioError::Toml { file: file_name.into(), message: error.to_string() };
        let tree: Value = toml::from_str(text).map_err(wrong)?;
        let number = |value: &Value| match value {
            Value::Integer(whole) => Some(*whole as f64),
            Value::Float(number) => Some(*number),
            _ => None,
        };
        let dial = |(name, own): (String, super::Parameter)| {
            let limit = |key: &str| at(&tree, &format!("parameters.{name}.{key}"));
            Dial {
                whole: ["min", "max"].iter().all(|key| matches!(limit(key), Some(Value::Integer(_)))),
                value: own.sets.first().and_then(|path| at(&tree, path)).and_then(number),
                about: own.about,
                min: own.min,
                max: own.max,
                name,
            }
        };
        let mut dials: Vec<Dial> = scenario.parameters.into_iter().map(dial).collect();
        // A table forgets the order of its keys.
        dials.sort_by_key(|dial| text.find(&format!("[parameters.{}]", dial.name)));
        Ok(dials)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{preset_names, preset_text};

    #[test]
    fn every_preset_can_be_turned_within_its_limits() {
        for preset in preset_names() {
            let text = preset_text(preset).unwrap();
            for dial in Scenario::dials(text, preset).unwrap() {
                let Dial { name, min, max, whole, value, .. } = dial;
                assert!(value.is_none_or(|value| (min..=max).contains(&value)), "{preset}, {name}: {value:?}");
                assert!(!whole || [min, max].iter().all(|limit| limit.fract() == 0.0), "{preset}, {name}");
                for end in [min, max] {
                    let turned = Scenario::preset(preset, &[(name.clone(), end)].into());
                    assert!(turned.is_ok(), "{preset}, {name}: {turned:?}");
                }
            }
        }
    }

    #[test]
    fn a_dial_says_what_the_scenario_says() {
        let dials = Scenario::dials(preset_text("mapping").unwrap(), "mapping").unwrap();
        let of = |name: &str| dials.iter().find(|dial| dial.name == name).unwrap();
        assert_eq!([of("height_m").value, of("cross_strips").value], [Some(80.0), Some(3.0)]);
        let [height, points] = ["height_m", "points"].map(|name| dials.iter().position(|dial| dial.name == name));
        assert!(height < points, "the order of the file");
        assert!(of("cross_strips").whole && !of("height_m").whole);
        let dials = Scenario::dials(preset_text("corridor").unwrap(), "corridor").unwrap();
        // A density stands in its place.
        assert_eq!(dials.iter().find(|dial| dial.name == "points").unwrap().value, None);
    }
}
