//! What a case gave, as it is kept on disk and shown in the report.

use crate::camera::Interior;
use crate::evaluate::distortion_field::{FieldStatistics, FieldVector};
use crate::evaluate::{Bowl, Statistics};
use serde::{Deserialize, Serialize};

/// How a case ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Adjusted and compared.
    Adjusted(Box<Adjusted>),
    /// The block under this model cannot be adjusted.
    Impossible {
        /// What the solvers say, for people.
        reason: String,
        /// None of them could.
        agreed: bool,
    },
}

impl Outcome {
    /// The adjusted case.
    pub fn adjusted(&self) -> Option<&Adjusted> {
        match self {
            Outcome::Adjusted(adjusted) => Some(adjusted),
            Outcome::Impossible { .. } => None,
        }
    }

    /// Two solvers came to different results.
    pub fn disagrees(&self) -> bool {
        match self {
            Outcome::Adjusted(case) => case.agreement.as_ref().is_some_and(|agreement| !agreement.agree),
            Outcome::Impossible { agreed, .. } => !agreed,
        }
    }
}

/// An adjusted case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adjusted {
    /// Number of images that took part.
    pub images: usize,
    /// Number of tie points that took part.
    pub tie_points: usize,
    /// Observations minus unknowns plus datum defect.
    pub redundancy: i64,
    /// Residuals of the tie points per coordinate, px.
    pub tie_rms_px: f64,
    /// The solvers; results are those of the first.
    pub solvers: Vec<SolverRun>,
    /// Agreement of two solvers; absent for one.
    pub agreement: Option<Agreed>,
    /// The camera that the block was made with.
    pub true_interior: Interior,
    /// The estimated camera.
    pub interior: Interior,
    /// Standard deviations for unit weight (the block's a-priori sigma); zero where held.
    pub interior_sigma: Interior,
    /// Values of effects, by name, with their standard deviation for unit weight.
    pub effects: Vec<(String, f64, f64)>,
    /// Mean over the images of estimated minus true height of the projection centre, after the similarity, m.
    pub camera_height_change_m: f64,
    /// Change of the camera: image point of the same ray, estimated minus true.
    pub whole_camera: FieldStatistics,
    /// The same up to a rotation of the camera, which poses absorb; absent where none was found.
    pub camera_up_to_rotation: Option<FieldStatistics>,
    /// Change of the distortion correction alone.
    pub distortion: FieldStatistics,
    /// Check points measured in the erroneous images, as in the publication.
    pub erroneous_marks: Judged,
    /// Check points with exact marks; the control points' marks, and with them the similarity, are as before.
    pub exact_check_marks: Judged,
    /// Check and control points with exact marks.
    pub exact_marks: Judged,
    /// What pictures need, where the case asks for it.
    pub pictures: Option<Pictures>,
}

/// One solver's part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverRun {
    /// Its name.
    pub name: String,
    /// Steps tried.
    pub iterations: usize,
    /// Seconds of the solve.
    pub seconds: f64,
    /// 3D RMS of the check points with erroneous marks, m.
    pub check_rms_m: f64,
    /// Mean over the images of estimated minus true height of the projection centre, m.
    pub camera_height_change_m: f64,
}

/// Largest differences between two solvers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreed {
    /// Everything is within its tolerance.
    pub agree: bool,
    /// Of residuals at the same point, px.
    pub residual_max_px: f64,
    /// Of entries of the Jacobian, by the column's largest.
    pub jacobian_max_rel: f64,
    /// Of parameters, in their sigma; absent when not comparable.
    pub parameter_max_sigma: Option<f64>,
    /// The parameter.
    pub worst_unknown: String,
}

/// Surveyed points under one kind of marks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Residuals of the check points.
    pub check: Statistics,
    /// Residuals of the control points after the similarity.
    pub control: Statistics,
    /// 3D RMS of the check points when rays are intersected in space instead, as MicMac's tools do, m; absent with
    /// effects in the model, which a ray of the camera alone does not have.
    pub rays_rms_m: Option<f64>,
    /// Quadratic part of the height residuals along the corridor; absent where too few points were intersected.
    pub bowl: Option<Bowl>,
    /// Check points that could not be intersected.
    pub failed: usize,
}

/// What pictures need.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pictures {
    /// Check points with erroneous marks: place x, y and residual x, y, z, m.
    pub erroneous: Vec<[f64; 5]>,
    /// Check points with exact marks.
    pub exact: Vec<[f64; 5]>,
    /// The error as it stands in the image measurements, at some of them, px.
    pub injected: Vec<FieldVector>,
    /// Change of the whole camera at the same places, px.
    pub camera_change: Vec<FieldVector>,
    /// Focal length of each image as its own measurements and the true orientation have it, px.
    pub focal_by_image: Vec<f64>,
}
