//! `summary.json`: what a run found, in the keys that scripts rely on.

use crate::adjust::{Covariance, Solution};
use crate::block::Block;
use crate::camera::PARAMETERS;
use crate::effects::Scope;
use crate::evaluate::{Comparison, Similarity, Statistics};
use crate::problem::{EffectInstance, MeasurementKind, Problem, ThetaEntry};
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
    /// Of the two solvers; null when one ran alone.
    pub agreement: Option<AgreementSummary>,
    /// By camera and parameter.
    pub cameras: Named<Named<CameraParameter>>,
    /// By effect and parameter; values of one flight or camera as `name[flight]`. Values of one image stand in `images.csv`.
    pub effects: Named<Named<EffectParameter>>,
    /// Survey from adjustment; null where there is none.
    pub similarity: Option<SimilaritySummary>,
    /// Residuals at control points; null without any.
    pub control: Option<Statistics>,
    /// Residuals at check points; null without any.
    pub check: Option<Statistics>,
}

/// What one solver did.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SolverSummary {
    /// Did it meet its stopping rule?
    pub converged: bool,
    /// Half of `v'Pv` (of its robust form).
    pub cost: f64,
    /// Steps tried.
    pub iterations: usize,
    /// Wall-clock seconds, covariance excluded.
    pub seconds: f64,
    /// Largest gradient entry by scaled unknowns.
    pub gradient_max: f64,
}

/// How far apart the two solvers are.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AgreementSummary {
    /// Is everything within its tolerance?
    pub agree: bool,
    /// Largest difference of an image residual at the same point, px.
    pub residual_max_px: f64,
    /// Largest difference of a Jacobian entry at the same point, relative.
    pub jacobian_max_rel: f64,
    /// Largest difference of a parameter after solving, in its sigma.
    pub parameter_max_sigma: f64,
    /// Difference of the costs, relative.
    pub cost_rel: f64,
}

/// A camera parameter.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraParameter {
    /// In the unit of [`crate::camera::UNITS`].
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
    pub value: f64,
    /// A-posteriori standard deviation, zero when held or given; null when no covariance was computed.
    pub sigma: Option<f64>,
    /// Unit.
    pub unit: String,
}

/// `survey = scale * rotation * adjusted + translation`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SimilaritySummary {
    /// Scale.
    pub scale: f64,
    /// Unit quaternion `[qw, qx, qy, qz]`.
    pub rotation: [f64; 4],
    /// m.
    pub translation_m: [f64; 3],
}

/// What a summary is made of.
#[derive(Debug, Clone, Copy)]
pub struct Findings<'a> {
    /// The block.
    pub block: &'a Block,
    /// The problem that was solved.
    pub problem: &'a Problem,
    /// Name and result of each solver that ran; the values are those of the first.
    pub solutions: &'a [(&'a str, &'a Solution)],
    /// Both solvers compared.
    pub agreement: Option<&'a AgreementSummary>,
    /// Residuals at the first solution, divided by their sigma, in the problem's order.
    pub residuals: &'a [f64],
    /// Control and check points compared, where there are any.
    pub comparison: Option<&'a Comparison>,
}

