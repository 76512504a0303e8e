//! Block + model -> flat arrays: the one description of the least-squares problem that both solvers read.
//!
//! Unknowns are numbered ([`Layout`]): cameras (twelve each), effect parameters (`theta`), poses (6 each: rotation `w`
//! as in [`crate::math::rotation`], rad, then projection centre, m), points (3 each, m; tie points, then control
//! points).
//!
//! Residuals are `(observed - computed) / sigma`, in this order: image observations (x, y each), control coordinates (3
//! each), GNSS positions (3 each), priors of `theta` (1 each, in order of `theta`), priors of camera parameters (1
//! each).

pub mod context;
pub mod order;
pub mod velocities;

mod align;
mod build;
mod camera_priors;
mod cameras;
mod datum;
mod effects;
mod error;
mod intersection;
mod observations;
mod start;
mod thin;
mod unoriented;

pub use camera_priors::{PRIOR_SHARES, with_priors};
pub use cameras::start_interiors;
pub use effects::missing_need;
pub use error::ProblemError;

use crate::block::PointId;
use crate::camera::{self, Interior, PARAMETER_COUNT};
use crate::effects::{BlockContext, ImageContext, Role, Scope};

pub use crate::block::Pose;
pub use crate::model::{EffectRef, LOSS_SCALE, Loss};

use nalgebra::Vector3;
use std::borrow::Cow;
use std::sync::Arc;

/// What kind of image measurement an observation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum MeasurementKind {
    /// Tie-point measurement.
    Tie = 0,
    /// Mark of a control point.
    Mark = 1,
}

/// One image measurement; those of a point stand together.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct ImageObservation {
    /// Position of the image.
    pub image: u32,
    /// Tie or mark.
    pub kind: MeasurementKind,
    /// Observed x, px.
    pub x: f64,
    /// Observed y, px.
    pub y: f64,
    /// `1 / sigma` of each coordinate, px^-1, weights by multiplicity included.
    pub inverse_sigma: f64,
}

/// An observed position: of a control point or of an antenna.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionObservation {
    /// Position of the point (in [`State::points`]) or of the image.
    pub index: u32,
    /// Observed, m.
    pub position: Vector3<f64>,
    /// Standard deviations, m.
    pub sigma: Vector3<f64>,
}

/// A point of the problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PointSource {
    /// In [`crate::block::Block::tie_points`].
    Tie(PointId),
    /// In [`crate::block::Block::surveyed`].
    Control(PointId),
}

/// One number of `theta`.
#[derive(Debug, Clone, PartialEq)]
pub struct ThetaEntry {
    /// Position of the effect in [`Problem::effects`].
    pub effect: u32,
    /// Position of the parameter in its descriptor.
    pub parameter: u32,
    /// Which camera, flight or image it belongs to (0 for global).
    pub instance: u32,
    /// Name for people: `focal-flight.a[nadir50]`.
    pub name: String,
    /// Is it an unknown?
    pub free: bool,
    /// Size of one unit inside the solvers.
    pub scale: f64,
    /// Standard deviation of a prior with mean `prior_mean`.
    pub prior_sigma: Option<f64>,
    /// See `prior_sigma`.
    pub prior_mean: f64,
}

impl ThetaEntry {
    /// Name within the effect `id`, as a model gives it: `a[nadir50]`.
    pub fn short_name(&self, id: &str) -> &str {
        self.name.strip_prefix(id).and_then(|name| name.strip_prefix('.')).unwrap_or(&self.name)
    }
}

/// Where the values of an effect's parameters stand in `theta`.
#[derive(Debug, Clone)]
pub struct EffectInstance {
    /// The effect.
    pub effect: EffectRef,
    /// Per parameter: scope, and position of its first value.
    pub slots: Vec<(Scope, u32)>,
}

impl EffectInstance {
    /// How an entry of this effect gets its value.
    pub fn role(&self, entry: &ThetaEntry) -> &Role {
        &self.effect.descriptor().parameters[entry.parameter as usize].role
    }

