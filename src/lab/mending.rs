//! A step that undoes mistakes of people: its block is the edited one, and its adjustment begins anew with the model
//! of the step above.

use super::live::{Changed, Live};
use super::screened::in_words;
use super::setup::Source;
use super::step::Step;
use crate::block::mended::mended;
use crate::block::{Block, Measurement};
use crate::diagnose::added::Added;
use crate::diagnose::improvement::Improvement;
use crate::diagnose::models::at_solution;
use crate::diagnose::run::{Base, base};
use crate::diagnose::settings::Settings;
use crate::mistakes::{MOST_MENDS, Mistake, mending_stopped};
use crate::model::Model;
use crate::run::folder::OutlierRow;
use crate::run::set_aside::{self, MARK, TIE};
use crate::screening;
use anyhow::{Result, anyhow, bail};
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

impl Step<'_> {
    /// The block of the step above without mistakes of the kinds `only` (none: of all kinds), and the model on it.
    pub(super) fn mended(&self, parent: u32, from: &Live, only: &[String], settings: &Settings<'_>) -> Result<Changed> {
        let source = undone(&*self.lab.source(parent)?, only, |block| self.mistakes(block, settings))?;
        source.undone.iter().for_each(|mistake| (settings.tell)(&format!("undone: {}", mistake.sentence)));
        if source.mistakes.iter().any(|mistake| is_wanted(mistake, only)) {
            (settings.tell)(&mending_stopped());
        }
        let chosen = Model { datum: self.lab.chosen_datum(parent)?, ..at_solution(from.fit()) };
        self.begun(source, self.fixed(from), &chosen, Some(from.improvement.parts.clone()), settings)
    }

    /// What is recorded wrongly in a block: the screening of `check` and `diagnose`.
    pub(super) fn mistakes(&self, block: &Block, settings: &Settings<'_>) -> Result<Vec<Mistake>> {
        (settings.tell)("holding the survey against the shape that the images give");
        let found = screening::mistakes(block, &self.lab.setup.model, settings.significance, &settings.options);
        if settings.options.stop.is_raised() {
            bail!("cancelled");
        }
        Ok(found)
    }

    /// Begins with a block: fits `chosen` to it without what is recorded wrongly, without `fixed` and without what
    /// stands alone. `parts`: of a model that effects were added to.
    pub(super) fn begun(
        &self,
        source: Source,
        fixed: Vec<OutlierRow>,
        chosen: &Model,
        parts: Option<Added>,
        settings: &Settings<'_>,
    ) -> Result<Changed> {
        let source = self.lab.hold(self.id, source);
        let model = source.possible(chosen);
        let fixed = still_there(&source.block, fixed);
        let begin = || -> Result<Changed> {
            let whole = set_aside::without(&source.block, &fixed, Path::new("outliers.csv"))?;
            let found = base(&whole, &model, settings)?;
            // What is missing can make a survey look imprecise: the weights are a step of their own.
            let Base { search, fit, .. } = found.at_least_as_stated(&whole, &model, settings)?.unwrap_or(found);
            let block = search.block(&whole).into_owned();
            let improvement = match parts {
                Some(parts) => Improvement::with(&block, fit, parts, settings)?,
                None => Improvement::new(&block, fit, settings)?,
            };
            let found = search.outliers(&whole).rows(&whole);
            Ok(Changed { block, set_aside: fixed.iter().cloned().chain(found).collect(), improvement })
        };
        // An adjustment that failed says nothing of its reason; a mistake may be it.
        begin().map_err(|error| match in_words(&source.mistakes) {
            Some(words) if !self.stop.is_raised() => error.context(words),
            _ => error,
        })
    }
}

/// The block of `above` without mistakes of the kinds `only`, screened anew by `screen`.
///
/// # Errors
/// A kind that cannot be undone there.
fn undone(above: &Source, only: &[String], screen: impl Fn(&Block) -> Result<Vec<Mistake>>) -> Result<Source> {
    let can_be = |mistake: &Mistake| !mistake.mend.is_empty();
    let named = |kind: &&String| above.mistakes.iter().any(|mistake| can_be(mistake) && mistake.kind == **kind);
    if let Some(kind) = only.iter().find(|kind| !named(kind)) {
        bail!("no mistake of the kind {kind:?} can be undone here");
    }
    if !above.mistakes.iter().any(can_be) {
        bail!("no mistake was found here that can be undone");
    }
    let (mut recorded, mut mistakes) = (above.recorded.clone(), above.mistakes.clone());
    let mut undone: Vec<Mistake> = Vec::new();
    for _ in 0..MOST_MENDS {
        let now: Vec<Mistake> = mistakes.iter().filter(|mistake| is_wanted(mistake, only)).cloned().collect();
        if now.is_empty() {
            break;
        }
        let edits: Vec<_> = now.iter().flat_map(|mistake| mistake.mend.clone()).collect();
        let block = mended(&recorded, &edits)
            .map_err(|edit| anyhow!("{}: this cannot be undone here; `misclosure mend` can", edit.file))?;
        recorded = Arc::new(block);
        undone.extend(now);
        mistakes = screen(&recorded)?;
    }
    Ok(Source::screened(above.path.clone(), recorded, mistakes).with_undone(undone))
}

/// Can a mistake be undone, and is it to be? `only`: kinds, none: all.
fn is_wanted(mistake: &Mistake, only: &[String]) -> bool {
    !mistake.mend.is_empty() && (only.is_empty() || only.contains(&mistake.kind))
}

/// Those of `rows` that the block has: measurements that stood in it twice may be gone.
fn still_there(block: &Block, rows: Vec<OutlierRow>) -> Vec<OutlierRow> {
    if rows.is_empty() {
        return rows;
    }
    let image = |row: &Measurement| block.images[row.image.index()].name.as_str();
    let ties = block.ties.iter().map(|row| (TIE, image(row), block.tie_points[row.point.index()].name.as_str()));
    let marks = block.marks.iter().map(|row| (MARK, image(row), block.surveyed[row.point.index()].name.as_str()));
    let known: HashSet<(&str, &str, &str)> = ties.chain(marks).collect();
    let is_known = |row: &OutlierRow| known.contains(&(row.kind.as_str(), row.image.as_str(), row.point.as_str()));
    rows.into_iter().filter(is_known).collect()
}
