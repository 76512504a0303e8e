//! What the judge adjusts itself: a recipe's block with the base model and with the effects that were put in.

use misclosure::adjust::native::Native;
use misclosure::adjust::{Options, Solver};
use misclosure::block::Block;
use misclosure::camera::parameter_indices;
use misclosure::diagnose::knowledge::with_known;
use misclosure::effects::{self, Role};
use misclosure::inject::recipe::{self, Expected, ExpectedVerdict, Recipe};
use misclosure::model::{EffectRef, EffectTerm, Model};
use misclosure::run::{self, Run};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Folder of the recipes.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/hidden")
}

/// A recipe with its name.
pub struct Named {
    /// File name without extension.
    pub name: String,
    /// The recipe.
    pub recipe: Recipe,
}

/// Every recipe, by name.
pub fn all() -> Vec<Named> {
    let entries = std::fs::read_dir(folder()).expect("data/hidden");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let named = |path: &PathBuf| Named {
        name: path.file_stem().expect("a name").to_str().expect("UTF-8").into(),
        recipe: recipe::read(path).unwrap_or_else(|error| panic!("{error:#}")),
    };
    paths.iter().map(named).collect()
}

/// Recipes judged by `make test`: one of each kind, the quick ones.
const SUBSET: [&str; 12] = [
    "closerange-decentring-high",
    "closerange-none",
    "closerange-sensor-jitter",
    "dike-none-outliers",
    "high-curvature",
    "mapping-map-scale",
    "received-1",
    "received-2",
    "two-dike-steps-shift",
    "unknown-closerange-stitch",
    "unknown-dike-growth-shutter",
    "unknown-mapping-drift-lever",
];

/// Set to `all` (as `make test-hidden` does) it asks for every recipe; else to a part of a recipe's name.
const WHICH: &str = "MISCLOSURE_HIDDEN";

/// The recipes to judge.
pub fn selected() -> Vec<Named> {
    let which = std::env::var(WHICH).unwrap_or_default();
    let mut all = all();
    all.retain(|named| match which.as_str() {
        "all" => true,
        "" => SUBSET.contains(&named.name.as_str()),
        part => named.name.contains(part),
    });
    assert!(!all.is_empty(), "{WHICH}={which}: no such recipe");
    all
}

/// The model that a diagnosis is given.
pub fn base_model(recipe: &Recipe, block: &Block) -> Model {
    let mut model = Model { datum: run::default_diagnosis_datum(block), ..Model::default() };
    for name in &recipe.fix {
        let indices = parameter_indices(name).unwrap_or_else(|| panic!("no camera parameter `{name}`"));
        indices.into_iter().for_each(|k| model.free[k] = false);
    }
    model
}

/// The same with what the block's coordinate system says: where a diagnosis starts.
fn start_model(recipe: &Recipe, block: &Block) -> Model {
    with_known(block, &base_model(recipe, block)).0
}

/// The same with the effects that describe the causes; a fixed group of the camera is set free (`free:f`).
fn true_model(recipe: &Recipe, block: &Block) -> Model {
    let mut model = start_model(recipe, block);
    for expected in &recipe.truth.effects {
        match expected.id.strip_prefix("free:") {
            Some(group) => {
                let indices = parameter_indices(group).unwrap_or_else(|| panic!("no camera group `{group}`"));
                indices.into_iter().for_each(|k| model.free[k] = true);
            }
            None => model.effects.push(term(expected)),
        }
    }
    model
}

fn term(expected: &Expected) -> EffectTerm {
    let Expected { id, sizes: _, start, held } = expected;
    let effect = effects::find(id).unwrap_or_else(|| panic!("the catalogue has no `{id}`"));
    EffectTerm { effect: EffectRef::Builtin(effect), values: start.clone(), held: held.clone() }
}

/// Adjusts with the native solver.
pub fn adjust(block: &Block, model: &Model) -> Run {
    let solvers: [&dyn Solver; 1] = [&Native];
    run::adjust(block, model, &solvers, &Options::default(), &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("{}: {error}", block.name))
}

