//! Taking out what was taken in: as a rule asks, as a structure asks that it could be, as somebody asks.

use super::super::added::Added;
use super::super::fit::{DiagnoseError, Fit, fit};
use super::super::heldout::held_out_px;
use super::super::linearised::Linearised;
use super::super::models::{at_approximations, with_search_held, without_effect};
use super::super::probability::probability;
use super::super::select::challenge::{self, Shape};
use super::super::select::{Event, Situation, Taken};
use super::super::settings::Settings;
use super::super::settle::SAME_MINIMUM;
use super::{Change, Improvement};
use crate::adjust::native::pool::Pool;
use crate::block::Block;

impl Improvement {
    /// Takes out an effect or a group that was taken in.
    ///
    /// # Errors
    /// A refit that fails.
    pub fn remove(&mut self, block: &Block, id: &str, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        self.take_out(block, id, "as asked for", settings)
    }

    /// Takes out an effect that a structure could itself be. Did one go?
    ///
    /// # Errors
    /// A wish to stop.
    pub fn challenged(
        &mut self,
        block: &Block,
        situation: &Situation<'_>,
        structures: &[Shape],
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        let event = Pool::new(settings.options.threads)?.install(|| challenge::rule(situation, structures));
        let Some(Event::Removed { id, why }) = event else { return Ok(false) };
        let went = self.let_go(block, &id, &why, settings)?;
        if went {
            self.refused.insert(id);
        }
        Ok(went)
    }

    /// Takes an effect out as a rule asks, where a fit without it succeeds; where none does, it stays. Did it go?
    ///
    /// # Errors
    /// A wish to stop.
    pub(super) fn let_go(
        &mut self,
        block: &Block,
        id: &str,
        why: &str,
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        let Err(error) = self.take_out(block, id, why, settings) else { return Ok(true) };
        if settings.options.stop.is_raised() {
            return Err(error);
        }
        let reason = format!("{id} stays, for without it: {error}");
        (settings.tell)(&reason);
        self.staying.insert(id.to_string());
        if let Some(confirmation) = self.confirmations.iter_mut().rfind(|confirmation| confirmation.id == id) {
            confirmation.reason = reason;
        }
        Ok(false)
    }

    /// The fit without an effect that was taken in, and what the diagnosis has then taken in.
    fn fit_without(&self, block: &Block, id: &str, settings: &Settings<'_>) -> Result<(Fit, Added), DiagnoseError> {
        let mut parts = self.parts.clone();
        let model = without_effect(&self.fit, id, &mut parts);
        // What has a place on the sensor keeps it until the rest has settled: at a state so far from the solution the place follows anything.
        let held = with_search_held(&model).and_then(|held| fit(block, &held, Some(&self.fit), &settings.options).ok());
        let near = held.as_ref().unwrap_or(&self.fit);
        let after = fit(block, &model, Some(near), &settings.options)?;
        Ok((self.settle(block, after, &parts, settings)?, parts))
    }

    /// The same from the block's approximations, where that ends lower: what leaves may have bent the camera into another minimum.
    fn lowest_without(&self, block: &Block, id: &str, settings: &Settings<'_>) -> Result<(Fit, Added), DiagnoseError> {
        let near = self.fit_without(block, id, settings);
        let mut parts = self.parts.clone();
        let model = at_approximations(&without_effect(&self.fit, id, &mut parts));
        let anew = fit(block, &model, None, &settings.options).map_err(DiagnoseError::from);
        match (near, anew.and_then(|anew| self.settle(block, anew, &parts, settings))) {
            (Ok((near, _)), Ok(anew)) if anew.chi_square() < near.chi_square() - SAME_MINIMUM => Ok((anew, parts)),
            (Err(_), Ok(anew)) => Ok((anew, parts)),
            (near, _) => near,
        }
    }