impl Findings<'_> {
    /// The values: those of the first solver.
    ///
    /// # Panics
    /// Without any solution.
    pub fn solution(&self) -> &Solution {
        self.solutions.first().expect("at least one solver ran").1
    }

    /// `sqrt(v'Pv / redundancy)` from the (robust) cost; `None` without redundancy.
    pub fn sigma0(&self) -> Option<f64> {
        let (_, _, redundancy) = self.problem.redundancy();
        (redundancy > 0).then(|| (2.0 * self.solution().cost / redundancy as f64).sqrt())
    }

    /// The file's content.
    pub fn summary(&self) -> Summary {
        let (observations, unknowns, redundancy) = self.problem.redundancy();
        Summary {
            format: FORMAT,
            block: self.block.name.clone(),
            observations,
            unknowns,
            datum_defect: self.problem.datum_defect,
            redundancy,
            sigma0: self.sigma0(),
            tie_rms_px: tie_rms_px(self.problem, self.residuals),
            solvers: self.solutions.iter().map(|(name, solution)| (name.to_string(), solver(solution))).collect(),
            agreement: self.agreement.cloned(),
            cameras: cameras(self.problem, self.solution(), self.sigma0()),
            effects: effects(self.problem, self.solution(), self.sigma0()),
            similarity: self.comparison.and_then(|comparison| comparison.similarity.as_ref()).map(similarity),
            control: self.comparison.and_then(|comparison| comparison.control),
            check: self.comparison.and_then(|comparison| comparison.check),
        }
    }
}

/// Root mean square of the tie-point residuals per coordinate, px.
fn tie_rms_px(problem: &Problem, residuals: &[f64]) -> Option<f64> {
    let (mut sum, mut n) = (0.0, 0usize);
    for (observation, r) in problem.observations.iter().zip(residuals.chunks_exact(2)) {
        if observation.kind == MeasurementKind::Tie {
            sum += (r[0] * r[0] + r[1] * r[1]) / (observation.inverse_sigma * observation.inverse_sigma);
            n += 2;
        }
    }
    (n > 0).then(|| (sum / n as f64).sqrt())
}

fn solver(solution: &Solution) -> SolverSummary {
    SolverSummary {
        converged: solution.converged,
        cost: solution.cost,
        iterations: solution.iterations,
        seconds: solution.seconds,
        gradient_max: solution.gradient_max,
    }
}

fn similarity(similarity: &Similarity) -> SimilaritySummary {
    SimilaritySummary {
        scale: similarity.scale,
        rotation: similarity.quaternion(),
        translation_m: similarity.translation.into(),
    }
}

fn cameras(problem: &Problem, solution: &Solution, sigma0: Option<f64>) -> Named<Named<CameraParameter>> {
    let camera = |(c, name): (usize, &String)| {
        let parameter = |k: usize| {
            // A tied centre of distortion is as good as the principal point that it moves with.
            let source = if problem.tie_dc_to_pp && matches!(k, 3 | 4) { k - 2 } else { k };
            let unknown = problem.layout().camera(c, source);
            let sigma = match problem.camera_free[c][source] {
                true => solution.covariance.as_ref().zip(sigma0).and_then(|(cov, s)| shared_sigma(cov, unknown, s)),
                false => Some(0.0),
            };
            let value = solution.state.interiors[c][k];
            (PARAMETERS[k].to_string(), CameraParameter { value, sigma, free: problem.camera_free[c][k] })
        };
        (name.clone(), (0..PARAMETERS.len()).map(parameter).collect())
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
        let entries = problem.theta.iter().enumerate().filter(|(_, entry)| entry.effect as usize == e);
        let shared = entries.filter(|(_, entry)| instance.slots[entry.parameter as usize].0 != Scope::Image);
        let parameter = |(t, entry): (usize, &ThetaEntry)| {
            let name = entry.name.strip_prefix(&format!("{}.", descriptor.id)).unwrap_or(&entry.name);
            let unit = descriptor.parameters[entry.parameter as usize].unit.to_string();
            let sigma = theta_sigma(problem, solution, sigma0, t);
            (name.to_string(), EffectParameter { value: solution.state.theta[t], sigma, unit })
        };
        (descriptor.id.to_string(), shared.map(parameter).collect())
    };
    problem.effects.iter().enumerate().map(effect).collect()
}

/// A-posteriori standard deviation of a value of `theta`.
pub(super) fn theta_sigma(problem: &Problem, solution: &Solution, sigma0: Option<f64>, t: usize) -> Option<f64> {
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
        struct Items<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Items<T> {
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
        deserializer.deserialize_map(Items(PhantomData))
    }
}
