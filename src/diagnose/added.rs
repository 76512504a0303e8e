//! What a diagnosis has taken into a model.

use std::collections::BTreeMap;

/// What the diagnosis took into a model, beside the user's own effects.
#[derive(Debug, Clone, Default)]
pub struct Added {
    /// Effects that are the user's own: the first so many of the model.
    pub own: usize,
    /// Groups of camera parameters that were set free, with the values that they were held at, by camera.
    pub freed: BTreeMap<String, Vec<(usize, Vec<f64>)>>,
    /// Effects that were searched over the sensor, with the number of places.
    pub placed: BTreeMap<String, f64>,
}