    /// Takes out a law of the lens that the others explain. To first order the camera would have to go far with what leaves; where two such laws are
    /// in, only a refit tells what is left without one of them. Did one go?
    ///
    /// # Errors
    /// A wish to stop; a fit that predicts nothing.
    pub fn let_go_what_no_refit_needs(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        let situation = self.situation(linearised, settings);
        let laws: Vec<&Taken> = situation.taken.iter().filter(|taken| linearised.is_of_lens(taken.set)).collect();
        if laws.len() < 2 {
            return Ok(false);
        }
        let mut least: Option<(f64, &String, (Fit, Added))> = None;
        for taken in laws.into_iter().filter(|taken| taken.removable) {
            let id = &situation.sets[taken.set].id;
            (settings.tell)(&format!("adjusting without {id}"));
            let without = situation.without(id);
            let beside = without.beside();
            let refitted = match self.lowest_without(block, id, settings) {
                Ok(refitted) => refitted,
                Err(error) if settings.options.stop.is_raised() => return Err(error),
                // What no fit can do without stays.
                Err(_) => continue,
            };
            let Some(judged) = without.judge(taken.set, &beside) else { continue };
            let share = (refitted.0.chi_square() - self.fit.chi_square()) / judged.drop;
            let ln_p = without.ln_p_of_share(&judged, &beside, share.max(0.0));
            if ln_p > situation.ln_level && least.as_ref().is_none_or(|(other, ..)| ln_p > *other) {
                least = Some((ln_p, id, refitted));
            }
        }
        let Some((ln_p, id, without)) = least else { return Ok(false) };
        let why = format!("a refit without it leaves no more than chance ({})", probability(ln_p));
        self.leave(block, id, &why, without, settings)?;
        Ok(true)
    }

    /// Takes an effect out again. Where no fit without it succeeds, all is as it was.
    ///
    /// # Errors
    /// A refit that fails.
    fn take_out(&mut self, block: &Block, id: &str, why: &str, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let without = self.fit_without(block, id, settings)?;
        self.leave(block, id, why, without, settings)
    }

    /// Goes on with the fit without an effect.
    fn leave(
        &mut self,
        block: &Block,
        id: &str,
        why: &str,
        (after, parts): (Fit, Added),
        settings: &Settings<'_>,
    ) -> Result<(), DiagnoseError> {
        (settings.tell)(&format!("taking {id} out: {why}"));
        let drop = self.fit.chi_square() - after.chi_square();
        self.heldout_px = held_out_px(&after, settings.options.threads)?;
        (self.fit, self.parts) = (after, parts);
        self.places.clear();
        self.added.retain(|other| other != id);
        // What was taken out twice does not come back: two that take each other's place would go on for ever.
        if !self.left_before.insert(id.to_string()) {
            self.refused.insert(id.to_string());
        }
        self.note(block, Change::Removed(id.to_string()), why)?;
        if let Some(step) = self.steps.last_mut() {
            step.drop = drop;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::linearised::linearise;
    use super::*;
    use crate::adjust::Options;
    use crate::model::Model;
    use crate::scenario::{Scenario, add_noise, simulate};
    use std::collections::BTreeMap;

    /// Options whose fits take at most so many iterations.
    fn settings(max_iterations: usize) -> Settings<'static> {
        let options = Options { threads: 1, max_iterations, ..Options::default() };
        Settings { plugins: &[], options, significance: 0.05, snoop: false, tell: &|_| {} }
    }

    #[test]
    fn what_no_fit_can_do_without_stays_and_ends_nothing() {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        add_noise(&mut block, 0.3, 1).expect("noise");
        let many = settings(50);
        let base = fit(&block, &Model::default(), None, &many.options).expect("a fit");
        let mut improvement = Improvement::new(&block, base, &many).expect("a base");
        let places = Default::default();
        let of_base = linearise(&block, &improvement.fit, &improvement.parts, false, &places, &many).expect("linear");
        improvement.add(&block, &of_base, "radial-high", &many).expect("a refit").expect("it can be taken in");

        let none = settings(0);
        let mut first = None;
        improvement.advance(&block, &none, &mut first, false).expect("a removal that fails is no error");
        assert_eq!(improvement.added, ["radial-high"]);
        let reason = &improvement.confirmations[0].reason;
        assert!(reason.starts_with("radial-high stays, for without it: native: not converged"), "{reason}");

        improvement.staying.clear();
        improvement.advance(&block, &many, &mut first, false).expect("a removal");
        assert!(improvement.added.is_empty(), "nothing asks for it: it goes where a fit can follow");
    }
}
