//! A fit without outliers: adjust, judge every measurement, and adjust again until nothing changes. Where blunders bend
//! a least-squares fit, or make it fail, they are looked for in a robust one.

use super::{MAX_ROUNDS, Round, Snooping, Solved, Strictness, robust_fit};
use crate::adjust::native::pool::Pool;
use crate::adjust::{AdjustError, Options};
use crate::block::{Block, PointId};
use crate::model::Model;
use crate::problem::ProblemError;
use crate::run::RunError;
use crate::run::fit::{FEW_ITERATIONS, Fit, fit};
use std::collections::HashSet;

/// Difference of `v'Pv` that two fits of one minimum may have: some times what either leaves.
pub const SAME_MINIMUM: f64 = 1e-2;

/// How a fit settles.
#[derive(Clone, Copy)]
pub struct Settling<'a> {
    /// Options of every fit.
    pub options: &'a Options,
    /// Are outliers searched, and set aside?
    pub snoop: bool,
    /// Told what is being done.
    pub tell: &'a (dyn Fn(&str) + Sync),
}

/// Fits and sets outliers aside until nothing changes. `near`: an earlier fit of the same images, to start from.
///
/// # Errors
/// A fit that fails, also without what stands alone at a robust one.
pub fn settle(
    whole: &Block,
    search: &mut Snooping,
    model: &Model,
    near: Option<&Fit>,
    strictness: Strictness,
    settings: &Settling<'_>,
) -> Result<Fit, RunError> {
    let mut rounds = Rounds { whole, search, model, settings };
    let mut fitted = rounds.begin(near, strictness)?;
    if !settings.snoop {
        return Ok(fitted);
    }
    for _ in 0..MAX_ROUNDS {
        let before = rounds.search.clone();
        let round = judge(whole, rounds.search, &fitted, strictness, settings)?;
        if round.rejected + round.returned == 0 {
            break;
        }
        let mut robust = None;
        if round.bent {
            (settings.tell)("blunders bend the adjustment: searching them by a robust fit");
            let judged = std::mem::replace(rounds.search, before.clone());
            robust = rounds.search_robustly(near, strictness)?;
            if robust.is_none() {
                *rounds.search = judged;
            }
        }
        // Not from where a blunder had bent it: that may be another minimum.
        let bent = round.bent || round.held_back > 0;
        let from = if bent { near } else { Some(&fitted) };
        let again = |rounds: &mut Rounds<'_>| match &robust {
            Some(robust) => rounds.fit_after(robust, near),
            None => rounds.fit(from),
        };
        fitted = match again(&mut rounds) {
            // Two rays of which one is wrong may agree by chance, at a point that no adjustment finds.
            Err(_) if rounds.search.refuse_returned(&before) => return again(&mut rounds),
            fitted => fitted?,
        };
    }
    Ok(fitted)
}

/// Judges every measurement at a fit.
///
/// # Errors
/// A fit at which predictions fail.
pub fn judge(
    whole: &Block,
    search: &mut Snooping,
    fitted: &Fit,
    strictness: Strictness,
    settings: &Settling<'_>,
) -> Result<Round, AdjustError> {
    let seen = Solved { problem: &fitted.problem, state: &fitted.solution.state };
    Pool::new(settings.options.threads)?.install(|| search.judge(whole, seen, strictness))
}

/// A model, the block that it is fitted to, and what of it is out so far.
struct Rounds<'a> {
    whole: &'a Block,
    search: &'a mut Snooping,
    model: &'a Model,
    settings: &'a Settling<'a>,
}

