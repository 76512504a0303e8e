//! What the tests found.

use super::asked::Tested;
use super::{Pictures, StructureTest};

/// What one family of tests found.
#[derive(Default)]
pub(super) struct Found {
    pub(super) tests: Vec<StructureTest>,
    pub(super) skipped: Vec<(&'static str, String)>,
    pub(super) pictures: Pictures,
    /// Columns that stand for a test where they are not all of its own, by their numbers in it.
    pub(super) shapes: Vec<(&'static str, Vec<usize>)>,
}

impl Found {
    pub(super) fn push(&mut self, against: &'static str, tested: Option<Tested>, description: String) {
        match tested {
            Some(tested) => self.tests.push(StructureTest {
                against,
                statistic: tested.statistic,
                dof: tested.dof,
                p_value: tested.p_value,
                ln_p_value: tested.ln_p_value,
                family_p_value: tested.p_value,
                decides: true,
                description,
            }),
            None => self.skip(against, "the base model leaves nothing of it, or too few measurements"),
        }
    }

    pub(super) fn skip(&mut self, against: &'static str, why: &str) {
        self.skipped.push((against, why.into()));
    }
}
