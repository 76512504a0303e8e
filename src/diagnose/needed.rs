//! Is an added effect still needed beside those that came after it?

use super::candidate::candidates;
use super::fit::{DiagnoseError, Fit, fit};
use super::forward::Settings;
use super::models::without_effects;
use super::score::{Base, screen};
use crate::block::Block;
use crate::effects::Role;
use crate::math::statistics::chi_square_ln_sf;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// An added effect (not the newest) that the others do not leave significant any more: by its parameters' covariance, or for a random effect by
/// its score beside the others.
pub(super) fn not_needed(
    block: &Block,
    fitted: &Fit,
    added: &[String],
    settings: &Settings<'_>,
) -> Result<Option<String>, DiagnoseError> {
    let older = &added[..added.len().saturating_sub(1)];
    let level = (settings.significance / older.len().max(1) as f64).ln();
    let mut least: Option<(f64, &String)> = None;
    for id in older {
        let ln_p = match wald(fitted, id) {
            Some((statistic, dof)) => chi_square_ln_sf(statistic, dof),
            None => score_beside_others(block, fitted, id, settings)?,
        };
        if ln_p > level && least.is_none_or(|(other, _)| ln_p > other) {
            least = Some((ln_p, id));
        }
    }
    Ok(least.map(|(_, id)| id.clone()))
}

/// Logarithm of the p-value of an effect's score test in the model without it; minus infinity (needed) where it cannot be tested.
fn score_beside_others(block: &Block, fitted: &Fit, id: &str, settings: &Settings<'_>) -> Result<f64, DiagnoseError> {
    let model = without_effects(&fitted.model, &[id.to_string()]);
    let without = fit(block, &model, Some(fitted), &settings.options)?;
    let mut list = candidates(block, &without.problem, &without.model, settings.plugins);
    list.retain(|candidate| candidate.id == id);
    let Fit { model, problem, solution } = &without;
    let state = &solution.state;
    let base =
        Base { block, model, problem, state, threads: settings.options.threads, significance: settings.significance };
    let screening = screen(&base, list, &BTreeMap::new())?;
    Ok(screening.scores.first().map_or(f64::NEG_INFINITY, |score| score.ln_p))
}

/// Wald statistic and degrees of freedom of an effect's linear parameters; `None` for random effects and camera parameters.
fn wald(fitted: &Fit, id: &str) -> Option<(f64, f64)> {
    let covariance = fitted.solution.covariance.as_ref()?;
    let layout = fitted.problem.layout();
    let mut rows = Vec::new();
    let mut values = Vec::new();
    for (row, unknown) in covariance.shared_unknowns.iter().enumerate().filter(|(_, u)| **u >= layout.theta(0)) {
        let t = unknown - layout.theta(0);
        let entry = &fitted.problem.theta[t];
        let descriptor = fitted.problem.effects[entry.effect as usize].effect.descriptor();
        let parameter = &descriptor.parameters[entry.parameter as usize];
        if descriptor.id == id && parameter.role == Role::Estimated {
            rows.push(row);
            values.push(fitted.solution.state.theta[t] - parameter.nominal);
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), rows.len(), |i, j| covariance.shared[(rows[i], rows[j])]);
    let values = DVector::from_vec(values);
    let solved = matrix.cholesky()?.solve(&values);
    (!rows.is_empty()).then(|| (values.dot(&solved), rows.len() as f64))
}
