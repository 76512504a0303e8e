//! The judge: `improve` on every recipe's block as it comes, with its noise, outliers and wrong start values, held
//! against what the recipe states.
//!
//! The check-point error is held against that of the true model on the block with known noise
//! (`Recipe::with_known_noise`): the same measurements, errors and check points, with a perfect search for outliers and
//! perfect weights. Nothing of the program that is judged has a part in that reference: the true model on the block
//! that its own search cleaned would forgive a search that cleans badly. [`recipes`](super::recipes) holds the number
//! that a recipe states for it against the adjustment.

use super::models::{Named, base_model, check_rms_mm, estimates, selected};
use crate::common::disagreement;
use misclosure::adjust::{BUILT, Options};
use misclosure::block::Block;
use misclosure::diagnose::run::{Diagnosed, diagnose};
use misclosure::diagnose::settings::Settings;
use misclosure::diagnose::shown::marks;
use misclosure::diagnose::verdict;
use misclosure::effects;
use misclosure::inject::recipe::{ExpectedVerdict, Truth};
use misclosure::io::model::{read_model, write_model};
use misclosure::model::{EffectRef, Model};
use misclosure::run::{self, Run};
use misclosure::run::{folder, set_aside};
use std::ops::ControlFlow;
use std::time::Instant;

/// Family-wise level, that of the command line.
const SIGNIFICANCE: f64 = 1e-3;
/// Standard deviations by which an estimated size may miss: with some sixty sizes, once in 250 sets of recipes.
const SIZE_SIGMAS: f64 = 4.0;
/// Check points of the improved model against those of the true one.
const CHECK_RATIO: f64 = 1.1;

/// Digits to which the ledger's check-point error is that of a new adjustment (variance components are estimated to a
/// thousandth).
const LEDGER_DIGITS: f64 = 1e-3;

