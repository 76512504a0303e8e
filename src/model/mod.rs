//! What we believe about a block: which camera parameters are free, which effects are in, weights, priors and datum.

use crate::camera::PARAMETER_COUNT;
use crate::effects::{Effect, Parameter, Role, Scope, Stage};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which observations define position, orientation and scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Datum {
    /// Tie points alone, minimal constraints.
    Free,
    /// Control points as weighted observations.
    Control,
    /// GNSS positions as weighted observations.
    Gnss,
    /// Whatever the block has of the two.
    All,
}

/// Robust loss on the squared normalised length `s` of an image residual; the cost is `rho(s) / 2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// `rho(s) = s`.
    None,
    /// `rho(s) = s` up to `a^2`, then `2 a sqrt(s) - a^2`, with `a` of [`LOSS_SCALE`].
    Huber,
    /// `rho(s) = a^2 log(1 + s / a^2)`.
    Cauchy,
}

/// Scale `a` of the robust losses, in standard deviations: the length of a 2D residual that one correct measurement in
/// 20 exceeds, `sqrt(-2 ln 0.05)`.
pub const LOSS_SCALE: f64 = 2.447_746_830_680_816;

/// Weights of tie points by the number m of images that see the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TieWeights {
    /// `1 / sigma^2`.
    Unit,
    /// Times m (m - 1): MicMac's multi-points.
    Multi,
    /// Times m (m - 1)^2: MicMac's points as pairs.
    Pairs,
}

/// Key among an effect's values that gives every estimated parameter a weak observation of its nominal value: the
/// factor by which the parameter's typical size is its standard deviation. For effects of many parameters, some of
/// which a block may not determine.
pub const PRIOR_KEY: &str = "prior";

/// An effect in the model.
#[derive(Clone)]
pub struct EffectTerm {
    /// The effect.
    pub effect: EffectRef,
    /// Start values (estimated, searched) and values (given), by parameter name; absent: nominal. For one value of a
    /// scoped parameter the key is `name[flight]`, `name[camera]` or `name[image]`.
    pub values: BTreeMap<String, f64>,
    /// Names of parameters that are held at their value.
    pub held: Vec<String>,
}

/// A built-in or plugged-in effect.
#[derive(Clone)]
pub enum EffectRef {
    /// Built in.
    Builtin(&'static dyn Effect),
    /// From a shared library; keeps it loaded.
    Plugin(std::sync::Arc<dyn Effect>),
}

impl std::ops::Deref for EffectRef {
    type Target = dyn Effect;
    fn deref(&self) -> &Self::Target {
        match self {
            EffectRef::Builtin(effect) => *effect,
            EffectRef::Plugin(effect) => effect.as_ref(),
        }
    }
}

impl EffectRef {
    /// Both solvers use the one derivation that there is, of a plug-in or of the library's user: their agreement proves
    /// nothing of it.
    pub fn has_one_derivation(&self) -> bool {
        matches!(self, EffectRef::Plugin(_))
    }

    /// [`Effect::with_own_derivatives`].
    pub fn with_own_derivatives(&self) -> Option<Self> {
        (**self).with_own_derivatives().map(EffectRef::Plugin)
    }

    /// The parameter that a key of [`EffectTerm::values`] or [`EffectTerm::held`] stands for: `name`, or
    /// `name[element]` for one value of a parameter with a scope. A random parameter may also be called by the name of
    /// its standard deviation. Whether the element is one of the block's is not known here.
    pub fn parameter_of(&self, key: &str) -> Option<&Parameter> {
        let (name, element) = match key.strip_suffix(']').and_then(|key| key.split_once('[')) {
            Some((name, element)) => (name, Some(element)),
            None => (key, None),
        };
        let is_called = |parameter: &&Parameter| match parameter.role {
            Role::Random(deviation) if deviation == name => true,
            _ => parameter.name == name,
        };
        let parameter = self.descriptor().parameters.iter().find(is_called)?;
        // In a block of several cameras, effects of lens and sensor have a value per camera.
        let of_camera = matches!(self.descriptor().stage, Stage::Interior | Stage::Image);
        let scoped = parameter.scope != Scope::Global || of_camera;
        let fits = element.is_none_or(|element| !element.is_empty() && scoped);
        fits.then_some(parameter)
    }
}

impl std::fmt::Debug for EffectRef {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.descriptor().id)
    }
}

impl std::fmt::Debug for EffectTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{:?}", self.effect.descriptor().id, self.values)
    }
}

/// An explicit weak observation of a camera parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prior {
    /// Camera id.
    pub camera: String,
    /// One of [`crate::camera::PARAMETERS`].
    pub parameter: String,
    /// Observed value, the parameter's unit.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Factors on the a-priori standard deviations, one per group of observations: 1 where they are believed as stated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SigmaFactors {
    /// Tie points and marks.
    pub image: f64,
    /// Marks of surveyed points, on top of `image`: people measure them, programs tie points.
    pub mark: f64,
    /// Control coordinates, horizontal.
    pub control: f64,
    /// Heights of control points.
    pub control_z: f64,
    /// GNSS positions, horizontal.
    pub gnss: f64,
    /// Heights of GNSS positions.
    pub gnss_z: f64,
}

/// Factors on the a-priori standard deviations of the measurements of one flight, on top of [`SigmaFactors`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlightFactors {
    /// Tie points and marks.
    pub image: f64,
    /// GNSS positions, horizontal.
    pub gnss: f64,
    /// Heights of GNSS positions.
    pub gnss_z: f64,
}

impl Default for FlightFactors {
    fn default() -> Self {
        Self { image: 1.0, gnss: 1.0, gnss_z: 1.0 }
    }
}

impl Default for SigmaFactors {
    fn default() -> Self {
        Self { image: 1.0, mark: 1.0, control: 1.0, control_z: 1.0, gnss: 1.0, gnss_z: 1.0 }
    }
}

/// What we believe.
#[derive(Debug, Clone)]
pub struct Model {
    /// Free parameters of every camera, in the order of [`crate::camera::PARAMETERS`].
    pub free: [bool; PARAMETER_COUNT],
    /// The centre of distortion is the principal point and moves with it: `dcx, dcy` are not unknowns.
    pub tie_dc_to_pp: bool,
    /// Start values that replace the block's, by camera id and parameter name.
    pub camera_values: BTreeMap<String, BTreeMap<String, f64>>,
    /// Effects, in the order in which they act within a stage.
    pub effects: Vec<EffectTerm>,
    /// Weak observations of camera parameters.
    pub priors: Vec<Prior>,
    /// Datum.
    pub datum: Datum,
    /// Robust loss on image measurements.
    pub loss: Loss,
    /// Tie-point weights.
    pub tie_weights: TieWeights,
    /// Factors on the a-priori standard deviations.
    pub sigma_factors: SigmaFactors,
    /// The same of single flights, by name. Where there are any, a diagnosis estimates the weights of images and GNSS
    /// by flight.
    pub flight_factors: BTreeMap<String, FlightFactors>,
}

impl Default for Model {
    /// All twelve free, no effects, free datum, least squares.
    fn default() -> Self {
        Self {
            free: [true; PARAMETER_COUNT],
            tie_dc_to_pp: false,
            camera_values: BTreeMap::new(),
            effects: Vec::new(),
            priors: Vec::new(),
            datum: Datum::Free,
            loss: Loss::None,
            tie_weights: TieWeights::Unit,
            sigma_factors: SigmaFactors::default(),
            flight_factors: BTreeMap::new(),
        }
    }
}
