//! A problem at a state as the flat arrays that cross the bridge, and effects as tables of the C ABI.

use super::bridge::{builtin_effects, ffi};
use crate::adjust::AdjustError;
use crate::effects::abi::{EffectHandle, RawContext, RustEffect};
use crate::effects::{Context, Stage};
use crate::problem::{EffectRef, Loss, PositionObservation, Problem, State};
use nalgebra::Vector3;

/// Owner of everything that a [`ffi::View`] borrows.
pub(super) struct Arrays<'a> {
    interiors: Vec<f64>,
    camera_scales: Vec<f64>,
    camera_domains: Vec<f64>,
    camera_free: Vec<u8>,
    tie_dc_to_pp: bool,
    theta: Vec<f64>,
    theta_scales: Vec<f64>,
    theta_free: Vec<u8>,
    theta_prior_index: Vec<u32>,
    theta_prior_mean: Vec<f64>,
    theta_prior_sigma: Vec<f64>,
    /// Effects without a derivation in C++; their tables are among `effects`.
    _rust_effects: Vec<RustEffect<'a>>,
    effects: Vec<EffectHandle>,
    effect_reads_place: Vec<u8>,
    slot_start: Vec<u32>,
    slot_scope: Vec<u32>,
    slot_base: Vec<u32>,
    contexts: Vec<RawContext>,
    control_context: RawContext,
    rotations: Vec<f64>,
    centres: Vec<f64>,
    pose_free: Vec<u8>,
    points: Vec<f64>,
    point_start: Vec<u64>,
    observation_image: Vec<u32>,
    observation_xy: Vec<f64>,
    observation_weight: Vec<f64>,
    control: Positions,
    gnss: Positions,
    prior_camera: Vec<u32>,
    prior_parameter: Vec<u32>,
    prior_value: Vec<f64>,
    prior_sigma: Vec<f64>,
    loss: u32,
    loss_scale: f64,
}

struct Positions {
    index: Vec<u32>,
    position: Vec<f64>,
    sigma: Vec<f64>,
}

fn flags<const N: usize>(flags: &[[bool; N]]) -> Vec<u8> {
    flags.iter().flatten().copied().map(u8::from).collect()
}

fn coordinates<'v>(vectors: impl Iterator<Item = &'v Vector3<f64>>) -> Vec<f64> {
    vectors.flat_map(|vector| vector.iter().copied()).collect()
}

fn positions(observations: &[PositionObservation]) -> Positions {
    Positions {
        index: observations.iter().map(|observation| observation.index).collect(),
        position: coordinates(observations.iter().map(|observation| &observation.position)),
        sigma: coordinates(observations.iter().map(|observation| &observation.sigma)),
    }
}

impl<'a> Arrays<'a> {
    /// Flattens `problem` at `state`.
    ///
    /// # Errors
    /// An effect whose derivations in the two languages do not have the same parameters.
    pub(super) fn new(problem: &'a Problem, state: &State) -> Result<Self, AdjustError> {
        let (rust_effects, effects) = effect_tables(problem)?;
        let mut slot_start = vec![0];
        let (mut slot_scope, mut slot_base) = (Vec::new(), Vec::new());
        for instance in &problem.effects {
            for (scope, base) in &instance.slots {
                slot_scope.push(*scope as u32);
                slot_base.push(*base);
            }
            slot_start.push(slot_scope.len() as u32);
        }
        let theta_priors = || problem.theta.iter().enumerate().filter_map(|(t, e)| Some((t, e, e.prior_sigma?)));
        let unknown = f64::NAN;
        let (block, column_px, row_px) = (&problem.block_context, unknown, unknown);
        let context = |image| Context { block, image, column_px, row_px, surveyed: None };
        Ok(Self {
            interiors: state.interiors.iter().flatten().copied().collect(),
            camera_scales: problem.camera_scales.iter().flatten().copied().collect(),
            camera_domains: problem.camera_domains.iter().flatten().copied().collect(),
            camera_free: flags(&problem.camera_free),
            tie_dc_to_pp: problem.tie_dc_to_pp,
            theta: state.theta.clone(),
            theta_scales: problem.theta.iter().map(|entry| entry.scale).collect(),
            theta_free: problem.theta.iter().map(|entry| u8::from(entry.free)).collect(),
            theta_prior_index: theta_priors().map(|(t, _, _)| t as u32).collect(),
            theta_prior_mean: theta_priors().map(|(_, entry, _)| entry.prior_mean).collect(),
            theta_prior_sigma: theta_priors().map(|(_, _, sigma)| sigma).collect(),
            _rust_effects: rust_effects,
            effects,
            effect_reads_place: problem
                .effects
                .iter()
                .flat_map(|instance| instance.effect.reads_place().map(u8::from))
                .collect(),
            slot_start,
            slot_scope,
            slot_base,
            contexts: problem.image_contexts.iter().map(|image| RawContext::new(&context(image))).collect(),
            control_context: RawContext::of_control(&problem.block_context),
            rotations: state
                .poses
                .iter()
                .flat_map(|pose| {
                    let q = pose.rotation.quaternion();
                    [q.w, q.i, q.j, q.k]
                })
                .collect(),
            centres: coordinates(state.poses.iter().map(|pose| &pose.centre)),
            pose_free: flags(&problem.pose_free),
            points: coordinates(state.points.iter()),
            point_start: problem.point_start.iter().map(|start| *start as u64).collect(),
            observation_image: problem.observations.iter().map(|observation| observation.image).collect(),
            observation_xy: problem
                .observations
                .iter()
                .flat_map(|observation| [observation.x, observation.y])
                .collect(),
            observation_weight: problem.observations.iter().map(|observation| observation.inverse_sigma).collect(),
            control: positions(&problem.control),
            gnss: positions(&problem.gnss),
            prior_camera: problem.camera_priors.iter().map(|prior| prior.camera).collect(),
            prior_parameter: problem.camera_priors.iter().map(|prior| prior.parameter).collect(),
            prior_value: problem.camera_priors.iter().map(|prior| prior.value).collect(),
            prior_sigma: problem.camera_priors.iter().map(|prior| prior.sigma).collect(),
            loss: match problem.loss {
                Loss::None => 0,
                Loss::Huber => 1,
                Loss::Cauchy => 2,
            },
            loss_scale: crate::problem::LOSS_SCALE,
        })
    }

