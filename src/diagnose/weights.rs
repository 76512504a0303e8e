//! One variance factor per group of observations: a wrong `tie_px` must not mis-scale what GNSS positions say.
//!
//! `s^2 = v'Pv / r` of each group, `r` its share of the redundancy. The factor of positions is taken after everything that the candidates of
//! their stages could explain, so that a missing lever arm does not pass for noise.
//!
//! Source: Förstner and Wrobel, Photogrammetric Computer Vision (2016), sec. 4.2.4.

use crate::adjust::Covariance;
use crate::math::statistics::{chi_square_quantile, chi_square_sf};
use crate::model::SigmaFactors;
use crate::problem::{Problem, State};
use crate::run::FittedModel;
use nalgebra::Vector3;

/// A group's stated precision is believed unless its variance factor is improbable at this level.
const BELIEVED: f64 = 0.01;

/// `v'Pv` and share of the redundancy of each group.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Group {
    /// `v'Pv`.
    pub chi_square: f64,
    /// Share of the redundancy.
    pub redundancy: f64,
}

impl Group {
    /// Root of the variance factor, 1 where the stated precision is not contradicted or the group is empty; `explained` of `v'Pv` with `dof` may be
    /// an effect's.
    fn factor(&self, explained: f64, dof: f64) -> f64 {
        let (rest, redundancy) = (self.chi_square - explained, self.redundancy - dof);
        if redundancy < 1.0 || rest <= 0.0 {
            return 1.0;
        }
        let upper = chi_square_sf(rest, redundancy) < 0.5 * BELIEVED;
        let lower = rest < chi_square_quantile(0.5 * BELIEVED, redundancy);
        if upper || lower { (rest / redundancy).sqrt() } else { 1.0 }
    }
}

/// Groups of a solution: image measurements, control coordinates, GNSS positions.
pub fn groups(
    problem: &Problem,
    state: &State,
    chi_square: f64,
    covariance: &Covariance,
    fitted: &FittedModel<'_>,
) -> [Group; 3] {
    let mut control = Group::default();
    for observation in &problem.control {
        let j = observation.index as usize;
        let computed = fitted.predictor.surveyed(&state.points[j]).unwrap_or(state.points[j]);
        add(&mut control, &(observation.position - computed), &observation.sigma, &covariance.points[j].diagonal());
    }
    let mut gnss = Group::default();
    for observation in &problem.gnss {
        let i = observation.index as usize;
        let computed = fitted.predictor.antenna(i).unwrap_or(state.poses[i].centre);
        let variance = Vector3::from_fn(|k, _| covariance.poses[i][(3 + k, 3 + k)]);
        add(&mut gnss, &(observation.position - computed), &observation.sigma, &variance);
    }
    let image = Group {
        chi_square: chi_square - control.chi_square - gnss.chi_square,
        redundancy: problem.redundancy().2 as f64 - control.redundancy - gnss.redundancy,
    };
    [image, control, gnss]
}

/// A position's share: its residual, and `1 - variance of the estimate / variance of the observation` per coordinate.
fn add(group: &mut Group, residual: &Vector3<f64>, sigma: &Vector3<f64>, variance: &Vector3<f64>) {
    for k in 0..3 {
        group.chi_square += (residual[k] / sigma[k]).powi(2);
        group.redundancy += 1.0 - (variance[k] / sigma[k].powi(2)).min(1.0);
    }
}

/// New factors on the a-priori standard deviations; `now` are those of the solution that `groups` are of. `explained[g]`: drop and degrees of
/// freedom that candidates of group `g` could bring.
///
/// Images are judged against what is stated of them. Control and positions are judged under the present factors: a block whose control weighs
/// less bends away from it, and would be found ever further away.
pub fn factors(stated_image: f64, now: SigmaFactors, groups: &[Group; 3], explained: &[(f64, f64); 3]) -> SigmaFactors {
    let factor = |g: usize, from: f64, now: f64| {
        let scale = (now / from).powi(2);
        let group = Group { chi_square: groups[g].chi_square * scale, ..groups[g] };
        from * group.factor(explained[g].0 * scale, explained[g].1)
    };
    SigmaFactors {
        image: factor(0, stated_image, now.image),
        control: factor(1, now.control, now.control),
        gnss: factor(2, now.gnss, now.gnss),
    }
}
