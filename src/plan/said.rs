//! What `check` and `diagnose` say of a block in which a mistake was made.

use crate::diagnose::verdict::{Diagnosis, Verdict};
use crate::mistakes::Mistake;
use serde::Serialize;

/// Groups between which an offset or a unit shows: which of them is wrong, nobody knows.
const SURVEYED: [&str; 3] = ["control", "check", "gnss"];

/// What is said of a block.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "as", content = "what", rename_all = "lowercase")]
pub enum Said {
    /// Nothing.
    Nothing,
    /// The mistake, by its kind and subject.
    Named,
    /// Another mistake: its kind and subject.
    Mistake(String),
    /// Effects of the catalogue.
    Effects(Vec<String>),
    /// Something is left that nothing explains.
    Unexplained,
    /// Measurements of the point that was changed are set aside.
    Aside,
    /// No reader takes the files, or no adjustment the block: why.
    Refused(String),
}

impl Said {
    /// Of the mistakes that were found, where there are any; `made` is kind and subject of the one that was made.
    pub(super) fn of_mistakes(found: &[Mistake], made: Option<(&str, &str)>) -> Option<Self> {
        let first = found.first()?;
        let same = |own: &Mistake| {
            made.is_some_and(|(kind, subject)| {
                let surveyed = SURVEYED.contains(&own.subject.as_str()) && SURVEYED.contains(&subject);
                own.kind == kind && (own.subject == subject || surveyed)
            })
        };
        Some(match found.iter().any(same) {
            true => Self::Named,
            false => Self::Mistake(format!("{} of {}", first.kind, first.subject)),
        })
    }

    /// Of a diagnosis; `points` are those whose measurements were changed.
    pub(super) fn of_diagnosis(found: &Diagnosis, made: Option<(&str, &str)>, points: &[String]) -> Self {
        if let Some(said) = Self::of_mistakes(&found.mistakes, made) {
            return said;
        }
        match found.verdict {
            Verdict::Adequate if points.iter().any(|point| found.outlier_points.contains(point)) => Self::Aside,
            Verdict::Adequate => Self::Nothing,
            _ if found.found.is_empty() => Self::Unexplained,
            _ => Self::Effects(found.found.iter().map(|own| own.effect.clone()).collect()),
        }
    }

    /// Two to five words.
    pub fn in_words(&self) -> String {
        match self {
            Self::Nothing => "nothing is said".into(),
            Self::Named => "named".into(),
            Self::Mistake(what) => format!("named as {what}"),
            Self::Effects(effects) => format!("missing: {}", effects.join(", ")),
            Self::Unexplained => "unexplained".into(),
            Self::Aside => "set aside, with its point".into(),
            Self::Refused(_) => "the files are refused".into(),
        }
    }
}
