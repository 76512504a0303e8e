//! What is true of a fresh block, by adjusting blocks without noise: how much a cause shows, what else would describe
//! it, and what the true model makes of the check points.

use crate::fresh::causes::{Cause, Term, is_random};
use crate::fresh::draw::{Drawn, Fresh};
use crate::judging::rule::{Hidden, STANDS_FOR};
use misclosure::adjust::native::Native;
use misclosure::adjust::{CovarianceOf, Options, Solver};
use misclosure::block::Block;
use misclosure::effects::{self, Kind, Role};
use misclosure::inject::recipe::Recipe;
use misclosure::model::{EffectTerm, Model};
use misclosure::run::{self, Run, RunError};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::PathBuf;
use tempfile::TempDir;

/// Part of what a cause does to the base model that its effect may leave: more, and the effect does not describe it.
const LEFT: f64 = 0.1;

/// A fresh block with the sizes of its causes.
pub struct Measured {
    /// As it was drawn.
    pub fresh: Fresh,
    scenario: PathBuf,
    parts: Vec<Part>,
    _scratch: TempDir,
}

/// A cause at its size.
struct Part {
    cause: Cause,
    factor: f64,
    /// On the block without noise that has this cause alone.
    base: f64,
    /// `base` less what the true model leaves there.
    noncentrality: f64,
    /// Factor above which its effect is larger than physics allows: no block that anybody measures has that.
    largest_factor: f64,
}

impl Measured {
    /// Scales every cause to the noncentrality that was drawn for it.
    pub fn new(fresh: Fresh) -> Self {
        let scratch = tempfile::tempdir().expect("a temporary folder");
        let scenario = scratch.path().join("scenario.toml");
        std::fs::write(&scenario, fresh.scene.text()).expect("written");
        let mut measured = Self { fresh, scenario, parts: vec![], _scratch: scratch };
        let mut drawn = measured.fresh.causes.clone();
        // What a law shows is counted beside the values by image that the block has, which hide a part of it.
        drawn.sort_by_key(|drawn| !drawn.cause.is_chance());
        for Drawn { cause, noncentrality } in drawn {
            // The drop grows with the square of the size.
            let as_drawn = measured.part(cause.clone(), 1.0);
            let factor = (noncentrality / as_drawn.noncentrality).sqrt().min(as_drawn.largest_factor);
            let part = measured.part(cause.clone(), factor);
            measured.parts.push(part);
            if let Some(companion) = cause.companion {
                let part = measured.part(*companion, 1.0);
                measured.parts.push(part);
            }
        }
        measured
    }

    fn part(&self, cause: Cause, factor: f64) -> Part {
        let block = self.exact(&cause, factor);
        let chance = self.parts.iter().filter(|part| part.cause.is_chance());
        let chance: Vec<EffectTerm> = chance.filter_map(|part| part.cause.term_of_size(part.factor)).collect();
        let with = |cause: Option<&Cause>| {
            let term = cause.and_then(|cause| cause.effect.as_ref()).map(Term::to_model);
            let run = adjust(&block, chance.iter().cloned().chain(term).collect());
            run.unwrap_or_else(|error| panic!("seed {}, {}: {error}", self.fresh.seed, cause.map_or("", Cause::name)))
        };
        let base = with(cause.companion.as_deref()).chi_square();
        // A block without noise does not determine the standard deviation of values by image: they take all.
        let all = cause.effect.is_none() || cause.is_chance();
        let true_model = (!all).then(|| with(Some(&cause)));
        let left = true_model.as_ref().map_or(0.0, Run::chi_square);
        assert!(left < LEFT * base, "seed {}: {} leaves {left:.1} of {base:.1}", self.fresh.seed, cause.text(factor));
        let largest_factor = true_model.map_or(f64::INFINITY, |run| factor * largest_growth(&run, cause.name()));
        Part { cause, factor, base, noncentrality: base - left, largest_factor }
    }

    /// The block without noise that has this cause alone, with true approximations.
    fn exact(&self, cause: &Cause, factor: f64) -> Block {
        let recipe = self.fresh.recipe(&[cause.text(factor)], &self.scenario);
        build(&with_true_start(recipe.without_random_errors()))
    }

    fn recipe(&self) -> Recipe {
        self.fresh.recipe(&self.causes(), &self.scenario)
    }

    /// What is in the block, as `inject --error` takes it.
    pub fn causes(&self) -> Vec<String> {
        // What a companion does, its outsider does already.
        let companions: Vec<&str> =
            self.parts.iter().filter_map(|part| part.cause.companion.as_ref()).map(|cause| cause.name()).collect();
        let acting = self.parts.iter().filter(|part| !companions.contains(&part.cause.name()));
        acting.map(|part| part.cause.text(part.factor)).collect()
    }

    /// As the program gets it.
    pub fn block(&self) -> Block {
        build(&self.recipe())
    }

