//! Why there is no problem.

/// Why a block and a model do not make a problem.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A datum without its observations.
    #[error("datum `{datum}` needs {needs}, and the block has none; use --datum free")]
    Datum {
        /// Its name.
        datum: &'static str,
        /// What it needs.
        needs: &'static str,
    },
    /// A name of the model that the block does not have.
    #[error("the model names {kind} `{name}`, which the block does not have{hint}")]
    Unknown {
        /// camera, parameter, ...
        kind: &'static str,
        /// The name.
        name: String,
        /// `; it has ...`, or empty.
        hint: String,
    },
    /// An effect whose observations the block lacks.
    #[error("effect `{effect}` needs {needs}")]
    Need {
        /// Id.
        effect: String,
        /// What is missing.
        needs: &'static str,
    },
    /// A value that cannot be used.
    #[error("{0}")]
    Value(String),
    /// Nothing to adjust.
    #[error("no point is measured in two images: nothing to adjust")]
    Empty,
    /// Tie points without coordinates in front of their cameras whose rays do not meet.
    #[error(
        "tie point `{}`{} has no approximate coordinates in front of its cameras, and its rays do not meet there. \
         Correct its row in points.csv or remove it",
        points[0],
        if points.len() > 1 { format!(" (and {} more)", points.len() - 1) } else { String::new() }
    )]
    NoIntersection {
        /// Names, one or more.
        points: Vec<String>,
    },
}