impl Rounds<'_> {
    /// The fit before anything is judged at one.
    fn begin(&mut self, near: Option<&Fit>, strictness: Strictness) -> Result<Fit, RunError> {
        let Settling { snoop, tell, .. } = self.settings;
        match self.fit(near) {
            Err(error) if *snoop => {
                tell(&format!("{error}: searching blunders by a robust fit"));
                // Nothing stands alone: it is not for a blunder that the fit failed.
                let robust = self.search_robustly(None, Strictness::Loose)?.ok_or(error)?;
                self.fit_after(&robust, None)
            }
            Ok(fitted) if *snoop && fitted.solution.iterations > FEW_ITERATIONS => {
                tell("the adjustment came a long way: searching what may have bent it by a robust fit");
                Ok(self.without_what_bends(near, strictness)?.unwrap_or(fitted))
            }
            fitted => fitted,
        }
    }

    /// The fit in place of one that came a long way. Least squares would rather bend a camera out of all proportion
    /// than leave a residual of hundreds of pixels, and nothing stands out when that is done. `None` where no
    /// measurement is so far off at a robust fit.
    fn without_what_bends(&mut self, near: Option<&Fit>, strictness: Strictness) -> Result<Option<Fit>, RunError> {
        let before = self.search.clone();
        let robust = self.search_robustly(near, strictness)?;
        match robust.filter(|_| self.search.found_bent_since(&before)) {
            Some(robust) => self.fit_after(&robust, near).map(Some),
            None => {
                *self.search = before;
                Ok(None)
            }
        }
    }

    /// Judges at robust fits until nothing changes. Gives the last of them, to start from: what is left agrees there,
    /// and an image that wrong measurements had oriented is a long way from where the block puts it. `None` where
    /// nothing changed, as where such a fit fails.
    fn search_robustly(&mut self, near: Option<&Fit>, strictness: Strictness) -> Result<Option<Fit>, RunError> {
        let Self { whole, model, settings, .. } = *self;
        let options = Options { may_stay_unconverged: true, ..settings.options.clone() };
        let (mut last, mut changed) = (None, false);
        for _ in 0..MAX_ROUNDS {
            let robust = self.fit_what_meets(|block| robust_fit(block, model, near, &options));
            let Ok(robust) = robust else { break };
            let round = judge(whole, self.search, &robust, strictness, settings)?;
            last = Some(robust);
            if !self.search.set_aside_images(whole) && round.rejected + round.returned == 0 {
                break;
            }
            changed = true;
        }
        Ok(last.filter(|_| changed))
    }

    /// The fit of what a robust one has left: from there, since an image that wrong measurements had oriented is a long
    /// way from where the block puts it, and from where that one had started, since blunders may have bent it into
    /// another minimum. The lower one.
    fn fit_after(&mut self, robust: &Fit, near: Option<&Fit>) -> Result<Fit, RunError> {
        let there = self.fit(Some(robust));
        let search = self.search.clone();
        let lower = self.fit(near).ok().filter(|here| match &there {
            Ok(there) => {
                let same_measurements = self.search.left_out() == search.left_out();
                same_measurements && here.chi_square() < there.chi_square() - SAME_MINIMUM
            }
            Err(_) => true,
        });
        if lower.is_none() {
            *self.search = search;
        }
        lower.map_or(there, Ok)
    }

    fn fit(&mut self, near: Option<&Fit>) -> Result<Fit, RunError> {
        let Self { model, settings, .. } = *self;
        self.fit_what_meets(|block| fit(block, model, near, settings.options))
    }

    /// Fits, without the points whose rays turn out not to meet.
    fn fit_what_meets(&mut self, fit: impl Fn(&Block) -> Result<Fit, RunError>) -> Result<Fit, RunError> {
        let whole = self.whole;
        loop {
            let error = match fit(&self.search.block(whole)) {
                Ok(fitted) => return Ok(fitted),
                Err(error) => error,
            };
            let apart = match &error {
                RunError::Adjust(AdjustError::RaysDoNotMeet { point, .. }) => std::slice::from_ref(point),
                // What is left of a point's rays need not meet at the approximations.
                RunError::Problem(ProblemError::NoIntersection { points }) => points,
                _ => return Err(error),
            };
            let apart: HashSet<&String> = apart.iter().collect();
            let ids = (0..whole.tie_points.len()).filter(|id| apart.contains(&whole.tie_points[*id].name));
            let set_aside = ids.map(|id| self.search.set_aside(whole, PointId::from(id))).filter(|any| *any).count();
            if set_aside == 0 {
                return Err(error);
            }
        }
    }
}