#[test]
fn improve_finds_what_is_hidden() {
    let mut failures = Vec::new();
    println!("{:34} {:11} what was found", "recipe", "verdict");
    for named in selected() {
        let name = &named.name;
        let found = judge(&named).unwrap_or_else(|text| vec![text]);
        failures.extend(found.into_iter().map(|text| format!("{name}: {text}")));
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// Improves a recipe's block, prints a line, and says what is wrong.
fn judge(named: &Named) -> Result<Vec<String>, String> {
    let Named { name, recipe } = named;
    let block = recipe.build().map_err(|error| format!("{error:#}"))?.block;
    let started = Instant::now();
    let settings =
        Settings { plugins: &[], options: Options::default(), significance: SIGNIFICANCE, snoop: true, tell: &|_| {} };
    let diagnosed = diagnose(&block, &base_model(recipe, &block), &settings).map_err(|error| error.to_string())?;
    let seconds = started.elapsed().as_secs_f64();
    let mut failures = Vec::new();
    // The steps that led there, then the model that is handed on.
    let improvement = &diagnosed.improvement;
    let before = improvement.steps.split_last().map_or(&[][..], |(_, before)| before);
    for (number, step) in before.iter().enumerate() {
        let run = solve_both(&diagnosed.block, &step.model).map_err(|text| format!("step {number}: {text}"))?;
        failures.extend(disagreement(&run).map(|text| format!("step {number}: {text}")));
    }
    let run = solve_both(&diagnosed.block, &improvement.fit.model)?;
    failures.extend(disagreement(&run));
    failures.extend(judge_ledger(&diagnosed, &run));
    failures.extend(judge_descent(&diagnosed));
    failures.extend(judge_repetition(&block, &diagnosed));
    let sizes = Sizes::of(&recipe.truth, &run);
    print_line(name, &recipe.truth, &diagnosed, &sizes, check_rms_mm(&run), seconds);
    failures.extend(judge_names(&recipe.truth, &diagnosed));
    failures.extend(judge_knowledge(recipe.scenario.crs.as_deref(), &diagnosed));
    failures.extend(judge_pictures(&diagnosed));
    failures.extend(sizes.failures());
    let (reached, possible) = (check_rms_mm(&run), recipe.truth.check_mm.model);
    // Where no part of the truth is in the catalogue there is nothing to reach. Beside a part that is, the pattern
    // disturbs the check points under both models.
    let reachable = recipe.truth.verdict != ExpectedVerdict::Unexplained || !recipe.truth.effects.is_empty();
    let missed = reached.is_nan() || reached > CHECK_RATIO * possible;
    if reachable && missed {
        failures.push(format!("check points {reached:.4} mm, the true model reaches {possible:.4} mm"));
    }
    Ok(failures)
}

/// The program's own result first, as the command line takes it.
fn solve_both(block: &Block, model: &Model) -> Result<Run, String> {
    run::adjust(block, model, BUILT, &Options::default(), &mut |_, _| ControlFlow::Continue(()))
        .map_err(|error| error.to_string())
}

/// The model that is handed on and the list of what was set aside, once written and read, are all that it takes to
/// adjust the same again.
fn judge_repetition(block: &Block, diagnosed: &Diagnosed) -> Option<String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rows = diagnosed.outliers.rows(block);
    folder::write_outliers(folder.path(), rows).expect("a folder that can be written");
    let (file, rows) = folder::read_outliers(folder.path()).expect("what was written").expect("a file");
    match set_aside::without(block, &rows, &file) {
        Ok(left) if left == diagnosed.block => {}
        Ok(_) => return Some("without the outliers of the list it is another block".into()),
        Err(error) => return Some(error.to_string()),
    }
    let (model, path) = (&diagnosed.improvement.fit.model, folder.path().join("model.toml"));
    write_model(model, &path).expect("a folder that can be written");
    let find = |id: &str| effects::find(id).map(EffectRef::Builtin);
    let again = read_model(&path, &find).expect("what was written");
    (format!("{again:?}") != format!("{model:?}")).then(|| format!("the model {model:?} is read as {again:?}"))
}

/// The last row of the ledger is that of the model that is handed on.
fn judge_ledger(diagnosed: &Diagnosed, run: &Run) -> Option<String> {
    let stated = diagnosed.diagnosis.ledger.last().and_then(|row| row.check_rms_m).map_or(f64::NAN, |rms| 1e3 * rms);
    let found = check_rms_mm(run);
    let same = (stated - found).abs() <= LEDGER_DIGITS * found;
    (!same).then(|| format!("the ledger ends at {stated:.4} mm, the model at {found:.4} mm"))
}

/// The objective falls with every row of the ledger.
fn judge_descent(diagnosed: &Diagnosed) -> Option<String> {
    let objective: Vec<f64> = diagnosed.diagnosis.ledger.iter().map(|row| row.objective).collect();
    let falls = objective.windows(2).all(|pair| pair[1] < pair[0]);
    (!falls).then(|| format!("the objective does not fall with every row: {objective:?}"))
}

/// Does the picture of every effect that was found show it: more is left without the effect than with it?
fn judge_pictures(diagnosed: &Diagnosed) -> Vec<String> {
    let fit = &diagnosed.improvement.fit;
    let is_effect = |id: &&String| fit.model.effects.iter().any(|term| term.effect.descriptor().id == id.as_str());
    let failure = |id: &String| {
        let marks = match marks(None, fit, id) {
            Ok(marks) => marks,
            Err(error) => return Some(format!("the picture of {id}: {error}")),
        };
        let left = |stage: &str| -> f64 {
            let own = marks.iter().filter(|mark| mark.stage == stage);
            own.map(|mark| mark.n as f64 * mark.mean.powi(2)).sum()
        };
        (left(folder::WITH) >= left(folder::WITHOUT)).then(|| {
            format!("the picture of {id} shows {} with it, {} without", left(folder::WITH), left(folder::WITHOUT))
        })
    };
    diagnosed.diagnosis.recommended.iter().filter(is_effect).filter_map(failure).collect()
}

/// Is the verdict right, and are the effects those that are hidden, or such as the diagnosis says the block cannot tell
/// from them?
fn judge_names(truth: &Truth, diagnosed: &Diagnosed) -> Vec<String> {
    let mut failures = Vec::new();
    let mistakes = &diagnosed.diagnosis.mistakes;
    if !mistakes.is_empty() {
        return vec![format!("mistakes that nobody made: {mistakes:?}")];
    }
    let verdict = match diagnosed.diagnosis.verdict {
        verdict::Verdict::Adequate => ExpectedVerdict::Adequate,
        verdict::Verdict::Missing => ExpectedVerdict::Missing,
        verdict::Verdict::Unexplained | verdict::Verdict::Mistake => ExpectedVerdict::Unexplained,
    };
    if verdict != truth.verdict {
        let left = diagnosed.diagnosis.left.join("; ");
        failures.push(format!("verdict {verdict:?} instead of {:?}; left: {left}", truth.verdict));
    }
    let mut found = diagnosed.diagnosis.recommended.clone();
    let mut missed = Vec::new();
    for expected in &truth.effects {
        match found.iter().position(|id| *id == expected.id) {
            Some(position) => drop(found.remove(position)),
            None => missed.push(expected.id.as_str()),
        }
    }
    let declared = |id: &str, other: &str| {
        let entry = diagnosed.diagnosis.candidates.iter().find(|entry| entry.effect == id);
        entry.is_some_and(|entry| entry.inseparable_from.iter().any(|partner| partner == other))
    };
    for wanted in missed {
        match found.iter().position(|id| declared(id, wanted)) {
            Some(position) => drop(found.remove(position)),
            None => failures.push(format!("{wanted} was not found, nor a declared partner")),
        }
    }
    if !found.is_empty() {
        failures.push(format!("found besides: {}", found.join(", ")));
    }
    failures
}

/// Is what the coordinate system says held as known, and nothing where it says nothing?
fn judge_knowledge(crs: Option<&str>, diagnosed: &Diagnosed) -> Option<String> {
    let known: Vec<&str> = diagnosed.diagnosis.known.iter().map(|known| known.effect.as_str()).collect();
    let expected: &[&str] = if crs.is_some() { &["earth-curvature", "map-scale"] } else { &[] };
    (known != expected).then(|| format!("known are {known:?} instead of {expected:?}"))
}

/// Estimated sizes beside the stated ones.
struct Sizes(Vec<Size>);

struct Size {
    name: String,
    value: f64,
    sigma: f64,
    stated: f64,
}

impl Sizes {
    /// Of the effects that were found by their own name.
    fn of(truth: &Truth, run: &Run) -> Self {
        let estimates = estimates(run);
        let stated = truth.effects.iter().flat_map(|expected| {
            expected.sizes.iter().map(move |(parameter, size)| (format!("{}.{parameter}", expected.id), *size))
        });
        let size = |(name, stated): (String, f64)| {
            let estimate = estimates.iter().find(|estimate| estimate.name == name)?;
            Some(Size { name, value: estimate.value, sigma: estimate.sigma, stated })
        };
        Self(stated.filter_map(size).collect())
    }

    fn failures(&self) -> Vec<String> {
        let missed = |size: &&Size| {
            let Size { value, sigma, stated, .. } = size;
            // Written so that a NaN fails.
            let within = (value - stated).abs() <= SIZE_SIGMAS * sigma;
            !within
        };
        let text = |Size { name, value, sigma, stated }: &Size| {
            format!("{name} is {value:.4e} +- {sigma:.1e}, the recipe states {stated:.4e}")
        };
        self.0.iter().filter(missed).map(text).collect()
    }
}

fn print_line(name: &str, truth: &Truth, diagnosed: &Diagnosed, sizes: &Sizes, after_mm: f64, seconds: f64) {
    let found = &diagnosed.diagnosis.recommended;
    let found = if found.is_empty() { "nothing".into() } else { found.join(" + ") };
    let before_mm = diagnosed.improvement.steps[0].check_rms_m.map_or(f64::NAN, |rms| 1e3 * rms);
    let verdict = format!("{:?}", diagnosed.diagnosis.verdict).to_lowercase();
    let sizes: Vec<String> = sizes
        .0
        .iter()
        .map(|size| format!("{} {:.4e} +- {:.1e} ({:.4e})", size.name, size.value, size.sigma, size.stated))
        .collect();
    println!(
        "{name:34} {verdict:11} {found}  check {before_mm:.4} -> {after_mm:.4} mm (true model {:.4})  {seconds:.1} s  \
         {}",
        truth.check_mm.model,
        sizes.join(", ")
    );
}
