//! Why a diagnosis failed.

use crate::adjust::AdjustError;
use crate::measure::MeasureError;
use crate::problem::ProblemError;
use crate::run::RunError;

/// Why a diagnosis failed.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// A fit failed.
    #[error(transparent)]
    Run(#[from] RunError),
}

impl From<AdjustError> for DiagnoseError {
    fn from(error: AdjustError) -> Self {
        Self::Run(error.into())
    }
}

impl From<MeasureError> for DiagnoseError {
    fn from(error: MeasureError) -> Self {
        AdjustError::from(error).into()
    }
}

impl From<ProblemError> for DiagnoseError {
    fn from(error: ProblemError) -> Self {
        Self::Run(error.into())
    }
}