    /// Position in `theta` of the value of `parameter` that holds in `image`.
    pub fn theta_index(&self, parameter: usize, image: &ImageContext) -> usize {
        let (scope, base) = self.slots[parameter];
        let instance = match scope {
            Scope::Global => 0,
            Scope::Camera => image.camera,
            Scope::Flight | Scope::FlightButFirst => image.flight,
            Scope::Image => image.image,
        };
        (base + instance) as usize
    }
}

/// An observed camera parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPrior {
    /// Position of the camera.
    pub camera: u32,
    /// Position of the parameter in [`camera::PARAMETERS`].
    pub parameter: u32,
    /// Observed.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
}

/// Values of everything that can be unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Interior orientations, one per camera.
    pub interiors: Vec<Interior>,
    /// Effect parameters.
    pub theta: Vec<f64>,
    /// Exterior orientations, one per image.
    pub poses: Vec<Pose>,
    /// Points, m.
    pub points: Vec<Vector3<f64>>,
}

/// The least-squares problem.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Ids of the cameras, for messages.
    pub camera_names: Vec<String>,
    /// Free parameters per camera. With `tie_dc_to_pp`, `dcx, dcy` are false.
    pub camera_free: Vec<[bool; PARAMETER_COUNT]>,
    /// Size of one unit of each camera parameter inside the solvers.
    pub camera_scales: Vec<Interior>,
    /// Largest plausible range of each camera parameter: what is known to no better than this is not determined.
    pub camera_domains: Vec<Interior>,
    /// The centre of distortion equals the principal point in every camera.
    pub tie_dc_to_pp: bool,
    /// Names of the images, for messages.
    pub image_names: Vec<String>,
    /// Constants per image; names its camera and flight.
    pub image_contexts: Vec<ImageContext>,
    /// Rank of each image along the block as it was at the block's approximations: the measurements of a point are in
    /// this order, wherever the images have moved since.
    pub image_ranks: Vec<u32>,
    /// Constants of the block.
    pub block_context: BlockContext,
    /// Free parts of each pose (rotation 3, centre 3).
    pub pose_free: Vec<[bool; 6]>,
    /// What each point is.
    pub point_sources: Arc<Vec<PointSource>>,
    /// Names of the points, for messages.
    pub point_names: Arc<Vec<String>>,
    /// Observations of point `j`: `observations[point_start[j]..point_start[j + 1]]`.
    pub point_start: Arc<Vec<usize>>,
    /// Image measurements, by point.
    pub observations: Arc<Vec<ImageObservation>>,
    /// Control coordinates.
    pub control: Vec<PositionObservation>,
    /// Antenna positions.
    pub gnss: Vec<PositionObservation>,
    /// Effects, in the order in which they act.
    pub effects: Vec<EffectInstance>,
    /// Every value of `theta`.
    pub theta: Vec<ThetaEntry>,
    /// Observed camera parameters.
    pub camera_priors: Vec<CameraPrior>,
    /// Robust loss on image residuals (2-vectors).
    pub loss: Loss,
    /// Start values.
    pub start: State,
    /// Freedoms that no observation fixes (7: similarity), held by `pose_free`.
    pub datum_defect: usize,
}

/// Numbering of the unknowns, free or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Number of cameras.
    pub cameras: usize,
    /// Number of effect parameter values.
    pub theta: usize,
    /// Number of images.
    pub images: usize,
    /// Number of points.
    pub points: usize,
}

