//! The reader of run folders, and the page of what it takes.

use super::folder::{said, with_files};
use misclosure::report::pictures::RunFolder;
use misclosure::report::run::{Coverage, page};
use misclosure::run::TieResiduals;
use misclosure::run::folder::{FILES, SUMMARY, read_outliers};

/// Files of a run, in the order in which an input has them.
pub fn files() -> Vec<&'static str> {
    std::iter::once(SUMMARY).chain(FILES).collect()
}

/// One input.
pub fn run(data: &[u8]) {
    with_files(&files(), data, |folder| {
        if let Err(error) = read_outliers(folder) {
            said(error);
        }
        match RunFolder::read(folder) {
            Ok(run) => match (TieResiduals::read(folder, &run.images), Coverage::read(folder)) {
                (Ok(ties), Ok(coverage)) => drop(page(&run, ties, &coverage)),
                (Err(error), _) => said(error),
                (_, Err(error)) => said(error),
            },
            Err(error) => said(error),
        }
    });
}
