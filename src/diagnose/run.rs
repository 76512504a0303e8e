//! A whole diagnosis: a base without outliers and with believable weights, the loop, what is left, the verdict.

use super::added::Added;
use super::conclusion::diagnosis;
use super::imprecise::Imprecise;
use super::improvement::Improvement;
use super::knowledge::with_known;
use super::left;
use super::linearised::{Linearised, linearise};
use super::moved;
use super::outliers;
use super::own_cameras::{self, with_own_cameras};
use super::precision;
use super::search::SAME;
use super::settings::Settings;
use super::verdict::{Diagnosis, Verdict};
use super::weights;
use crate::adjust::AdjustError;
use crate::adjust::native::pool::Pool;
use crate::block::Block;
use crate::effects::{self, Stage};
use crate::math::statistics::chi_square_quantile;
use crate::mistakes::{Mistake, Subject};
use crate::model::Model;
use crate::problem::with_priors;
use crate::residuals::{self, Structure, check_points};
use crate::run::RunError;
use crate::run::fit::{Fit, fit};
use crate::screening;
use crate::snooping::settle::{judge, settle};
use crate::snooping::{Outliers, Snooping, Strictness};
use std::collections::BTreeSet;

/// Steps at the most. The objective falls with each, so that the loop ends by itself; a model of so many effects is
/// no diagnosis any more.
const MOST_STEPS: usize = 40;

const CENTRE_TIED: &str =
    "the block does not determine the centre of distortion: tied to the principal point (as --tie dc=pp)";

/// What a diagnosis found, and the block that it was made on.
pub struct Diagnosed {
    /// The block without outliers.
    pub block: Block,
    /// Outliers.
    pub outliers: Outliers,
    /// The loop.
    pub improvement: Improvement,
    /// Residual structure of the base model, and of the final one.
    pub before: Structure,
    /// See `before`.
    pub after: Structure,
    /// Verdict and figures.
    pub diagnosis: Diagnosis,
    /// Two cameras under one name, which ended the loop before its first step.
    several_cameras: Vec<Mistake>,
}

