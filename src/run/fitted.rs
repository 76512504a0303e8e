//! The adjusted images, effects included, as something that surveyed points can be compared with.

use crate::block::ImageId;
use crate::evaluate::intersection::Observation;
use crate::evaluate::{ImageModel, ProjectedPoint};
use crate::measure::{Predictor, Sighted};
use nalgebra::Vector3;

/// Adjusted images with their effects.
pub struct FittedModel<'a> {
    /// Predictions at the adjusted state.
    pub predictor: Predictor<'a>,
}

impl ImageModel for FittedModel<'_> {
    fn project(&self, image: ImageId, point: &Vector3<f64>) -> Option<ProjectedPoint> {
        self.predictor.image_point(image.index(), point)
    }

    fn project_each(&self, observations: &[Observation], point: &Vector3<f64>) -> Option<Vec<ProjectedPoint>> {
        let sighted = |o: &Observation| Sighted { image: o.image.index(), point: *point };
        self.predictor.image_points(observations.iter().map(sighted)).into_iter().collect()
    }

    fn surveyed(&self, point: &Vector3<f64>) -> Vector3<f64> {
        // Control effects are defined everywhere; one that refuses a point shows as NaN in the table.
        self.predictor.surveyed(point).unwrap_or_else(|| Vector3::repeat(f64::NAN))
    }

    fn centre(&self, image: ImageId) -> Vector3<f64> {
        self.predictor.centre(image.index())
    }

    fn ray(&self, image: ImageId, observed: [f64; 2]) -> Option<Vector3<f64>> {
        self.predictor.ray(image.index(), observed)
    }
}
