//! Blunders in a plain adjustment: set aside where asked for, named where not, and where they made it fail.

use super::model_options::Treatment;
use super::output::Output;
use crate::adjust::{AdjustError, Options};
use crate::block::Block;
use crate::model::Model;
use crate::run::fit::Fit;
use crate::run::folder::{self, FILES, SUMMARY};
use crate::run::{Run, RunError, residual_rows};
use crate::snooping::settle::{Settling, settle};
use crate::snooping::{Outliers, Snooping, Solved, Strictness, has_converged, robust_fit, stand_alone};

const ADVICE: &str = "--outliers snoop sets them aside";
/// Measurements that a message names.
const NAMED: usize = 5;

/// What is set aside before the adjustment: points whose rays do not meet, and with `--outliers snoop` what stands
/// alone.
pub fn search(
    block: &Block,
    model: &Model,
    options: &Options,
    treatment: Option<Treatment>,
    tell: &(dyn Fn(&str) + Sync),
) -> Result<Snooping, RunError> {
    let mut search = Snooping::new(block, model);
    if treatment == Some(Treatment::Snoop) {
        tell("searching outliers");
        let settling = Settling { options, snoop: true, tell };
        let rough = settle(block, &mut search, model, None, Strictness::Loose, &settling)?;
        settle(block, &mut search, model, Some(&rough), Strictness::Tight, &settling)?;
    }
    Ok(search)
}

/// What stands alone in an adjustment.
pub struct Named {
    /// In words.
    pub text: String,
    /// Does it bend the adjustment? Named is then what stands alone in a robust one.
    pub bent: bool,
}

/// Names the measurements that stand alone in an adjustment, in a robust one where they may have bent it; `None` where
/// none does. Solvers that fail or disagree are a sign of that, too: what is bent far enough has no minimum that is
/// known to all digits.
pub fn named(block: &Block, model: &Model, options: &Options, run: &Run) -> Option<Named> {
    let solved = Solved { problem: &run.problem, state: &run.solution().state };
    let outliers = stand_alone(block, solved).ok();
    let in_doubt = !run.failures.is_empty() || run.agreement.as_ref().is_some_and(|agreement| !agreement.agree);
    let may_bend = |outliers: &Outliers| outliers.rounds.iter().any(|round| round.bent);
    let is_bent = outliers.as_ref().is_none_or(may_bend);
    if (in_doubt || is_bent)
        && let Ok(fit) = robust_fit(block, model, None, options)
        && let Ok(robust) = stand_alone(block, solved_by(&fit))
        && !robust.rejected.is_empty()
        && (is_bent || may_bend(&robust))
    {
        return Some(Named { text: in_robust(block, &robust), bent: true });
    }
    let outliers = outliers.filter(|outliers| !outliers.rejected.is_empty())?;
    Some(Named { text: format!("{}; {ADVICE}", list(block, &outliers)), bent: false })
}

/// What stands alone in a robust adjustment, in the same words whatever became of the one without a loss.
fn in_robust(block: &Block, outliers: &Outliers) -> String {
    format!("in a robust adjustment {}; one without a loss is bent by what is wrong; {ADVICE}", list(block, outliers))
}

fn solved_by(fit: &Fit) -> Solved<'_> {
    Solved { problem: &fit.problem, state: &fit.solution.state }
}

/// The error of an adjustment, with the measurements that stand alone in a robust one. Its residuals are written where
/// they replace no run of `output`.
pub fn explain(
    error: RunError,
    block: &Block,
    model: &Model,
    options: &Options,
    output: Option<&Output>,
) -> anyhow::Error {
    let RunError::Adjust(failure) = &error else { return error.into() };
    // What makes a problem singular is named; that it was blunders, only a fit that converged may say.
    let may_stay_unconverged = matches!(failure, AdjustError::NotConverged { .. });
    let options = Options { may_stay_unconverged, ..options.clone() };
    let Ok(fit) = robust_fit(block, model, None, &options) else { return error.into() };
    // A camera that a robust fit, too, can only hold is not left undetermined by blunders.
    if matches!(failure, AdjustError::Singular { .. }) && fit.model.free != model.free {
        return error.into();
    }
    let converged = has_converged(&fit);
    let solved = solved_by(&fit);
    let Ok(outliers) = stand_alone(block, solved) else { return error.into() };
    if outliers.rejected.is_empty() && !converged {
        return error.into();
    }
    let mut text = match outliers.rejected.is_empty() {
        true => "no measurement stands alone in a robust adjustment: blunders are not the reason".to_string(),
        false => in_robust(block, &outliers),
    };
    let rows = residual_rows(block, solved.problem, solved.state, None);
    if let (Ok(rows), Some(output)) = (rows, output.filter(|output| !output.folder().join(SUMMARY).exists())) {
        let written = output.write(&FILES, "residuals.csv", |dir| Ok(folder::write_residuals(dir, block, &rows)?));
        if written.is_ok() {
            text += &format!(" (its residuals: {})", output.folder().join("residuals.csv").display());
        }
    }
    anyhow::Error::from(error).context(text)
}

fn list(block: &Block, outliers: &Outliers) -> String {
    let rows = outliers.rows(block);
    let one = |(row, rejected): (&folder::OutlierRow, &crate::snooping::Rejected)| {
        format!("point {} in image {} ({:.0} standard deviations)", row.point, row.image, rejected.normalised)
    };
    let worst: Vec<String> = rows.iter().zip(&outliers.rejected).take(NAMED).map(one).collect();
    let count = match rows.len() {
        1 => "a measurement stands alone".to_string(),
        n => format!("{n} measurements stand alone, the worst"),
    };
    format!("{count}: {}", worst.join(", "))
}
