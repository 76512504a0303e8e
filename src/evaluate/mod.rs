//! Judges an adjusted block from outside: it takes surveyed points into the adjusted images, and cameras onto each
//! other. It knows no solver and no effect, so a block from another program is judged by the same code.
//!
//! ```text
//! marks + ImageModel ──► intersection ──► similarity (from control) ──► checks (rows, statistics) ──► bowl
//! two cameras ──► distortion_field
//! ```

pub mod bowl;
pub mod checks;
pub mod distortion_field;
pub mod intersection;
pub mod plain_model;
pub mod similarity;

pub use bowl::{Bowl, BowlShape};
pub use checks::{Alignment, CheckRow, Comparison, Statistics, compare, similarity_weight};
pub use intersection::{FailedIntersection, Failure, Intersection, Intersections, Method};
pub use plain_model::PlainModel;
pub use similarity::{Similarity, SimilarityFit};

use crate::block::ImageId;
use intersection::Observation;
use nalgebra::{Matrix2x3, Vector3};

/// An image point (px) and its 2x3 derivative by the object point (px/m).
pub type ProjectedPoint = ([f64; 2], Matrix2x3<f64>);

/// How adjusted images see the world, whatever effects stand behind it.
pub trait ImageModel: Sync {
    /// Image point of a world point (m, in the system of the adjusted poses), as the camera records it; `None` where
    /// there is none (behind the camera).
    fn project(&self, image: ImageId, point: &Vector3<f64>) -> Option<ProjectedPoint>;

    /// [`Self::project`] of a point in the image of each observation; `None` where there is none in one of them.
    fn project_each(&self, observations: &[Observation], point: &Vector3<f64>) -> Option<Vec<ProjectedPoint>> {
        observations.iter().map(|o| self.project(o.image, point)).collect()
    }

    /// Coordinates (m) that the survey would give of a point: the effects of control and frame, else the point itself.
    fn surveyed(&self, point: &Vector3<f64>) -> Vector3<f64>;

    /// Projection centre (m).
    fn centre(&self, image: ImageId) -> Vector3<f64>;

    /// Unit vector (world axes) of the viewing ray of an image point (px), for start values and for intersection in
    /// space; `None` where the camera cannot be inverted.
    fn ray(&self, image: ImageId, observed: [f64; 2]) -> Option<Vector3<f64>>;
}
