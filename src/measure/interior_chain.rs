//! How an interior orientation follows what its effects are given.

use crate::camera::PARAMETER_COUNT as COUNT;
use nalgebra::SMatrix;
use std::sync::Arc;

/// Derivatives of the interior orientation after its effects. The matrices, which few effects have, stand elsewhere:
/// whether they are there is asked at every measurement.
#[derive(Debug, Clone)]
pub struct InteriorChain {
    /// 12x12, by the camera's interior orientation; `None` where the effects only add to it (identity).
    pub d_interior: Option<Box<SMatrix<f64, COUNT, COUNT>>>,
    /// 12x3, by the rotation `w`; `None` where no effect depends on it (zero).
    pub d_rotation: Option<Box<SMatrix<f64, COUNT, 3>>>,
    /// Local parameters, and entries of the twelve, that `d_theta` is of: those where it is not zero in any image. Most
    /// effects move one or four of twelve numbers. Images that are prepared together have it in common.
    pub places: Arc<[(usize, usize)]>,
    /// By the local parameters.
    pub d_theta: Vec<f64>,
}

impl InteriorChain {
    /// Derivatives by local parameters: the parameter, the entry, the value.
    pub fn by_theta(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.places.iter().zip(&self.d_theta).map(|((local, entry), value)| (*local, *entry, *value))
    }

    /// Whether the effects only add to the interior orientation.
    pub fn adds(&self) -> bool {
        self.d_interior.is_none() && self.d_rotation.is_none()
    }

    /// Takes other places, which have all that are not zero among them.
    pub(super) fn at_places(&mut self, places: &Arc<[(usize, usize)]>) {
        let mut d_theta = vec![0.0; places.len()];
        for (local, entry, value) in self.by_theta() {
            if let Ok(k) = places.binary_search(&(local, entry)) {
                d_theta[k] = value;
            }
        }
        (self.places, self.d_theta) = (places.clone(), d_theta);
    }
}
