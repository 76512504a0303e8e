//! Why a measurement cannot be predicted.

use crate::problem::Problem;

/// What cannot be predicted at a state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// An image's interior orientation, and so none of its points.
    #[error("the interior orientation of image `{image}`: an effect is outside its domain")]
    Interior {
        /// Name.
        image: String,
    },
    /// An image point.
    #[error("point `{point}` in image `{image}`: behind the camera, or outside an effect's domain")]
    ImagePoint {
        /// Name.
        image: String,
        /// Name.
        point: String,
    },
    /// An antenna position.
    #[error("the antenna of image `{image}`: a position effect is outside its domain")]
    Antenna {
        /// Name.
        image: String,
    },
    /// Surveyed coordinates.
    #[error("the surveyed coordinates of point `{point}`: a control effect is outside its domain")]
    Surveyed {
        /// Name.
        point: String,
    },
}

impl MeasureError {
    /// [`MeasureError::Interior`] of an image by its position.
    pub fn interior(problem: &Problem, image: usize) -> Self {
        Self::Interior { image: problem.image_names[image].clone() }
    }

    /// [`MeasureError::ImagePoint`] of point and image by their positions.
    pub fn image_point(problem: &Problem, point: usize, image: usize) -> Self {
        Self::ImagePoint { image: problem.image_names[image].clone(), point: problem.point_names[point].clone() }
    }

    /// [`MeasureError::Antenna`] of an image by its position.
    pub fn antenna(problem: &Problem, image: usize) -> Self {
        Self::Antenna { image: problem.image_names[image].clone() }
    }

    /// [`MeasureError::Surveyed`] of a point by its position.
    pub fn surveyed(problem: &Problem, point: usize) -> Self {
        Self::Surveyed { point: problem.point_names[point].clone() }
    }
}
