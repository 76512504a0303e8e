//! `summary.json`: what a run found, in the keys that scripts rely on.

use crate::adjust::agreement::Agreement;
use crate::adjust::{AdjustError, BUILT, Covariance, Solution};
use crate::block::Block;
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PARAMETERS, PPX, PPY};
use crate::effects::{Role, Scope};
use crate::evaluate::{Similarity, Statistics};
use crate::math::null_is_nan;
use crate::mistakes::Mistake;
use crate::problem::{EffectInstance, PointSource, Problem, ThetaEntry};
use crate::run::residuals::tie_rms_of_rows;
use crate::run::{ResidualRow, Run};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde::ser::{Serialize, Serializer};
use std::marker::PhantomData;

/// Version of the format.
pub const FORMAT: u32 = 1;

/// Named values in an order of their own; a JSON object.
#[derive(Debug, Clone, PartialEq)]
pub struct Named<T>(pub Vec<(String, T)>);

/// The whole file.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Summary {
    /// [`FORMAT`].
    pub format: u32,
    /// Name of the block.
    pub block: String,
    /// Number of observations.
    pub observations: usize,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Freedoms that no observation fixes.
    pub datum_defect: usize,
    /// Observations minus unknowns plus datum defect.
    pub redundancy: i64,
    /// `sqrt(v'Pv / redundancy)`; null without redundancy.
    pub sigma0: Option<f64>,
    /// Per coordinate, px; null without tie points.
    pub tie_rms_px: Option<f64>,
    /// By solver.
    pub solvers: Named<SolverSummary>,
    /// Names of the solvers that the program had; empty in a folder of before this was noted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub solvers_built: Vec<String>,
    /// Of the two solvers; null when one ran alone.
    pub agreement: Option<Agreement>,
    /// By camera and parameter.
    pub cameras: Named<Named<CameraParameter>>,
    /// By effect and parameter; values of one flight or camera as `name[flight]`. Values of one image stand in
    /// `images.csv`.
    pub effects: Named<Named<EffectParameter>>,
    /// Libraries of the effects that are no part of this program; left out without any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plugins: Vec<PluginSummary>,
    /// Survey from adjustment; null where there is none.
    pub similarity: Option<SimilaritySummary>,
    /// Residuals at control points; null without any.
    pub control: Option<Statistics>,
    /// Residuals at check points; null without any.
    pub check: Option<Statistics>,
    /// What people got wrong; empty where nothing was found, or nobody looked.
    #[serde(default)]
    pub mistakes: Vec<Mistake>,
    /// Of the tables; a folder of before this was noted has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<Rows>,
}

/// Numbers of rows of the tables of a folder: one that has fewer was cut off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Rows {
    /// Of `images.csv`.
    pub images: usize,
    /// Of `points.csv`.
    pub points: usize,
    /// Of `residuals.csv`.
    pub residuals: usize,
    /// Of `checks.csv`.
    pub checks: usize,
}

/// What one solver did.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SolverSummary {
    /// Did it meet its stopping rule?
    pub converged: bool,
    /// Half of `v'Pv` (of its robust form).
    #[serde(deserialize_with = "null_is_nan")]
    pub cost: f64,
    /// Steps tried.
    pub iterations: usize,
    /// Wall-clock seconds, covariance excluded.
    #[serde(deserialize_with = "null_is_nan")]
    pub seconds: f64,
    /// Largest gradient entry by scaled unknowns.
    #[serde(deserialize_with = "null_is_nan")]
    pub gradient_max: f64,
    /// Why it found nothing, where another solver did: the figures above are then null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// A camera parameter.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraParameter {
    /// In the unit of [`crate::camera::UNITS`].
    #[serde(deserialize_with = "null_is_nan")]
    pub value: f64,
    /// A-posteriori standard deviation, zero when held; null when no covariance was computed.
    pub sigma: Option<f64>,
    /// Was it an unknown?
    pub free: bool,
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EffectParameter {
    /// In `unit`.
    #[serde(deserialize_with = "null_is_nan")]
    pub value: f64,
    /// A-posteriori standard deviation, zero when held or given; null when no covariance was computed.
    pub sigma: Option<f64>,
    /// Unit.
    pub unit: String,
}

