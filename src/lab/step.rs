//! Carries out a change: fits the changed model from where its parent ended, looks at what it leaves, adjusts it with
//! both solvers, and writes the folder of the run.

use super::change::Change;
use super::events::Event;
use super::live::{Changed, Live};
use super::screened::in_words;
use super::setup::Source;
use super::state::Lab;
use super::tree::{Figures, Saved};
use crate::adjust::Stop;
use crate::adjust::agreement::Agreement;
use crate::diagnose::handed_on::{HandedOn, adjust_handed_on};
use crate::diagnose::look::{Look, look};
use crate::diagnose::models::at_solution;
use crate::diagnose::pictures::Shown;
use crate::diagnose::settings::Settings;
use crate::diagnose::verdict::{Diagnosis, LedgerRow};
use crate::mistakes::Mistake;
use crate::report::headline::of_effects;
use crate::report::run::Diagnosed;
use crate::run::fit::Fit;
use crate::run::{self, Run, gnss_residuals, gnss_rms_m};
use anyhow::{Result, bail};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// Levels of the ledger's rows that are no effect in or out.
const NO_TEST: f64 = 1.0;

/// A step that is asked for.
pub struct Step<'a> {
    /// The laboratory.
    pub lab: &'a Lab,
    /// Its number.
    pub id: u32,
    /// What it changes.
    pub parent: Option<u32>,
    /// How.
    pub change: &'a Change,
    /// Ends it.
    pub stop: &'a Stop,
}