/// Diagnoses `block` under `model`. Where the centre of distortion is not determined, in the base or beside what was
/// found, it is tied to the principal point.
///
/// # Errors
/// A fit that fails.
pub fn diagnose(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, RunError> {
    Pool::new(settings.options.threads)?.install(|| diagnose_in_pool(whole, model, settings))
}

fn diagnose_in_pool(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, RunError> {
    let first = diagnose_without_mistakes(whole, model, settings)?;
    if first.several_cameras.is_empty() {
        return Ok(first);
    }
    let several = first.several_cameras;
    // A second camera under the name of the first bends the network that single images were held against, and an
    // effect stood for it: everything is judged anew.
    several.iter().for_each(|mistake| (settings.tell)(&mistake.sentence));
    let (block, model) = with_own_cameras(whole, model, &several);
    let mut diagnosed = diagnose_without_mistakes(&block, &model, settings)?;
    judge_mistakes(&mut diagnosed.diagnosis, several);
    Ok(diagnosed)
}

/// Diagnoses a block without what is known to be wrong: with it in the sums the loop would look for a cause of the
/// mistake, or find no end.
fn diagnose_without_mistakes(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, RunError> {
    (settings.tell)("holding the survey against the shape that the images give");
    let mistakes = screening::mistakes(whole, model, settings.significance, &settings.options);
    mistakes.iter().for_each(|mistake| (settings.tell)(&mistake.sentence));
    let rest = screening::without(whole, model, &mistakes);
    let (block, model) = rest.as_ref().map_or((whole, model), |(block, model)| (block, model));
    let mut diagnosed = match diagnose_as_it_is(block, model, settings) {
        Err(error) if undetermined_centre(&error, model) => {
            (settings.tell)(CENTRE_TIED);
            diagnose_as_it_is(block, &tied(model), settings)
        }
        diagnosed => diagnosed,
    }?;
    // What is known to be wrong tells why check points contradict the block.
    let is_checked = mistakes.is_empty() && diagnosed.diagnosis.contradicted_by_check_points().is_some();
    let doubtful = match is_checked || contradicts_survey(&diagnosed) {
        true => without_contradiction(block, model, &diagnosed, is_checked, settings)?,
        false => None,
    };
    let mut mistakes = mistakes;
    if let Some((other, mistake)) = doubtful {
        diagnosed = other.unwrap_or(diagnosed);
        mistakes.push(mistake);
    }
    let fit = &diagnosed.improvement.fit;
    let aside = screening::of_outliers(block, &diagnosed.outliers, fit, &mistakes, settings.significance);
    let focal = screening::of_focal_lengths(block, fit, &mistakes);
    judge_mistakes(&mut diagnosed.diagnosis, mistakes.into_iter().chain(aside).chain(focal));
    let imprecise = precision::of_weights(&diagnosed.diagnosis);
    judge_mistakes(&mut diagnosed.diagnosis, imprecise);
    diagnosed.diagnosis.judge_check_points();
    Ok(diagnosed)
}

/// Does a diagnosis let surveyed groups contradict each other: is one imprecise, or moved by an effect?
fn contradicts_survey(diagnosed: &Diagnosed) -> bool {
    let is_moved = |id: &str| effects::find(id).is_some_and(|effect| effect.descriptor().stage == Stage::Position);
    let Diagnosis { imprecise, recommended, .. } = &diagnosed.diagnosis;
    imprecise.iter().any(Imprecise::is_of_survey) || recommended.iter().any(|id| is_moved(id))
}

/// The same without a surveyed group that one mistake sets against another one, and the mistake: where nothing
/// contradicts the survey then, and no cause is named that was not named before. A known displacement of a group is
/// simpler than an effect, or a precision, that takes the place of it. Where check points contradict the block, they
/// may be wrong, too; they have no part in the diagnosis, which is the same without them: `None`.
fn without_contradiction(
    block: &Block,
    model: &Model,
    before: &Diagnosed,
    is_checked: bool,
    settings: &Settings<'_>,
) -> Result<Option<(Option<Diagnosed>, Mistake)>, RunError> {
    for mistake in screening::doubtful(block, model, settings.significance, &settings.options) {
        if is_checked && mistake.subject == Subject::Check.key() {
            return Ok(Some((None, mistake)));
        }
        let Some((block, model)) = screening::without(block, model, std::slice::from_ref(&mistake)) else { continue };
        (settings.tell)(&format!("the same without the survey that may be wrong ({})", mistake.kind));
        let other = match diagnose_as_it_is(&block, &model, settings) {
            Ok(other) => other,
            Err(error) if settings.options.stop.is_raised() => return Err(error),
            Err(_) => continue,
        };
        let named = &before.diagnosis.recommended;
        let is_simpler = other.diagnosis.recommended.iter().all(|id| named.contains(id));
        let explains = matches!(other.diagnosis.verdict, Verdict::Adequate | Verdict::Missing);
        if explains && is_simpler && !contradicts_survey(&other) {
            return Ok(Some((Some(other), mistake)));
        }
    }
    Ok(None)
}

/// A mistake is the verdict, whatever effects stand beside it: sizes and coordinates may be wrong with it.
fn judge_mistakes(diagnosis: &mut Diagnosis, mistakes: impl IntoIterator<Item = Mistake>) {
    diagnosis.mistakes.extend(mistakes);
    if !diagnosis.mistakes.is_empty() {
        diagnosis.verdict = Verdict::Mistake;
    }
}

fn diagnose_as_it_is(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, RunError> {
    let tell = settings.tell;
    let (model, known) = with_known(whole, model);
    known.iter().for_each(|known| tell(&format!("{} is known: {}", known.effect, known.source)));
    let base = base(whole, &model, settings)?;
    let stated = base.at_least_as_stated(whole, &model, settings)?;
    let mut descent = Descent::from(whole, base, settings)?;
    if let Some(stated) = stated {
        // A camera that is not determined is known before the second descent.
        descent.improvement.to_the_last_digit(settings)?;
        tell("the same with the survey at least as precise as stated");
        let other = Descent::from(whole, stated, settings)?;
        let lower = other.among_causes(&model, settings) < descent.among_causes(&model, settings) - SAME;
        // Where both end alike, the one that began at the user's model says what was wrong with that.
        if lower || other.ends_as(&descent) {
            descent = other;
        }
    }
    let Descent { search, block, mut improvement, first, linearised, several_cameras } = descent;
    tell("describing the residuals");
    let rest = left::analyse(&block, &improvement, &linearised, settings)?;
    improvement.finish(&block, settings)?;
    let after = rest.structure.clone();
    let before = match improvement.added.is_empty() {
        true => after.clone(),
        false => structure_of(&block, &improvement.base, settings)?,
    };
    let rejected = search.outliers(whole);
    let first = first.as_ref().unwrap_or(&linearised);
    let found = diagnosis(&block, &improvement, first, &linearised, &rest, &after, rejected.rejected.len(), settings)?;
    let moved = match improvement.added.is_empty() {
        true => None,
        false => moved::between(&block, &improvement.base, &improvement.fit)?,
    };
    let outlier_points = outliers::points(&rejected, whole);
    let diagnosis = Diagnosis { known, moved, outlier_points, ..found };
    Ok(Diagnosed { block, outliers: rejected, improvement, before, after, diagnosis, several_cameras })
}

/// The base of a diagnosis.
pub struct Base {
    /// What is set aside.
    pub search: Snooping,
    /// The fit of the rest.
    pub fit: Fit,
    /// The objective, zero with the survey as precise as stated.
    pub objective: f64,
}

impl Base {
    /// The same with no group of the survey less precise than `model` states; `None` where none is. What a cause does
    /// to surveyed points looks like a survey that is less precise than stated, and beside one the cause does not pay:
    /// the objective decides between the two once causes are in. A group that is more precise stays so: it hides
    /// nothing, and beside it a cause is seen that its stated precision would hide.
    ///
    /// # Errors
    /// A wish to stop.
    pub fn at_least_as_stated(
        &self,
        whole: &Block,
        model: &Model,
        settings: &Settings<'_>,
    ) -> Result<Option<Self>, RunError> {
        let Some(stated) = weights::at_least_as_precise(&self.fit.model, model) else { return Ok(None) };
        let block = self.search.block(whole);
        let added = Added { own: stated.effects.len(), ..Default::default() };
        let based = fit(&block, &stated, Some(&self.fit), &settings.options).and_then(|fit| {
            let objective = objective(&block, &fit, &added, settings)?;
            Ok(Self { search: self.search.clone(), fit, objective })
        });
        match based {
            Err(error) if settings.options.stop.is_raised() => Err(error),
            based => Ok(based.ok()),
        }
    }
}

/// The objective of the fit of a base: zero with the survey as precise as stated.
fn objective(block: &Block, fit: &Fit, added: &Added, settings: &Settings<'_>) -> Result<f64, RunError> {
    match weights::is_as_stated(&fit.model) {
        true => Ok(0.0),
        false => weights::objective(block, fit, added, settings),
    }
}

/// The base of a diagnosis: `model` fitted without outliers and with believable weights.
///
/// # Errors
/// A fit that fails.
pub fn base(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Base, RunError> {
    let tell = settings.tell;
    tell("adjusting the base model and searching outliers");
    let (search, fitted) = base_as_stated(whole, model, settings)?;
    tell("estimating the weights");
    let added = Added { own: fitted.model.effects.len(), ..Default::default() };
    let block = search.block(whole);
    let weighing = Weighing { block: &block, added: &added, settings };
    let fit = weighing.likeliest(fitted)?;
    let objective = objective(&block, &fit, &added, settings)?;
    drop(block);
    Ok(Base { search, fit, objective })
}

/// `model` fitted without outliers, every measurement as precise as stated.
///
/// # Errors
/// A fit that fails.
pub fn base_as_stated(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<(Snooping, Fit), RunError> {
    let model = &with_priors(whole, model)?;
    let mut search = Snooping::new(whole, model);
    let fitted = match settle(whole, &mut search, model, None, Strictness::Loose, &settings.settling()) {
        Err(error) if undetermined_centre(&error, model) => {
            (settings.tell)(CENTRE_TIED);
            let tied = tied(model);
            search = Snooping::new(whole, &tied);
            settle(whole, &mut search, &tied, None, Strictness::Loose, &settings.settling())?
        }
        fitted => fitted?,
    };
    Ok((search, fitted))
}

/// The search for the weights of a base.
struct Weighing<'a> {
    block: &'a Block,
    added: &'a Added,
    settings: &'a Settings<'a>,
}

impl Weighing<'_> {
    /// The fit with the likeliest weights. The likelihood may have two maxima: a survey that contradicts itself bends
    /// the block, and images that are bent look imprecise. They are found from either end.
    fn likeliest(&self, fitted: Fit) -> Result<Fit, RunError> {
        let Self { block, added, settings } = self;
        if !weights::may_be_bent(&fitted) {
            return Ok(self.from(fitted)?.0);
        }
        let loosest = weights::loosest(block, &fitted, added, settings)?;
        let loose = fit(block, &loosest.model, Some(&fitted), &settings.options);
        let (stated, gain) = self.from(fitted)?;
        match loose {
            Ok(loose) => {
                let (loose, gain_of_loose) = self.from(loose)?;
                Ok(if loosest.gain + gain_of_loose > gain + SAME { loose } else { stated })
            }
            Err(error) if settings.options.stop.is_raised() => Err(error),
            Err(_) => Ok(stated),
        }
    }

    /// Estimates the weights until they stand. Gives the fit with them, and what the objective falls by.
    fn from(&self, mut fitted: Fit) -> Result<(Fit, f64), RunError> {
        let Self { block, added, settings } = self;
        let mut fall = 0.0;
        for _ in 0..weights::ROUNDS {
            let Some(weights) = weights::reweighted(block, &fitted, added, settings)? else { break };
            fitted = fit(block, &weights.model, Some(&fitted), &settings.options)?;
            fall += weights.gain + weights.gain_of_images;
        }
        Ok((fitted, fall))
    }
}

/// A descent that has come to its end.
struct Descent {
    search: Snooping,
    block: Block,
    improvement: Improvement,
    /// Where it began; `None` where that is its end.
    first: Option<Linearised>,
    /// Where it ended.
    linearised: Linearised,
    /// Two cameras under one name: it ended where it began.
    several_cameras: Vec<Mistake>,
}

impl Descent {
    /// Goes down from a base.
    fn from(whole: &Block, base: Base, settings: &Settings<'_>) -> Result<Self, RunError> {
        let Base { mut search, fit, objective } = base;
        let mut block = search.block(whole).into_owned();
        let mut improvement = Improvement::new(&block, fit, settings)?;
        improvement.objective = objective;
        let (mut first, mut several_cameras) = (None, Vec::new());
        let linearised = loop {
            (settings.tell)(&format!("testing hypotheses (step {})", improvement.steps.len()));
            let linearised = linearise(&block, &improvement.fit, &improvement.parts, settings)?;
            if first.is_none() {
                several_cameras = own_cameras::several_cameras(&block, &linearised, settings.significance);
            }
            if improvement.steps.len() >= MOST_STEPS || !several_cameras.is_empty() {
                break linearised;
            }
            // Options, weights and blunders are moves on the same objective: each step of causes is followed by theirs.
            if improvement.descend(&block, &linearised, settings)? {
                improvement.exchange_options(&block, settings)?;
            } else {
                if improvement.added.is_empty() || !judged_again(whole, &mut search, &mut improvement, settings)? {
                    break linearised;
                }
                block = search.block(whole).into_owned();
            }
            first.get_or_insert(linearised);
        };
        Ok(Self { search, block, improvement, first, linearised, several_cameras })
    }

    /// Do both end at the same model?
    fn ends_as(&self, other: &Self) -> bool {
        let end = |of: &Self| of.improvement.added.iter().cloned().collect::<BTreeSet<_>>();
        end(self) == end(other) && weights::same(&self.improvement.fit.model, &other.improvement.fit.model)
    }

    /// Its objective with an imprecise survey among the causes; `stated`: what is stated of the survey.
    fn among_causes(&self, stated: &Model, settings: &Settings<'_>) -> f64 {
        let ln_level = self.linearised.ln_level(settings.significance);
        let objective = self.improvement.objective;
        let all = objective + weights::dearer_as_causes(&self.improvement.fit.model, stated, ln_level);
        (settings.tell)(&format!("objective {objective:.1}, {all:.1} with the survey's precision among the causes"));
        all
    }
}

/// Judges every measurement anew at the model as it stands, loosely and then tightly: with the effects in the model,
/// outliers that they hid stand out, and what looked like an effect may be one. Did the objective fall?
fn judged_again(
    whole: &Block,
    search: &mut Snooping,
    improvement: &mut Improvement,
    settings: &Settings<'_>,
) -> Result<bool, RunError> {
    if !settings.snoop {
        return Ok(false);
    }
    for strictness in [Strictness::Loose, Strictness::Tight] {
        let before = search.clone();
        let round = judge(whole, search, &improvement.fit, strictness, &settings.settling())?;
        if round.rejected + round.returned == 0 {
            continue;
        }
        let model = super::models::at_solution(&improvement.fit);
        let near = improvement.fit.clone();
        match settle(whole, search, &model, Some(&near), strictness, &settings.settling()) {
            Ok(fit) => {
                let gain = objective_of_blunders(&improvement.fit, &fit, settings.significance);
                if gain > -SAME {
                    *search = before;
                    continue;
                }
                let why = format!("{} measurements set aside, {} taken back", round.rejected, round.returned);
                let block = search.block(whole);
                improvement.replace(&block, fit, &why, gain, settings)?;
                return Ok(true);
            }
            Err(error) => {
                (settings.tell)(&format!("the search for outliers stopped: {error}"));
                *search = before;
            }
        }
    }
    Ok(false)
}

/// What the objective changes by when other measurements are set aside: each has a mean shift in two coordinates of
/// its own, and its price.
fn objective_of_blunders(before: &Fit, after: &Fit, significance: f64) -> f64 {
    let count = |fit: &Fit| fit.problem.observations.len() as f64;
    let variance = after.chi_square() / after.problem.redundancy().2 as f64;
    let level = significance / count(before).max(count(after));
    let price = chi_square_quantile(1.0 - level, 2.0);
    (after.chi_square() - before.chi_square()) / variance + (count(before) - count(after)) * price
}

/// The adjustment failed with a centre of distortion of its own: where distortion is small, that centre runs away.
fn undetermined_centre(error: &RunError, model: &Model) -> bool {
    let RunError::Adjust(error) = error else { return false };
    let failed = matches!(error, AdjustError::NotConverged { .. } | AdjustError::Singular { .. });
    failed && !model.tie_dc_to_pp && model.free[3] && model.free[4]
}

fn tied(model: &Model) -> Model {
    Model { tie_dc_to_pp: true, ..model.clone() }
}

fn structure_of(block: &Block, fitted: &Fit, settings: &Settings<'_>) -> Result<Structure, RunError> {
    let state = &fitted.solution.state;
    let Settings { significance, options, .. } = settings;
    let heights = check_points::of_fit(block, fitted, *significance, options.threads)?;
    Ok(residuals::analyse(&fitted.problem, state, &heights, *significance, options.threads)?)
}