impl Layout {
    /// Camera parameter `k` of camera `c`.
    pub fn camera(&self, c: usize, k: usize) -> usize {
        PARAMETER_COUNT * c + k
    }
    /// Camera and parameter of an unknown; `None` where it is none of a camera.
    pub fn camera_parameter(&self, unknown: usize) -> Option<(usize, usize)> {
        (unknown < self.theta(0)).then_some((unknown / PARAMETER_COUNT, unknown % PARAMETER_COUNT))
    }
    /// Effect parameter value `t`.
    pub fn theta(&self, t: usize) -> usize {
        PARAMETER_COUNT * self.cameras + t
    }
    /// Component `k` of pose `i`.
    pub fn pose(&self, i: usize, k: usize) -> usize {
        PARAMETER_COUNT * self.cameras + self.theta + 6 * i + k
    }
    /// Coordinate `k` of point `j`.
    pub fn point(&self, j: usize, k: usize) -> usize {
        PARAMETER_COUNT * self.cameras + self.theta + 6 * self.images + 3 * j + k
    }
    /// Number of numbers.
    pub fn total(&self) -> usize {
        PARAMETER_COUNT * self.cameras + self.theta + 6 * self.images + 3 * self.points
    }
}

impl Problem {
    /// This problem with the derivatives that plug-ins give themselves
    /// ([`Effect::with_own_derivatives`](crate::effects::Effect)); borrowed where it has no plug-in.
    pub fn with_own_derivatives(&self) -> Cow<'_, Self> {
        let mut own = Cow::Borrowed(self);
        for (e, instance) in self.effects.iter().enumerate() {
            if let Some(effect) = instance.effect.with_own_derivatives() {
                own.to_mut().effects[e].effect = effect;
            }
        }
        own
    }

    /// Numbering of the unknowns.
    pub fn layout(&self) -> Layout {
        Layout {
            cameras: self.camera_free.len(),
            theta: self.theta.len(),
            images: self.pose_free.len(),
            points: self.point_sources.len(),
        }
    }

    /// Which numbers are unknowns, in layout order.
    pub fn free(&self) -> Vec<bool> {
        let mut free = Vec::with_capacity(self.layout().total());
        free.extend(self.camera_free.iter().flatten());
        free.extend(self.theta.iter().map(|entry| entry.free));
        free.extend(self.pose_free.iter().flatten());
        free.resize(self.layout().total(), true);
        free
    }

    /// Positions in `theta` of the unknowns in which an effect is nonlinear (a place, a width, a lag).
    pub fn searched(&self) -> Vec<usize> {
        let is_searched = |t: &usize| {
            let entry = &self.theta[*t];
            let descriptor = self.effects[entry.effect as usize].effect.descriptor();
            entry.free && matches!(descriptor.parameters[entry.parameter as usize].role, Role::Searched(_))
        };
        (0..self.theta.len()).filter(is_searched).collect()
    }

    /// Number of residuals.
    pub fn residual_count(&self) -> usize {
        let theta_priors = self.theta.iter().filter(|entry| entry.prior_sigma.is_some()).count();
        2 * self.observations.len()
            + 3 * (self.control.len() + self.gnss.len())
            + theta_priors
            + self.camera_priors.len()
    }

    /// Number of observations, unknowns (those that the datum holds included) and redundancy.
    pub fn redundancy(&self) -> (usize, usize, i64) {
        let unknowns = self.free().iter().filter(|free| **free).count() + self.datum_defect;
        let observations = self.residual_count();
        (observations, unknowns, observations as i64 - unknowns as i64 + self.datum_defect as i64)
    }

    /// Name of an unknown, for people.
    pub fn unknown_name(&self, unknown: usize) -> String {
        let layout = self.layout();
        if let Some((c, k)) = layout.camera_parameter(unknown) {
            let name = camera::PARAMETERS[k];
            return if layout.cameras == 1 { name.into() } else { format!("{}.{name}", self.camera_names[c]) };
        }
        if unknown < layout.pose(0, 0) {
            return self.theta[unknown - layout.theta(0)].name.clone();
        }
        if unknown < layout.point(0, 0) {
            let k = unknown - layout.pose(0, 0);
            return format!("{}.{}", self.image_names[k / 6], ["w1", "w2", "w3", "cx", "cy", "cz"][k % 6]);
        }
        let k = unknown - layout.point(0, 0);
        format!("{}.{}", self.point_names[k / 3], ["x", "y", "z"][k % 3])
    }
}
