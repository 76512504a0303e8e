//! What is asked of a diagnosis.

use crate::adjust::Options;
use crate::model::EffectRef;

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
