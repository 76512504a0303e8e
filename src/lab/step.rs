//! Carries out a change: fits the changed model from where its parent ended, looks at what it leaves, adjusts it with both solvers, and writes the
//! folder of the run.

use super::change::{Change, Named};
use super::events::Event;
use super::predicted::Predicted;
use super::state::{Lab, Source};
use super::tree::{Figures, Saved};
use crate::adjust::Stop;
use crate::adjust::agreement::Agreement;
use crate::block::Block;
use crate::diagnose::fit::{Fit, HandedOn, adjust_handed_on, fit};
use crate::diagnose::improve::{Improvement, Settings};
use crate::diagnose::linearised::{Added, Linearised};
use crate::diagnose::look::{Look, look};
use crate::diagnose::models::at_solution;
use crate::diagnose::outliers::{Snooping, Strictness};
use crate::diagnose::pictures::Shown;
use crate::diagnose::run::{base, settle};
use crate::diagnose::select::Event as Asked;
use crate::diagnose::verdict::{Diagnosis, LedgerRow};
use crate::io::model::read_model;
use crate::model::EffectTerm;
use crate::report::run::{Diagnosed, RunFolder};
use crate::run::folder::{OutlierRow, read_outliers};
use crate::run::{self, set_aside};
use anyhow::{Result, bail};
use std::collections::{HashMap, HashSet};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Reason of what somebody set aside.
const BY_HAND: &str = "set aside by hand";
/// Levels of the ledger's rows that are no effect in or out.
const NO_TEST: f64 = 1.0;

/// A node with everything that the next step, and a prediction, go on from.
pub struct Live {
    /// The block without what is set aside.
    pub block: Block,
    /// What is set aside.
    pub set_aside: Vec<OutlierRow>,
    /// The fit, and how it came about.
    pub improvement: Improvement,
    /// The fit with every candidate beside it.
    pub linearised: Linearised,
    /// What the rules ask for next.
    pub next: Option<Asked>,
    /// One row per step from the root.
    pub ledger: Vec<LedgerRow>,
    /// Predictions that were asked for.
    pub predicted: Mutex<HashMap<String, Arc<Predicted>>>,
}

impl Live {
    fn new(changed: Changed, look: Look, ledger: Vec<LedgerRow>) -> Self {
        let Changed { block, set_aside, improvement } = changed;
        let Look { linearised, next, .. } = look;
        Self { block, set_aside, improvement, linearised, next, ledger, predicted: Mutex::default() }
    }

    /// Takes up a node from its folder.
    ///
    /// # Errors
    /// A folder that cannot be read; a fit that does not converge any more.
    pub fn restore(lab: &Lab, id: u32, saved: &Saved) -> Result<Self> {
        let dir = lab.setup.folder.step(id);
        let source = lab.source(id)?;
        let (file, set_aside) = read_outliers(&dir)?.unwrap_or_else(|| (dir.join("outliers.csv"), Vec::new()));
        let block = set_aside::without(&source.block, &set_aside, &file)?;
        let model = read_model(&dir.join("model.toml"), &|id| lab.effect(id))?;
        let stop = Stop::default();
        let settings = lab.settings(&stop, false, &|_| {});
        let fitted = fit(&block, &model, None, &settings.options)?;
        let parts = Added { own: saved.own, freed: saved.freed.clone(), placed: saved.placed.clone() };
        let improvement = Improvement::with(&block, fitted, parts, &settings)?;
        let look = look(&block, &improvement, set_aside.len(), &settings)?;
        let ledger = RunFolder::read(&dir)?.diagnosis.map_or(Vec::new(), |diagnosis| diagnosis.ledger);
        Ok(Self::new(Changed { block, set_aside, improvement }, look, ledger))
    }

    /// The fit.
    pub fn fit(&self) -> &Fit {
        &self.improvement.fit
    }
}

