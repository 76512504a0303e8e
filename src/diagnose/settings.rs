//! What is asked of a diagnosis.

use crate::adjust::Options;
use crate::model::EffectRef;
use crate::snooping::settle::Settling;

/// What a diagnosis needs besides block and model.
pub struct Settings<'a> {
    /// Effects from plug-ins.
    pub plugins: &'a [EffectRef],
    /// Options of every fit.
    pub options: Options,
    /// Family-wise significance level.
    pub significance: f64,
    /// Are outliers searched, and set aside?
    pub snoop: bool,
    /// Told what is being done, from whatever thread does it.
    pub tell: &'a (dyn Fn(&str) + Sync),
}

impl Settings<'_> {
    /// How its fits settle.
    pub fn settling(&self) -> Settling<'_> {
        Settling { options: &self.options, snoop: self.snoop, tell: self.tell }
    }
}
