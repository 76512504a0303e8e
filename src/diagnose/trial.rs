//! One candidate refitted: it stays if the refit drops significantly and predicts measurements that it did not see.

use super::fit::{Fit, refit};
use super::forward::Settings;
use super::heldout::{HeldOut, held_out};
use super::models::{at_solution, with_candidate};
use super::score::{Score, Screening};
use crate::block::Block;
use crate::effects::Stage;
use crate::math::statistics::chi_square_ln_sf;

/// A candidate that was refitted.
#[derive(Debug, Clone)]
pub struct Confirmation {
    /// Id.
    pub id: String,
    /// Predicted drop, and that of the refit.
    pub predicted: f64,
    /// See `predicted`.
    pub drop: f64,
    /// Held-out RMS before and after, px.
    pub before_px: f64,
    /// See `before_px`.
    pub after_px: f64,
    /// It was kept.
    pub kept: bool,
    /// Why not.
    pub reason: String,
}

/// A fit and what it predicts.
#[derive(Clone)]
pub struct Tried {
    /// The fit.
    pub fit: Fit,
    /// Its predictions of left-out measurements.
    pub heldout: HeldOut,
}

impl Tried {
    /// Predicts what parts of `fit` leave out.
    pub fn new(fit: Fit, settings: &Settings<'_>) -> Result<Self, crate::adjust::AdjustError> {
        let heldout = held_out(&fit, &settings.options)?;
        Ok(Self { fit, heldout })
    }
}

/// Family-wise level of the candidates of a screening, as a logarithm.
pub(super) fn ln_level(screening: &Screening, settings: &Settings<'_>) -> f64 {
    (settings.significance / screening.scores.len().max(1) as f64).ln()
}

/// Refits `before` with the candidate of `score`; the fit where it is kept. `ln_level`: significance that the refit's drop must have.
pub(super) fn try_candidate(
    block: &Block,
    before: &Tried,
    score: &Score,
    ln_level: f64,
    settings: &Settings<'_>,
) -> (Confirmation, Option<Tried>) {
    let mut confirmation = Confirmation {
        id: score.candidate.id.clone(),
        predicted: score.predicted,
        drop: 0.0,
        before_px: before.heldout.rms_px(),
        after_px: f64::NAN,
        kept: false,
        reason: String::new(),
    };
    let model = with_candidate(&before.fit.model, score);
    let after = refit(block, &model, &before.fit, &settings.options).map_err(|error| error.to_string());
    let after = after.and_then(|fit| Tried::new(fit, settings).map_err(|error| error.to_string()));
    let mut after = match after {
        Ok(after) => after,
        Err(error) => {
            confirmation.reason = error;
            return (confirmation, None);
        }
    };
    confirmation.drop = 2.0 * (before.fit.solution.cost - after.fit.solution.cost);
    confirmation.after_px = after.heldout.rms_px();
    if ln_p_of_drop(&confirmation, score) > ln_level {
        confirmation.reason = format!("its refit takes {:.1} of v'Pv away, which chance does too", confirmation.drop);
    } else if after.heldout.normalised >= before.heldout.normalised {
        confirmation.reason = "it does not predict left-out measurements better".into();
    } else {
        confirmation.kept = true;
    }
    after.fit.model = at_solution(&after.fit);
    let kept = confirmation.kept;
    (confirmation, kept.then_some(after))
}

/// Logarithm of the p-value of a refit's drop.
fn ln_p_of_drop(confirmation: &Confirmation, score: &Score) -> f64 {
    chi_square_ln_sf(confirmation.drop.max(0.0), score.dof.max(1.0))
}

/// An effect that only its refit shows.
pub(super) struct Rescued {
    pub id: String,
    pub drop: f64,
    pub ln_p: f64,
    pub after: Tried,
}

/// Where a missing distortion term has driven the centre of distortion far away, the score at that place under-predicts it; its refit does not.
/// Refits every effect of the image that was not tried yet, and keeps the one whose drop is most significant.
pub(super) fn rescue(
    block: &Block,
    before: &Tried,
    screening: &Screening,
    settings: &Settings<'_>,
    confirmations: &mut Vec<Confirmation>,
) -> Option<Rescued> {
    let mut best: Option<Rescued> = None;
    for score in screening.scores.iter().filter(|score| score.candidate.physical && !score.candidate.scanned()) {
        let of_image = score.candidate.term().is_some_and(|term| term.effect.descriptor().stage == Stage::Image);
        if !of_image || confirmations.iter().any(|confirmation| confirmation.id == score.candidate.id) {
            continue;
        }
        let (confirmation, after) = try_candidate(block, before, score, ln_level(screening, settings), settings);
        let (drop, ln_p) = (confirmation.drop, ln_p_of_drop(&confirmation, score));
        confirmations.push(confirmation);
        let Some(after) = after else { continue };
        if best.as_ref().is_none_or(|best| ln_p < best.ln_p) {
            best = Some(Rescued { id: score.candidate.id.clone(), drop, ln_p, after });
        }
    }
    best
}