/// 3D RMS at the check points, mm.
pub fn check_rms_mm(run: &Run) -> f64 {
    let comparison = run.comparison.as_ref().expect("surveyed points");
    1e3 * comparison.check.as_ref().expect("check points").rms_m.xyz
}

/// Adjustments of a recipe's blocks with the base and with the true model.
pub struct Compared {
    /// See [`Truth::noncentrality`](misclosure::inject::recipe::Truth::noncentrality).
    pub noncentrality: f64,
    /// 3D RMS at the check points of the block with known noise, mm: base and true model.
    pub check_mm: [f64; 2],
    /// The true model and the block with known noise.
    pub noisy: Run,
    /// The true model and the block without random errors; `None` where the true model is not one of least squares
    /// alone (values drawn by image, whose standard deviation such a block does not determine), or has no effect. An
    /// unexplained cause stays in the block: sizes that it would bias are not stated.
    pub exact: Option<Run>,
}

/// Adjusts a recipe's blocks with the base and with the true model.
pub fn compare(recipe: &Recipe) -> Compared {
    let block = recipe.with_known_noise().build().expect("a block").block;
    let base = adjust(&block, &start_model(recipe, &block));
    let noisy = adjust(&block, &true_model(recipe, &block));
    let block = recipe.without_random_errors().build().expect("a block").block;
    let before = if recipe.truth.verdict == ExpectedVerdict::Adequate {
        0.0
    } else {
        adjust(&block, &start_model(recipe, &block)).chi_square()
    };
    let known = !recipe.truth.effects.is_empty() && !has_random_effect(recipe);
    let exact = known.then(|| adjust(&block, &true_model(recipe, &block)));
    let explained = exact.as_ref().filter(|_| recipe.truth.verdict == ExpectedVerdict::Missing);
    Compared {
        noncentrality: before - explained.map_or(0.0, Run::chi_square),
        check_mm: [check_rms_mm(&base), check_rms_mm(&noisy)],
        noisy,
        exact,
    }
}

/// Is one of its effects drawn by image?
pub fn has_random_effect(recipe: &Recipe) -> bool {
    let random = |expected: &Expected| {
        effects::find(&expected.id).is_some_and(|effect| {
            effect.descriptor().parameters.iter().any(|parameter| matches!(parameter.role, Role::Random(_)))
        })
    };
    recipe.truth.effects.iter().any(random)
}

/// An estimated parameter of an effect.
pub struct Estimate {
    /// `rolling-shutter.t`, `focal-flight.a[nadir50]`.
    pub name: String,
    /// Value.
    pub value: f64,
    /// A-posteriori standard deviation.
    pub sigma: f64,
}

/// Estimated parameters of the effects of a run. Of values drawn for every image the standard deviation `s` stands for
/// all of them; that of `s` itself is `s / sqrt(2 r)`, `r` the redundancy that they contribute (Förstner and Wrobel
/// 2016, sec. 4.2.4).
pub fn estimates(run: &Run) -> Vec<Estimate> {
    let solution = run.solution();
    let covariance = solution.covariance.as_ref().expect("a covariance");
    let mut estimates: Vec<Estimate> = Vec::new();
    let mut shares: Vec<(String, f64, f64)> = Vec::new();
    for (t, entry) in run.problem.theta.iter().enumerate().filter(|(_, entry)| entry.free) {
        let variance = covariance.theta_variances[t];
        let descriptor = run.problem.effects[entry.effect as usize].effect.descriptor();
        match (&descriptor.parameters[entry.parameter as usize].role, entry.prior_sigma) {
            (Role::Random(deviation), Some(sigma)) => {
                let (name, share) = (format!("{}.{deviation}", descriptor.id), 1.0 - variance / (sigma * sigma));
                match shares.iter_mut().find(|(other, ..)| *other == name) {
                    Some((.., sum)) => *sum += share,
                    None => shares.push((name, sigma, share)),
                }
            }
            _ => estimates.push(Estimate {
                name: entry.name.clone(),
                value: solution.state.theta[t],
                sigma: run.sigma0() * variance.sqrt(),
            }),
        }
    }
    estimates.extend(shares.into_iter().map(|(name, value, share)| Estimate {
        name,
        value,
        sigma: value / (2.0 * share).sqrt(),
    }));
    estimates
}