/// An effect from a shared library.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PluginSummary {
    /// Id.
    pub effect: String,
    /// The library, as it was named.
    pub path: String,
    /// SHA-256 of the library, hexadecimal.
    pub sha256: String,
}

impl std::fmt::Display for PluginSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}, SHA-256 {}", self.effect, self.path, self.sha256)
    }
}

/// `survey = scale * rotation * adjusted + translation`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SimilaritySummary {
    /// Scale.
    #[serde(deserialize_with = "null_is_nan")]
    pub scale: f64,
    /// Unit quaternion `[qw, qx, qy, qz]`.
    pub rotation: [f64; 4],
    /// m.
    pub translation_m: [f64; 3],
}

impl Summary {
    /// Does the block have a scale?
    pub fn has_scale(&self) -> bool {
        has_scale(self.datum_defect, self.similarity.is_some())
    }

    /// Of a run and its residuals.
    pub fn of(block: &Block, run: &Run, rows: &[ResidualRow]) -> Self {
        let (observations, unknowns, redundancy) = run.problem.redundancy();
        let sigma0 = sigma0(run);
        Self {
            format: FORMAT,
            block: block.name.clone(),
            observations,
            unknowns,
            datum_defect: run.problem.datum_defect,
            redundancy,
            sigma0,
            tie_rms_px: tie_rms_of_rows(rows),
            solvers: (run.solutions.iter().map(|(name, solution)| (name.to_string(), solver(solution))))
                .chain(run.failures.iter().map(|(name, failure)| (name.to_string(), failed(failure))))
                .collect(),
            solvers_built: BUILT.iter().map(|solver| solver.name().to_string()).collect(),
            agreement: run.agreement.clone(),
            cameras: cameras(&run.problem, run.solution(), sigma0),
            effects: effects(&run.problem, run.solution(), sigma0),
            plugins: run.problem.effects.iter().filter_map(plugin).collect(),
            similarity: run
                .comparison
                .as_ref()
                .and_then(|comparison| comparison.similarity.as_ref())
                .map(|found| similarity(found, block)),
            control: run.comparison.as_ref().and_then(|comparison| comparison.control),
            check: run.comparison.as_ref().and_then(|comparison| comparison.check),
            mistakes: run.mistakes.clone(),
            rows: Some(Rows {
                images: block.images.len(),
                points: run.problem.point_sources.iter().filter(|of| matches!(of, PointSource::Tie(_))).count(),
                residuals: rows.len(),
                checks: run.comparison.as_ref().map_or(0, |comparison| comparison.rows.len()),
            }),
        }
    }
}

/// Does a block have a scale? Without control and GNSS its unit of length is that of the start values.
pub(super) fn has_scale(datum_defect: usize, similarity: bool) -> bool {
    datum_defect < 7 || similarity
}

/// A-posteriori standard deviation of unit weight; `None` without redundancy.
pub fn sigma0(run: &Run) -> Option<f64> {
    Some(run.sigma0()).filter(|sigma0| sigma0.is_finite())
}

fn solver(solution: &Solution) -> SolverSummary {
    SolverSummary {
        converged: solution.converged,
        cost: solution.cost,
        iterations: solution.iterations,
        seconds: solution.seconds,
        gradient_max: solution.gradient_max,
        failure: None,
    }
}

fn failed(failure: &AdjustError) -> SolverSummary {
    let iterations = if let AdjustError::NotConverged { iterations, .. } = failure { *iterations } else { 0 };
    let (cost, seconds, gradient_max) = (f64::NAN, f64::NAN, f64::NAN);
    SolverSummary { converged: false, cost, iterations, seconds, gradient_max, failure: Some(failure.to_string()) }
}

/// Between coordinates as the user has them; the block's own may have another origin.
fn similarity(similarity: &Similarity, block: &Block) -> SimilaritySummary {
    let origin = block.origin;
    SimilaritySummary {
        scale: similarity.scale,
        rotation: similarity.quaternion(),
        translation_m: (similarity.apply(&-origin) + origin).into(),
    }
}