    /// The arrays, borrowed.
    pub(super) fn view(&self) -> ffi::View<'_> {
        ffi::View {
            interiors: &self.interiors,
            camera_scales: &self.camera_scales,
            camera_domains: &self.camera_domains,
            camera_free: &self.camera_free,
            tie_dc_to_pp: self.tie_dc_to_pp,
            theta: &self.theta,
            theta_scales: &self.theta_scales,
            theta_free: &self.theta_free,
            theta_prior_index: &self.theta_prior_index,
            theta_prior_mean: &self.theta_prior_mean,
            theta_prior_sigma: &self.theta_prior_sigma,
            effects: &self.effects,
            effect_reads_place: &self.effect_reads_place,
            slot_start: &self.slot_start,
            slot_scope: &self.slot_scope,
            slot_base: &self.slot_base,
            contexts: &self.contexts,
            control_context: std::slice::from_ref(&self.control_context),
            rotations: &self.rotations,
            centres: &self.centres,
            pose_free: &self.pose_free,
            points: &self.points,
            point_start: &self.point_start,
            observation_image: &self.observation_image,
            observation_xy: &self.observation_xy,
            observation_weight: &self.observation_weight,
            control_point: &self.control.index,
            control_position: &self.control.position,
            control_sigma: &self.control.sigma,
            gnss_image: &self.gnss.index,
            gnss_position: &self.gnss.position,
            gnss_sigma: &self.gnss.sigma,
            prior_camera: &self.prior_camera,
            prior_parameter: &self.prior_parameter,
            prior_value: &self.prior_value,
            prior_sigma: &self.prior_sigma,
            loss: self.loss,
            loss_scale: self.loss_scale,
        }
    }
}

/// A table per effect: of a plug-in its own, of a built-in one that of its C++ derivation, of one that exists in Rust
/// alone a call back.
fn effect_tables(problem: &Problem) -> Result<(Vec<RustEffect<'_>>, Vec<EffectHandle>), AdjustError> {
    let builtin = builtin_effects().map_err(|error| AdjustError::Bridge(error.to_string()))?;
    let mut rust_effects = Vec::new();
    let mut handles = Vec::new();
    for instance in &problem.effects {
        let descriptor = instance.effect.descriptor();
        if let Some(table) = instance.effect.c_abi() {
            handles.push(EffectHandle(table.cast()));
            continue;
        }
        let same = match &instance.effect {
            EffectRef::Builtin(_) => builtin.iter().find(|own| own.descriptor().id == descriptor.id),
            EffectRef::Plugin(_) => None,
        };
        if let Some(own) = same {
            let names = |d: &crate::effects::Descriptor| -> (Stage, Vec<String>) {
                (d.stage, d.parameters.iter().map(|parameter| parameter.name.to_string()).collect())
            };
            if names(own.descriptor()) != names(descriptor) {
                let text = "has not the same stage and parameters in C++ and in Rust";
                return Err(AdjustError::Bridge(format!("effect `{}` {text}", descriptor.id)));
            }
            handles.push(EffectHandle(own.raw()));
            continue;
        }
        let wrapped = RustEffect::new(&*instance.effect, &problem.block_context, &problem.image_contexts);
        handles.push(EffectHandle(wrapped.raw()));
        rust_effects.push(wrapped);
    }
    Ok((rust_effects, handles))
}