impl Step<'_> {
    /// Carries it out.
    ///
    /// # Errors
    /// Why it cannot be, in words; nothing is left of it then.
    pub fn run(&self) -> Result<(Saved, Live)> {
        let Self { lab, id, parent, stop, .. } = *self;
        let began = Instant::now();
        let tell = |what: &str| lab.tell(Event::told(id, "diagnosing", what));
        let settings = lab.settings(stop, lab.setup.snoop, &tell);
        let (changed, mut ledger) = match parent {
            None => (self.root(&settings)?, Vec::new()),
            Some(parent) => {
                let from = lab.live(parent)?;
                (self.changed(parent, &from, &settings)?, from.ledger.clone())
            }
        };
        self.go_on()?;
        let source = lab.source(id)?;
        let mut handed_on = self.adjusted(&changed, &settings)?;
        if let Some(held) = &handed_on.held {
            tell(held);
        }
        let figures = figures(&changed, &handed_on)?;
        lab.solved(id, figures.clone());
        self.go_on()?;
        let mut look = look(&changed.block, &changed.improvement, changed.set_aside.len(), &settings)?;
        self.go_on()?;
        self.enter_ledger(&mut ledger, &mut look.diagnosis, &handed_on);
        let lost = match look.next {
            None => self.lost(&source, &changed, settings.significance),
            Some(_) => Vec::new(),
        };
        source.judge(&mut look.diagnosis, lost);
        look.diagnosis.moved = self.moved(&changed)?;
        look.diagnosis.complete(&mut handed_on.run, None);
        lab.tell(Event::told(id, "writing", "writing the folder of the run"));
        let seconds = began.elapsed().as_secs_f64();
        let saved = self.saved(seconds, figures, &source, &changed, &look.diagnosis, &handed_on);
        lab.setup.folder.add(id, &saved, |dir| self.write(dir, &source, &changed, &look, &handed_on))?;
        Ok((saved, Live::new(changed, look, ledger)))
    }

    /// # Errors
    /// Somebody does not want it any more.
    fn go_on(&self) -> Result<()> {
        if self.stop.is_raised() { bail!("cancelled") } else { Ok(()) }
    }

    fn adjusted(&self, changed: &Changed, settings: &Settings<'_>) -> Result<HandedOn> {
        let Self { lab, id, stop, .. } = *self;
        let mut progress = |solver: &'static str, at: &crate::adjust::Iteration| {
            lab.tell(Event::Progress {
                node: id,
                phase: "solving",
                text: None,
                solver: Some(solver),
                iteration: Some(at.number),
                cost: Some(at.cost),
            });
            if stop.is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let ended = changed.improvement.fit.clone();
        let ended = Fit { model: at_solution(&ended), ..ended };
        Ok(adjust_handed_on(&changed.block, &ended, &lab.setup.solvers, &settings.options, &mut progress)?)
    }

    /// The row of this step behind those of its parents.
    fn enter_ledger(&self, ledger: &mut Vec<LedgerRow>, diagnosis: &mut Diagnosis, handed_on: &HandedOn) {
        if let Some(mut row) = diagnosis.ledger.pop() {
            row.step = ledger.len();
            row.adjusted_by_both(&handed_on.run);
            if self.parent.is_some() && !matches!(self.change, Change::Add { .. } | Change::Remove { .. }) {
                row.added = Some(format!("({})", self.change.words()));
                row.p_value = NO_TEST;
            }
            ledger.push(row);
        }
        diagnosis.ledger = ledger.clone();
    }

    fn saved(
        &self,
        seconds: f64,
        figures: Figures,
        source: &Source,
        changed: &Changed,
        diagnosis: &Diagnosis,
        handed_on: &HandedOn,
    ) -> Saved {
        let parts = &changed.improvement.parts;
        // The others have the block of a step above.
        let of_block = |list: &[Mistake]| if self.change.has_block() { list.to_vec() } else { Vec::new() };
        Saved {
            format: Saved::FORMAT,
            parent: self.parent,
            change: self.change.clone(),
            words: self.change.words(),
            figures,
            verdict: super::change::name(&diagnosis.verdict),
            seconds: Some(seconds),
            agree: handed_on.run.agreement.as_ref().map(|agreement| agreement.agree),
            one_derivation: handed_on.run.agreement.as_ref().and_then(Agreement::not_independent),
            own: parts.own,
            freed: parts.freed.clone(),
            placed: parts.placed.clone(),
            moved: of_effects(diagnosis, handed_on.run.has_scale(), check_points(&handed_on.run)),
            mistake: in_words(&diagnosis.mistakes),
            mistakes: of_block(&source.mistakes),
            undone: of_block(&source.undone),
        }
    }

    fn write(&self, dir: &Path, source: &Source, changed: &Changed, look: &Look, handed_on: &HandedOn) -> Result<()> {
        let Changed { block, set_aside, improvement } = changed;
        let added = &improvement.added;
        let after = &look.left.structure;
        let shown = Shown { block, base: None, fit: &improvement.fit, added, before: None, after };
        Diagnosed {
            source: Some(&source.path),
            block,
            model: &handed_on.model,
            run: &handed_on.run,
            outliers: set_aside.clone(),
            diagnosis: &look.diagnosis,
            shown,
        }
        .write(dir)
    }
}

/// The number of check points that a run compares.
fn check_points(run: &Run) -> Option<usize> {
    run.comparison.as_ref()?.check.as_ref().map(|check| check.n)
}

fn figures(changed: &Changed, handed_on: &HandedOn) -> Result<Figures> {
    let run = &handed_on.run;
    let known = |value: f64| Some(value).filter(|value| value.is_finite());
    let check = run.comparison.as_ref().and_then(|comparison| comparison.check.as_ref());
    let (observations, unknowns, _) = run.problem.redundancy();
    let gnss = gnss_residuals(&changed.block, &run.problem, &run.solution().state, run.comparison.as_ref())?;
    Ok(Figures {
        tie_rms_px: known(run::tie_rms_px(&changed.block, &run.problem, &run.solution().state)?),
        heldout_px: known(changed.improvement.heldout_px),
        check_rms_m: check.map(|check| check.rms_m.xyz),
        check_height_rms_m: check.map(|check| check.rms_m.z),
        gnss_rms_m: gnss_rms_m(&gnss),
        sigma0: known(run.sigma0()),
        unknowns,
        observations,
        outliers: changed.set_aside.len(),
    })
}
