//! Exit codes: which error means which code, in one place.

use crate::adjust::AdjustError;
use crate::effects::plugin::PluginError;
use crate::evaluate::similarity::SimilarityError;
use crate::io;
use crate::kit::build::BuildError;
use crate::measure::MeasureError;
use crate::plan::notice::NoticeError;
use crate::problem::ProblemError;
use crate::run::RunError;
use crate::scenario::ScenarioError;
use crate::scenario::extras::ExtraError;
use crate::scenario::mission::MissionError;
use crate::validate::nist::set::NistError;
use std::process::ExitCode;

/// How the program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Everything was done.
    Done = 0,
    /// A failure without a code of its own.
    Other = 1,
    /// Bad usage or bad input.
    BadInput = 2,
    /// The adjustment failed: not converged, singular.
    AdjustmentFailed = 3,
    /// The two solvers disagree, with each other or with what is certified.
    Disagreement = 4,
}

/// The command line, or a file that it names, asks for something that does not exist or does not fit together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// Blunders bend the adjustment: what solvers find in it is no result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Bent(pub String);

/// The two solvers found different things; says what and by how much.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the two solvers disagree: {0}")]
pub struct Disagreement(pub String);

/// Results miss what is certified; says which and by how much.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not as certified: {0}")]
pub struct NotCertified(pub String);

impl Exit {
    /// The code of an error: that of the outermost cause that has one.
    pub fn of(error: &anyhow::Error) -> Exit {
        error.chain().find_map(code).unwrap_or(Exit::Other)
    }
}

fn code(cause: &(dyn std::error::Error + 'static)) -> Option<Exit> {
    let bad_input = cause.is::<Usage>()
        || cause.is::<ScenarioError>()
        || cause.is::<ExtraError>()
        || cause.is::<MissionError>()
        || cause.is::<SimilarityError>()
        || cause.is::<ProblemError>()
        || cause.is::<MeasureError>()
        || cause.is::<PluginError>()
        || cause.is::<NistError>();
    if bad_input {
        return Some(Exit::BadInput);
    }
    if let Some(error) = cause.downcast_ref::<BuildError>() {
        return Some(match error {
            BuildError::Source { .. } | BuildError::Refused { .. } | BuildError::NoLibrary { .. } => Exit::BadInput,
            BuildError::NoCompiler { .. } | BuildError::Output { .. } => Exit::Other,
        });
    }
    if let Some(NoticeError::Mistake(..)) = cause.downcast_ref() {
        return Some(Exit::BadInput);
    }
    if cause.is::<Bent>() {
        return Some(Exit::AdjustmentFailed);
    }
    if cause.is::<Disagreement>() || cause.is::<NotCertified>() {
        return Some(Exit::Disagreement);
    }
    if let Some(error) = cause.downcast_ref::<io::Error>() {
        return Some(match error {
            io::Error::Content { .. } | io::Error::Read { .. } => Exit::BadInput,
            io::Error::Write { .. } => Exit::Other,
        });
    }
    // Transparent errors: what they hold is not among their causes.
    match cause.downcast_ref::<RunError>() {
        Some(RunError::Adjust(error)) => Some(adjustment(error)),
        Some(RunError::Problem(_) | RunError::Measure(_) | RunError::Similarity(_)) => Some(Exit::BadInput),
        None => cause.downcast_ref::<AdjustError>().map(adjustment),
    }
}

fn adjustment(error: &AdjustError) -> Exit {
    match error {
        AdjustError::Singular { .. } | AdjustError::RaysDoNotMeet { .. } | AdjustError::NotConverged { .. } => {
            Exit::AdjustmentFailed
        }
        AdjustError::BadStart { .. } | AdjustError::Unsupported { .. } | AdjustError::WrongDerivative { .. } => {
            Exit::BadInput
        }
        AdjustError::Cancelled { .. }
        | AdjustError::NoThreads { .. }
        | AdjustError::NoMemory { .. }
        | AdjustError::Bridge(_) => Exit::Other,
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_is_found_under_context() {
        let singular = AdjustError::Singular { solver: "native", directions: Vec::new() };
        assert_eq!(Exit::of(&anyhow::Error::from(singular).context("block `dike`")), Exit::AdjustmentFailed);
        assert_eq!(Exit::of(&anyhow::Error::from(Usage("no".into())).context("a").context("b")), Exit::BadInput);
        assert_eq!(Exit::of(&anyhow::anyhow!("disk full")), Exit::Other);
        let stuck = AdjustError::NotConverged { solver: "ceres", iterations: 3, reason: "stuck".into() };
        assert_eq!(Exit::of(&RunError::from(stuck).into()), Exit::AdjustmentFailed);
        assert_eq!(Exit::of(&RunError::from(ProblemError::Empty).into()), Exit::BadInput);
        assert_eq!(Exit::of(&Disagreement("f".into()).into()), Exit::Disagreement);
        assert_eq!(Exit::of(&NotCertified("f".into()).into()), Exit::Disagreement);
    }
}
