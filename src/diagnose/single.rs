//! Does what an effect explains rest on a single tie point? An effect acts on many points and a blunder on one, and a
//! shape that is put where it fits best fits a blunder best of all. Of two hypotheses that explain the same residuals
//! the one that explains more is taken (Baarda 1968): whatever lies in one point alone, a blunder there explains
//! entirely. So the effect has to be significant without that point, too.

use crate::adjust::{AdjustError, Options};
use crate::problem::PointSource;
use crate::run::fit::{Fit, solve};
use crate::run::squares;

/// Share of the drop of `v'Pv` that lies in one point, from which it is worth two fits to see what is left without it.
/// A blunder has most of the drop in its own point even where its images give way to it; of an effect that twenty
/// points feel alike, none has that much.
const CARRIED: f64 = 0.2;

/// A tie point that carries an effect.
pub struct Carrier {
    /// Its name.
    pub point: String,
    /// Share of the drop that is left without its measurements.
    pub left: f64,
}

/// The tie point in which most of the drop between two fits of the same measurements lies; `None` where none has a
/// large share of it.
///
/// # Errors
/// A solution at which predictions fail.
pub fn carrier(before: &Fit, after: &Fit, options: &Options) -> Result<Option<Carrier>, AdjustError> {
    let drop = before.chi_square() - after.chi_square();
    let (was, is) = (squares_of_points(before)?, squares_of_points(after)?);
    let ties = (0..was.len()).filter(|j| matches!(before.problem.point_sources[*j], PointSource::Tie(_)));
    let of_points = ties.map(|j| (j, was[j] - is[j])).max_by(|(_, a), (_, b)| a.total_cmp(b));
    let Some((carrier, _)) = of_points.filter(|(_, own)| *own > CARRIED * drop) else { return Ok(None) };
    // A block that needs this point to be determined says nothing of what it would be without.
    let Ok(was) = chi_square_without(before, carrier, options) else { return Ok(None) };
    // An effect that needs it says everything.
    let is = chi_square_without(after, carrier, options).unwrap_or(was);
    let left = ((was - is) / drop).max(0.0);
    Ok(Some(Carrier { point: before.problem.point_names[carrier].clone(), left }))
}

/// `v'Pv` of the image measurements of each point.
fn squares_of_points(fit: &Fit) -> Result<Vec<f64>, AdjustError> {
    let mut sums = vec![0.0; fit.problem.point_sources.len()];
    squares::each(fit, |point, _, square| sums[point] += square)?;
    Ok(sums)
}

/// `v'Pv` of a fit without one of its points.
fn chi_square_without(fit: &Fit, point: usize, options: &Options) -> Result<f64, AdjustError> {
    let kept: Vec<usize> = (0..fit.problem.point_sources.len()).filter(|j| *j != point).collect();
    let (mut part, state) = fit.problem.with_points(&fit.solution.state, &kept);
    part.start = state;
    part.hold_unoriented_images();
    Ok(solve(&fit.model, part, options)?.chi_square())
}
