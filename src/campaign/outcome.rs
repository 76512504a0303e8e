//! What a case gave, in the keys of its file.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a diagnosis said of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// `adequate`, `missing`, `unexplained` or `mistake`.
    pub verdict: String,
    /// Effects that it named.
    pub named: Vec<String>,
    /// Mistakes that it named, as `kind of subject`.
    pub mistakes: Vec<String>,
    /// Did it name what was expected, and nothing else?
    pub right: bool,
    /// Figures by name: counts, px, m. A figure that a block does not have is absent.
    pub figures: BTreeMap<String, f64>,
    /// Tests of the catalogue at the base model.
    pub candidates: Vec<Candidate>,
    /// Sizes of what was named.
    pub estimates: Vec<Estimate>,
}

/// An effect, tested at the base model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Its id.
    pub effect: String,
    /// p-value of its test alone.
    pub p_value: f64,
}

/// A parameter of an effect that was named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The effect.
    pub effect: String,
    /// Its parameter.
    pub parameter: String,
    /// In `unit`.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Unit.
    pub unit: String,
}

impl Outcome {
    /// All that was named, effects and mistakes, in order.
    pub fn said(&self) -> Vec<&str> {
        let mut all: Vec<&str> = self.named.iter().chain(&self.mistakes).map(String::as_str).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}