    /// 3D RMS at the check points with all true effects, on the measurements that are no gross errors and with their
    /// true weights, mm. Which of an effect's coefficients are zero nobody can know: all are free where the block
    /// determines them.
    pub fn check_mm(&self) -> f64 {
        let block = build(&with_true_start(self.recipe().with_known_noise()));
        let effects = || self.parts.iter().filter_map(|part| part.cause.effect.as_ref());
        let all_free = |term: &Term| Term { held: term.held_places(), ..term.clone() };
        let run = adjust(&block, effects().map(|term| all_free(term).to_model()).collect())
            .or_else(|_| adjust(&block, effects().map(Term::to_model).collect()))
            .or_else(|_| adjust(&block, determined(&block, effects().map(Term::to_model).collect())))
            .unwrap_or_else(|error| panic!("seed {}: {error}", self.fresh.seed));
        let check = run.comparison.and_then(|comparison| comparison.check).expect("check points");
        1e3 * check.rms_m.xyz
    }

    /// What is hidden. Whether it stands for an effect is asked of `candidates` alone, each of which is an adjustment.
    pub fn hidden(&self, candidates: &[String]) -> Vec<Hidden> {
        let hidden = |part: &Part| {
            let name = part.cause.name();
            let outsider = part.cause.effect.is_none();
            let others = candidates.iter().filter(|id| !outsider && *id != name);
            let stand_ins: BTreeSet<String> = others.filter(|id| self.share(part, id) > STANDS_FOR).cloned().collect();
            Hidden { name: name.into(), outsider, noncentrality: part.noncentrality, stand_ins }
        };
        self.parts.iter().map(hidden).collect()
    }

    /// Share of a cause's noncentrality that an effect would take. Values by image, a place that is searched and
    /// empirical shapes take anything, and say nothing of the cause.
    fn share(&self, part: &Part, id: &str) -> f64 {
        let Some(effect) = effects::find(id) else { return 0.0 };
        let placed =
            |role: &Role| matches!(role, Role::Searched(domain) if !matches!(domain, effects::Domain::Range(..)));
        let descriptor = effect.descriptor();
        let placed = descriptor.parameters.iter().any(|parameter| placed(&parameter.role));
        if descriptor.kind != Kind::Physical || is_random(id) || placed {
            return 0.0;
        }
        let searched = descriptor.parameters.iter().filter(|p| matches!(p.role, Role::Searched(_)));
        let term = EffectTerm {
            effect: misclosure::model::EffectRef::Builtin(effect),
            values: Default::default(),
            held: searched.map(|parameter| parameter.name.to_string()).collect(),
        };
        // One that the block cannot determine stands for nothing.
        let left = adjust(&self.exact(&part.cause, part.factor), vec![term]).map_or(part.base, |run| run.chi_square());
        (part.base - left) / part.noncentrality
    }
}

/// By how much an effect may grow until one of its estimates is the largest that physics allows.
fn largest_growth(run: &Run, id: &str) -> f64 {
    let effects = &run.problem.effects;
    let entries = run.problem.theta.iter().zip(&run.solution().state.theta);
    let growth = |(entry, value): (&misclosure::problem::ThetaEntry, &f64)| {
        let descriptor = effects[entry.effect as usize].effect.descriptor();
        let parameter = &descriptor.parameters[entry.parameter as usize];
        let range = parameter.plausible.as_ref().filter(|_| descriptor.id == id && entry.free)?;
        // Stated for one sensor, as the typical size is.
        let limit = (if *value < 0.0 { range.min } else { range.max }) * entry.scale / parameter.typical.abs();
        (*value != 0.0).then(|| limit / value)
    };
    entries.filter_map(growth).fold(f64::INFINITY, f64::min)
}

/// Where an adjustment ends does not depend on its approximations, only how soon.
fn with_true_start(mut recipe: Recipe) -> Recipe {
    recipe.start = None;
    recipe
}

fn build(recipe: &Recipe) -> Block {
    recipe.build().unwrap_or_else(|error| panic!("seed {}: {error:#}", recipe.seed)).block
}

/// With every camera parameter free, as the program is asked to.
/// The effects that a block determines beside each other: one that it does not moves nothing that the others leave.
fn determined(block: &Block, effects: Vec<EffectTerm>) -> Vec<EffectTerm> {
    effects.into_iter().fold(Vec::new(), |mut kept, effect| {
        let beside: Vec<EffectTerm> = kept.iter().cloned().chain([effect.clone()]).collect();
        if adjust(block, beside).is_ok() {
            kept.push(effect);
        }
        kept
    })
}

fn adjust(block: &Block, effects: Vec<EffectTerm>) -> Result<Run, RunError> {
    let model = Model { datum: run::default_diagnosis_datum(block), effects, ..Model::default() };
    let options = Options { threads: 1, covariance: CovarianceOf::Nothing, ..Options::default() };
    let solvers: [&dyn Solver; 1] = [&Native];
    run::adjust(block, &model, &solvers, &options, &mut |_, _| ControlFlow::Continue(()))
}