fn plugin(instance: &EffectInstance) -> Option<PluginSummary> {
    let origin = instance.effect.origin()?;
    let (path, sha256) = (origin.path.display().to_string(), origin.sha256.clone());
    Some(PluginSummary { effect: instance.effect.descriptor().id.to_string(), path, sha256 })
}

fn cameras(problem: &Problem, solution: &Solution, sigma0: Option<f64>) -> Named<Named<CameraParameter>> {
    let camera = |(c, name): (usize, &String)| {
        let parameter = |k: usize| {
            // A tied centre of distortion is as good as the principal point that it moves with.
            let source = match k {
                DCX if problem.tie_dc_to_pp => PPX,
                DCY if problem.tie_dc_to_pp => PPY,
                k => k,
            };
            let unknown = problem.layout().camera(c, source);
            let sigma = match problem.camera_free[c][source] {
                true => solution.covariance.as_ref().zip(sigma0).and_then(|(cov, s)| shared_sigma(cov, unknown, s)),
                false => Some(0.0),
            };
            let value = solution.state.interiors[c][k];
            (PARAMETERS[k].to_string(), CameraParameter { value, sigma, free: problem.camera_free[c][k] })
        };
        (name.clone(), (0..PARAMETER_COUNT).map(parameter).collect())
    };
    problem.camera_names.iter().enumerate().map(camera).collect()
}

fn shared_sigma(covariance: &Covariance, unknown: usize, sigma0: f64) -> Option<f64> {
    let row = covariance.shared_unknowns.iter().position(|shared| *shared == unknown)?;
    Some(sigma0 * covariance.shared[(row, row)].sqrt())
}

fn effects(problem: &Problem, solution: &Solution, sigma0: Option<f64>) -> Named<Named<EffectParameter>> {
    let effect = |(e, instance): (usize, &EffectInstance)| {
        let descriptor = instance.effect.descriptor();
        let parameter = |(t, entry): (usize, &ThetaEntry)| {
            let parameter = &descriptor.parameters[entry.parameter as usize];
            let unit = parameter.unit.to_string();
            let (scope, base) = instance.slots[entry.parameter as usize];
            match (&parameter.role, scope) {
                // One number stands for the values of all images; its own precision is not estimated.
                (Role::Random(name), _) if t == base as usize => {
                    Some((name.to_string(), EffectParameter { value: entry.prior_sigma?, sigma: None, unit }))
                }
                (Role::Random(_), _) | (_, Scope::Image) => None,
                _ => {
                    let name = entry.name.strip_prefix(&format!("{}.", descriptor.id)).unwrap_or(&entry.name);
                    let sigma = theta_sigma(problem, solution, sigma0, t);
                    Some((name.to_string(), EffectParameter { value: solution.state.theta[t], sigma, unit }))
                }
            }
        };
        let entries = problem.theta.iter().enumerate().filter(|(_, entry)| entry.effect as usize == e);
        (descriptor.id.to_string(), entries.filter_map(parameter).collect())
    };
    problem.effects.iter().enumerate().map(effect).collect()
}

/// A-posteriori standard deviation of a value of `theta`.
pub fn theta_sigma(problem: &Problem, solution: &Solution, sigma0: Option<f64>, t: usize) -> Option<f64> {
    if !problem.theta[t].free {
        return Some(0.0);
    }
    Some(sigma0? * solution.covariance.as_ref()?.theta_variances.get(t)?.sqrt())
}

impl<T> FromIterator<(String, T)> for Named<T> {
    fn from_iter<I: IntoIterator<Item = (String, T)>>(items: I) -> Self {
        Self(items.into_iter().collect())
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for InOrder<T> {
            type Value = Named<T>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named<T>, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = map.next_entry()? {
                    items.push(item);
                }
                Ok(Named(items))
            }
        }
        deserializer.deserialize_map(InOrder(PhantomData))
    }
}
