//! How a problem is stated with the cameras that apex-solver has, or why it cannot be.

use crate::colmap::{Camera, Model};
use crate::entry::Entry;
use anyhow::{Context, Result};
use apex_solver::apex_camera_models::{BALPinholeCameraStrict, CameraModel};
use apex_solver::factors::visual::projection::OptimizationConfig;
use apex_solver::{BundleAdjustment, Factor, ProjectionFactor, RadTanCamera, SelfCalibration};
use nalgebra::{Matrix2xX, Quaternion, UnitQuaternion, Vector2};

/// The camera of a problem.
pub enum Form {
    /// Nothing of it is estimated: Brown's distortion, z forward.
    Held,
    /// The camera of BAL, which has no principal point and looks along -z; which of `f, k1, k2` are free.
    Bal([bool; 3]),
}

/// The form of a problem; else what apex-solver has no way to say.
pub fn of(entry: &Entry, model: &Model) -> Result<Form, String> {
    if !(entry.focal_length || entry.principal_point || entry.distortion) {
        return all(model, |camera| brown(camera).is_some()).map(|()| Form::Held);
    }
    if entry.principal_point {
        return Err("no camera with a principal point and one focal length".into());
    }
    all(model, |camera| simple(camera).is_some())?;
    let mut kinds: Vec<&str> = model.cameras.iter().map(|camera| camera.model.as_str()).collect();
    kinds.dedup();
    let (k1, k2) = match kinds.as_slice() {
        ["SIMPLE_PINHOLE"] => (false, false),
        ["SIMPLE_RADIAL"] => (true, false),
        ["RADIAL"] => (true, true),
        others => return Err(format!("no way here to mix {}", others.join(", "))),
    };
    Ok(Form::Bal([entry.focal_length, k1 && entry.distortion, k2 && entry.distortion]))
}

fn all(model: &Model, known: impl Fn(&Camera) -> bool) -> Result<(), String> {
    let strange = model.cameras.iter().find(|camera| !known(camera));
    strange
        .map_or(Ok(()), |camera| Err(format!("no camera like {} of {} parameters", camera.model, camera.params.len())))
}

impl Form {
    /// What takes COLMAP's camera axes to those of the camera model; it is its own inverse.
    pub fn axes(&self) -> UnitQuaternion<f64> {
        match self {
            Form::Held => UnitQuaternion::identity(),
            Form::Bal(_) => UnitQuaternion::from_quaternion(Quaternion::new(0.0, 1.0, 0.0, 0.0)),
        }
    }

    /// The parameters of a camera that are a variable, and which of them are free; `None` where nothing is estimated.
    pub fn interior(&self, camera: &Camera) -> Option<([f64; 3], [bool; 3])> {
        let Form::Bal(free) = self else { return None };
        simple(camera).map(|[f, _, _, k1, k2]| ([f, k1, k2], *free))
    }

    /// The measurement of a point.
    pub fn factor(&self, camera: &Camera, observed: Vector2<f64>) -> Result<Box<dyn Factor>> {
        match self {
            Form::Held => {
                let held = brown(camera).context("a camera with Brown's distortion was expected")?;
                Ok(projection::<_, BundleAdjustment>(RadTanCamera::from(held), observed))
            }
            Form::Bal(_) => {
                let [f, cx, cy, k1, k2] = simple(camera).context("a camera with one focal length was expected")?;
                let observed = Vector2::new(observed.x - cx, cy - observed.y);
                Ok(projection::<_, SelfCalibration>(BALPinholeCameraStrict::from([f, k1, k2]), observed))
            }
        }
    }
}

fn projection<C, O>(camera: C, observed: Vector2<f64>) -> Box<dyn Factor>
where
    C: CameraModel + for<'a> TryFrom<&'a [f64]> + 'static,
    O: OptimizationConfig,
{
    Box::new(ProjectionFactor::<C, O>::new(Matrix2xX::from_columns(&[observed]), camera))
}

/// `f, cx, cy, k1, k2` of a camera with one focal length and no more than that.
fn simple(camera: &Camera) -> Option<[f64; 5]> {
    match (camera.model.as_str(), camera.params.as_slice()) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => Some([f, cx, cy, 0.0, 0.0]),
        ("SIMPLE_RADIAL", &[f, cx, cy, k1]) => Some([f, cx, cy, k1, 0.0]),
        ("RADIAL", &[f, cx, cy, k1, k2]) => Some([f, cx, cy, k1, k2]),
        _ => None,
    }
}

/// `fx, fy, cx, cy, k1, k2, p1, p2, k3` of a camera whose distortion is Brown's.
fn brown(camera: &Camera) -> Option<[f64; 9]> {
    match (camera.model.as_str(), camera.params.as_slice()) {
        ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]) => {
            Some([fx, fy, cx, cy, k1, k2, p1, p2, k3])
        }
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => Some([fx, fy, cx, cy, k1, k2, p1, p2, 0.0]),
        _ => simple(camera).map(|[f, cx, cy, k1, k2]| [f, f, cx, cy, k1, k2, 0.0, 0.0, 0.0]),
    }
}
