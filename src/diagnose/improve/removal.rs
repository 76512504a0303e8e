//! Taking out what was taken in: as a rule asks, as a structure asks that it could be, as somebody asks.

use super::super::fit::{DiagnoseError, fit};
use super::super::heldout::held_out_px;
use super::super::linearised::Linearised;
use super::super::models::{with_search_held, without_effect};
use super::super::select::Event;
use super::super::select::challenge::{self, Shape};
use super::super::settings::Settings;
use super::{Change, Improvement};
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
        linearised: &Linearised,
        structures: &[Shape],
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        let situation = self.situation(linearised, settings);
        let event = linearised.null.pool().install(|| challenge::rule(&situation, structures));
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

    /// Takes an effect out again. Where no fit without it succeeds, all is as it was.
    ///
    /// # Errors
    /// A refit that fails.
    fn take_out(&mut self, block: &Block, id: &str, why: &str, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        (settings.tell)(&format!("taking {id} out: {why}"));
        let mut parts = self.parts.clone();
        let model = without_effect(&self.fit, id, &mut parts);
        let before = self.fit.chi_square();
        // What has a place on the sensor keeps it until the rest has settled: at a state so far from the solution the place follows anything.
        let held = with_search_held(&model).and_then(|held| fit(block, &held, Some(&self.fit), &settings.options).ok());
        let near = held.as_ref().unwrap_or(&self.fit);
        let after = fit(block, &model, Some(near), &settings.options)?;
        let after = self.settle(block, after, &parts, settings)?;
        self.heldout_px = held_out_px(&after, settings.options.threads)?;
        (self.fit, self.parts) = (after, parts);
        self.places.clear();
        self.added.retain(|other| other != id);
        // What was taken out twice does not come back: two that take each other's place would go on for ever.
        if !self.left_before.insert(id.to_string()) {
            self.refused.insert(id.to_string());
        }
        let drop = before - self.fit.chi_square();
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