/// What a change makes of a node before anybody looks at it.
struct Changed {
    block: Block,
    set_aside: Vec<OutlierRow>,
    improvement: Improvement,
}

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
        let handed_on = self.adjusted(&changed, &settings)?;
        if let Some(held) = &handed_on.held {
            tell(held);
        }
        let figures = figures(&changed, &handed_on)?;
        lab.solved(id, figures.clone());
        self.go_on()?;
        let mut look = look(&changed.block, &changed.improvement, changed.set_aside.len(), &settings)?;
        self.go_on()?;
        self.enter_ledger(&mut ledger, &mut look.diagnosis, &handed_on);
        look.diagnosis.weigh(handed_on.run.point_sigma_m(), None);
        lab.tell(Event::told(id, "writing", "writing the folder of the run"));
        let saved = self.saved(figures, &changed, &look.diagnosis, &handed_on);
        lab.setup.folder.add(id, &saved, |dir| self.write(dir, &source, &changed, &look, &handed_on))?;
        Ok((saved, Live::new(changed, look, ledger)))
    }

    /// # Errors
    /// Somebody does not want it any more.
    fn go_on(&self) -> Result<()> {
        if self.stop.is_raised() { bail!("cancelled") } else { Ok(()) }
    }

    fn root(&self, settings: &Settings<'_>) -> Result<Changed> {
        let Self { lab, id, change, .. } = *self;
        if let (Change::Simulate { errors, seed }, Some(simulated)) = (change, &lab.setup.simulated) {
            (settings.tell)("measuring the block anew");
            simulated.measure(errors, *seed, &lab.setup.folder.measured(id))?;
        }
        let source = lab.source(id)?;
        let given = lab.setup.set_aside.clone();
        let whole = set_aside::without(&source.block, &given, Path::new("outliers.csv"))?;
        let (search, fitted) = base(&whole, &lab.setup.model, settings)?;
        let block = search.block(&whole);
        let improvement = Improvement::new(&block, fitted, settings)?;
        let found = search.outliers(&whole).rows(&whole);
        Ok(Changed { block, set_aside: given.into_iter().chain(found).collect(), improvement })
    }

    fn changed(&self, parent: u32, from: &Live, settings: &Settings<'_>) -> Result<Changed> {
        let Self { lab, change, .. } = *self;
        let Live { block, set_aside, .. } = from;
        let mut improvement = from.improvement.clone();
        let same = |improvement| Changed { block: block.clone(), set_aside: set_aside.clone(), improvement };
        if let Some(model) = change.of_settings(&at_solution(from.fit())).map_err(anyhow::Error::msg)? {
            (settings.tell)("fitting the changed model");
            let fitted = fit(block, &model, Some(from.fit()), &settings.options)?;
            let mut parts = improvement.parts.clone();
            if matches!(change, Change::Free { .. }) {
                parts.freed.clear();
            }
            return Ok(same(Improvement::with(block, fitted, parts, settings)?));
        }
        match change {
            Change::Add { effect, values } if values.is_empty() => {
                let added = improvement.add(block, &from.linearised, effect, settings)?;
                added.map_err(anyhow::Error::msg)?;
                Ok(same(improvement))
            }
            Change::Add { effect, values } => {
                let mut model = at_solution(from.fit());
                let of_catalogue = lab.effect(effect);
                let Some(found) = of_catalogue else { bail!("there is no effect {effect:?} in the catalogue") };
                if model.effects.iter().any(|term| term.effect.descriptor().id == *effect) {
                    bail!("{effect} is in the model already");
                }
                if let Some(key) = values.keys().find(|key| found.parameter_of(key).is_none()) {
                    bail!("{effect} has no parameter {key:?}");
                }
                model.effects.push(EffectTerm { effect: found, values: values.clone(), held: Vec::new() });
                let fitted = fit(block, &model, Some(from.fit()), &settings.options)?;
                Ok(same(Improvement::with(block, fitted, improvement.parts.clone(), settings)?))
            }
            Change::Remove { effect } => {
                let model = &from.fit().model;
                let at = model.effects.iter().position(|term| term.effect.descriptor().id == *effect);
                match at {
                    Some(at) if at < improvement.parts.own => {
                        let mut model = at_solution(from.fit());
                        model.effects.remove(at);
                        let fitted = fit(block, &model, Some(from.fit()), &settings.options)?;
                        let mut parts = improvement.parts.clone();
                        parts.own -= 1;
                        improvement = Improvement::with(block, fitted, parts, settings)?;
                    }
                    None if !improvement.parts.freed.contains_key(effect) => {
                        bail!("{effect} is not in the model of step {parent}")
                    }
                    _ => improvement.remove(block, effect, settings)?,
                }
                Ok(same(improvement))
            }
            Change::EstimateWeights => {
                let before = improvement.fit.model.sigma_factors;
                improvement.weigh(block, settings)?;
                if improvement.fit.model.sigma_factors == before {
                    bail!("the residuals ask for no other weights");
                }
                Ok(same(improvement))
            }
            Change::SetAside { measurements } => self.set_aside(from, measurements.clone(), settings),
            Change::SetAsideBrush { brush } => {
                let view = lab.view(parent)?;
                let whole = &lab.source(parent)?.block;
                let chosen = brush.members(&view.columns);
                let all = (0..chosen.len()).filter(|k| chosen[*k]);
                let chosen: Vec<Named> = all.map(|k| super::about::named(whole, &view.columns, k)).collect();
                if chosen.is_empty() {
                    bail!("the brush holds no measurement");
                }
                self.set_aside(from, chosen, settings)
            }
            Change::TakeBack { measurements } => {
                let back: HashSet<&Named> = measurements.iter().collect();
                let named = |row: &OutlierRow| Named {
                    image: row.image.clone(),
                    point: row.point.clone(),
                    kind: row.kind.clone(),
                };
                let mut rows = set_aside.clone();
                rows.retain(|row| !back.contains(&named(row)));
                if rows.len() + back.len() != set_aside.len() {
                    let strange = measurements.iter().find(|own| !set_aside.iter().any(|row| named(row) == **own));
                    let strange = strange.map_or(String::new(), |own| format!("{} in {}", own.point, own.image));
                    bail!("not set aside, so it cannot be taken back: {strange}");
                }
                self.on_other_measurements(from, rows, settings)
            }
            Change::SearchOutliers => self.searched(from, settings),
            other => bail!("{}: this cannot be asked of a step", other.words()),
        }
    }

    fn set_aside(&self, from: &Live, measurements: Vec<Named>, settings: &Settings<'_>) -> Result<Changed> {
        let source = self.lab.source(self.id)?;
        super::about::all_there(&source.block, &measurements).map_err(anyhow::Error::msg)?;
        let is_aside = |own: &&Named| {
            let same = |row: &OutlierRow| row.image == own.image && row.point == own.point && row.kind == own.kind;
            from.set_aside.iter().any(same)
        };
        if let Some(Named { image, point, kind }) = measurements.iter().find(is_aside) {
            bail!("the {kind} of point {point:?} in image {image:?} is set aside already");
        }
        let row =
            |own: Named| OutlierRow { image: own.image, point: own.point, kind: own.kind, reason: BY_HAND.into() };
        let rows = from.set_aside.iter().cloned().chain(measurements.into_iter().map(row)).collect();
        self.on_other_measurements(from, rows, settings)
    }

    fn on_other_measurements(&self, from: &Live, rows: Vec<OutlierRow>, settings: &Settings<'_>) -> Result<Changed> {
        let source = self.lab.source(self.id)?;
        let block = set_aside::without(&source.block, &rows, Path::new("outliers.csv"))?;
        (settings.tell)("fitting without what is set aside");
        let fitted = fit(&block, &at_solution(from.fit()), Some(from.fit()), &settings.options)?;
        let improvement = Improvement::with(&block, fitted, from.improvement.parts.clone(), settings)?;
        Ok(Changed { block, set_aside: rows, improvement })
    }

    /// Data snooping at the model as it stands, beside what somebody set aside.
    fn searched(&self, from: &Live, settings: &Settings<'_>) -> Result<Changed> {
        let source = self.lab.source(self.id)?;
        let given = &self.lab.setup.set_aside;
        let fixed = from.set_aside.iter().filter(|row| row.reason == BY_HAND || given.contains(row));
        let fixed: Vec<OutlierRow> = fixed.cloned().collect();
        let whole = set_aside::without(&source.block, &fixed, Path::new("outliers.csv"))?;
        let model = at_solution(from.fit());
        let strictness = if from.improvement.added.is_empty() { Strictness::Loose } else { Strictness::Tight };
        let settings = Settings { snoop: true, options: settings.options.clone(), ..*settings };
        (settings.tell)("searching outliers");
        let mut search = Snooping::new(&whole, &model);
        let fitted = settle(&whole, &mut search, &model, Some(from.fit()), strictness, &settings)?;
        let rows: Vec<OutlierRow> = fixed.into_iter().chain(search.outliers(&whole).rows(&whole)).collect();
        let key = |row: &OutlierRow| (row.kind.clone(), row.image.clone(), row.point.clone());
        let of = |rows: &[OutlierRow]| rows.iter().map(key).collect::<HashSet<_>>();
        if of(&rows) == of(&from.set_aside) {
            bail!("nothing else stands alone, and nothing comes back");
        }
        let block = search.block(&whole);
        let improvement = Improvement::with(&block, fitted, from.improvement.parts.clone(), &settings)?;
        Ok(Changed { block, set_aside: rows, improvement })
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
            row.solvers_agree = handed_on.run.agreement.as_ref().map(|agreement| agreement.agree);
            let found = handed_on.run.agreement.as_ref();
            row.one_derivation = found.map(|agreement| agreement.one_derivation.clone()).unwrap_or_default();
            if self.parent.is_some() && !matches!(self.change, Change::Add { .. } | Change::Remove { .. }) {
                row.added = Some(format!("({})", self.change.words()));
                row.p_value = NO_TEST;
            }
            ledger.push(row);
        }
        diagnosis.ledger = ledger.clone();
    }

    fn saved(&self, figures: Figures, changed: &Changed, diagnosis: &Diagnosis, handed_on: &HandedOn) -> Saved {
        let parts = &changed.improvement.parts;
        Saved {
            format: Saved::FORMAT,
            parent: self.parent,
            change: self.change.clone(),
            words: self.change.words(),
            figures,
            verdict: super::change::name(&diagnosis.verdict),
            agree: handed_on.run.agreement.as_ref().map(|agreement| agreement.agree),
            one_derivation: handed_on.run.agreement.as_ref().and_then(Agreement::not_independent),
            own: parts.own,
            freed: parts.freed.clone(),
            placed: parts.placed.clone(),
        }
    }

    fn write(&self, dir: &Path, source: &Source, changed: &Changed, look: &Look, handed_on: &HandedOn) -> Result<()> {
        let Changed { block, set_aside, improvement } = changed;
        let added = &improvement.added;
        let shown = Shown { block, fit: &improvement.fit, added, before: None, after: &look.left.structure };
        Diagnosed {
            source: &source.path,
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

fn figures(changed: &Changed, handed_on: &HandedOn) -> Result<Figures> {
    let run = &handed_on.run;
    let known = |value: f64| Some(value).filter(|value| value.is_finite());
    let check = run.comparison.as_ref().and_then(|comparison| comparison.check.as_ref());
    let (observations, unknowns, _) = run.problem.redundancy();
    Ok(Figures {
        tie_rms_px: known(run::tie_rms_px(&changed.block, &run.problem, &run.solution().state)?),
        heldout_px: known(changed.improvement.heldout_px),
        check_rms_m: check.map(|check| check.rms_m.xyz),
        check_height_rms_m: check.map(|check| check.rms_m.z),
        sigma0: known(run.sigma0()),
        unknowns,
        observations,
        outliers: changed.set_aside.len(),
    })
}
