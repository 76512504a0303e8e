//! Which of several laws it is: their refits tell.

use super::super::added::Added;
use super::super::fit::{DiagnoseError, Fit};
use super::super::linearised::Linearised;
use super::super::select::{Beside, Situation};
use super::super::settings::Settings;
use super::Improvement;
use crate::block::Block;

/// A set, the fit with it, and what the diagnosis has then taken in.
pub(super) struct Contender {
    pub(super) set: usize,
    pub(super) refitted: Result<(Fit, Added), DiagnoseError>,
}

impl Contender {
    /// `v'Pv` that is left.
    fn left(&self) -> f64 {
        self.refitted.as_ref().map_or(f64::INFINITY, |(fit, _)| fit.chi_square())
    }
}

impl Improvement {
    /// Refits with each of some sets; `None` without any. The one whose refit leaves least among variants, which have as many parameters as each
    /// other; among laws the surest, each judged with its own parameters and after as many places.
    pub(super) fn best_refit(
        &self,
        block: &Block,
        linearised: &Linearised,
        situation: &Situation<'_>,
        beside: &Beside,
        sets: &[usize],
        settings: &Settings<'_>,
    ) -> Option<Contender> {
        let id = |set: usize| &linearised.sets[set].id;
        let contender = |set: usize| {
            let refitted = self.refit(block, linearised, situation, beside, set, settings);
            Contender { set, refitted }
        };
        sets.iter().map(|set| contender(*set)).reduce(|best, other| {
            let better = match id(best.set) == id(other.set) {
                true => other.left() < best.left(),
                false => self.ln_p(&other, situation, beside) < self.ln_p(&best, situation, beside),
            };
            if !better {
                return best;
            }
            (settings.tell)(&format!("{} explains it better", id(other.set)));
            other
        })
    }

    /// Logarithm of the p-value of what a refit took away.
    pub(super) fn ln_p(&self, contender: &Contender, situation: &Situation<'_>, beside: &Beside) -> f64 {
        let judged = contender.refitted.is_ok().then(|| situation.judge(contender.set, beside)).flatten();
        judged.map_or(0.0, |judged| {
            let share = (self.fit.chi_square() - contender.left()) / judged.drop;
            situation.ln_p_of_share(&judged, beside, share.max(0.0))
        })
    }
}
