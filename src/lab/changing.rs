//! What a change makes of a node before anybody looks at it: the changed model, fitted from where its parent ended.

use super::change::{Change, Named};
use super::live::{Changed, Live};
use super::measurements::{all_there, named};
use super::setup::Source;
use super::step::Step;
use crate::diagnose::improvement::Improvement;
use crate::diagnose::models::at_solution;
use crate::diagnose::settings::Settings;
use crate::model::{EffectTerm, Model};
use crate::run::fit::fit;
use crate::run::folder::OutlierRow;
use crate::run::set_aside;
use crate::snooping::settle::{Settling, settle};
use crate::snooping::{Snooping, Strictness};
use anyhow::{Result, bail};
use std::collections::HashSet;
use std::path::Path;

/// Reason of what somebody set aside.
const BY_HAND: &str = "set aside by hand";

impl Step<'_> {
    pub(super) fn root(&self, settings: &Settings<'_>) -> Result<Changed> {
        let Self { lab, id, change, .. } = *self;
        if let (Change::Simulate { errors, seed }, Some(simulated)) = (change, &lab.setup.simulated) {
            (settings.tell)("measuring the block again");
            simulated.measure(errors, *seed, &lab.setup.folder.measured(id))?;
        }
        let (path, recorded) = lab.recorded(id)?;
        let mistakes = self.mistakes(&recorded, settings)?;
        mistakes.iter().for_each(|mistake| (settings.tell)(&mistake.sentence));
        let source = Source::screened(path, recorded, mistakes);
        self.begun(source, lab.setup.set_aside.clone(), &lab.setup.model, None, settings)
    }

    /// Did somebody set the measurement aside, by hand or before?
    pub(super) fn is_fixed(&self, row: &OutlierRow) -> bool {
        row.reason == BY_HAND || self.lab.setup.set_aside.contains(row)
    }

    /// What somebody set aside at a node, by hand or before.
    pub(super) fn fixed(&self, from: &Live) -> Vec<OutlierRow> {
        from.set_aside.iter().filter(|row| self.is_fixed(row)).cloned().collect()
    }

    pub(super) fn changed(&self, parent: u32, from: &Live, settings: &Settings<'_>) -> Result<Changed> {
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
                    _ => improvement.remove(block, &from.linearised, effect, settings)?,
                }
                Ok(same(improvement))
            }
            Change::EstimateWeights => {
                let factors = |model: &Model| (model.sigma_factors, model.flight_factors.clone());
                let before = factors(&improvement.fit.model);
                improvement.weigh(block, settings)?;
                if factors(&improvement.fit.model) == before {
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
                let chosen: Vec<Named> = all.map(|k| named(whole, &view.columns, k)).collect();
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
            Change::Mend { only } => self.mended(parent, from, only, settings),
            other => bail!("{}: this cannot be asked of a step", other.words()),
        }
    }

    fn set_aside(&self, from: &Live, measurements: Vec<Named>, settings: &Settings<'_>) -> Result<Changed> {
        let source = self.lab.source(self.id)?;
        all_there(&source.block, &measurements).map_err(anyhow::Error::msg)?;
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
        let fixed = self.fixed(from);
        let whole = set_aside::without(&source.block, &fixed, Path::new("outliers.csv"))?;
        let model = at_solution(from.fit());
        let strictness = if from.improvement.added.is_empty() { Strictness::Loose } else { Strictness::Tight };
        (settings.tell)("searching outliers");
        let mut search = Snooping::new(&whole, &model);
        let settling = Settling { snoop: true, ..settings.settling() };
        let fitted = settle(&whole, &mut search, &model, Some(from.fit()), strictness, &settling)?;
        let rows: Vec<OutlierRow> = fixed.into_iter().chain(search.outliers(&whole).rows(&whole)).collect();
        let key = |row: &OutlierRow| (row.kind.clone(), row.image.clone(), row.point.clone());
        let of = |rows: &[OutlierRow]| rows.iter().map(key).collect::<HashSet<_>>();
        if of(&rows) == of(&from.set_aside) {
            bail!("nothing else stands alone, and nothing comes back");
        }
        let block = search.block(&whole).into_owned();
        let improvement = Improvement::with(&block, fitted, from.improvement.parts.clone(), settings)?;
        Ok(Changed { block, set_aside: rows, improvement })
    }
}
