//! The recipes make what they state.

use super::models::{Compared, Named, all, compare, estimates, folder, has_random_effect, selected};
use misclosure::effects::{self, Stage};
use misclosure::inject::recipe::ExpectedVerdict;
use misclosure::io::block::write_block;
use std::collections::BTreeSet;
use std::path::Path;

/// Numbers are stated with four digits; the last one is free to change with rounding in another compiler.
const STATED_DIGITS: f64 = 1e-3;
/// A noncentrality that a test at the 0.1 % level sees with certainty, so that a miss is a fault and no bad luck.
const VISIBLE: f64 = 60.0;
/// The part of its standard deviation by which a stated size may miss what a block without random errors gives: it then
/// takes no share worth mentioning of the four that an estimate is allowed.
const EXACT_SIGMA: f64 = 0.5;

#[test]
fn there_are_recipes_of_every_kind() {
    let all = all();
    assert!(all.len() >= 20, "{}", all.len());
    let count = |wanted: &dyn Fn(&Named) -> bool| all.iter().filter(|named| wanted(named)).count();
    let verdict = |verdict: ExpectedVerdict| count(&|named| named.recipe.truth.verdict == verdict);
    assert!(verdict(ExpectedVerdict::Adequate) >= 3 && verdict(ExpectedVerdict::Unexplained) >= 2);
    assert!(count(&|named| named.recipe.truth.effects.len() >= 2) >= 3);
    assert!(count(&|named| named.recipe.outliers.is_some()) >= 3);
    assert!(count(&|named| named.recipe.start.is_some()) >= 3);
    assert!(count(&|named| named.recipe.noise.stated_px != named.recipe.noise.px) >= 3);
    for preset in ["dike", "corridor", "mapping", "closerange"] {
        assert!(count(&|named| named.recipe.scenario.preset.as_deref() == Some(preset)) > 0, "{preset}");
    }
    let single = all.iter().filter(|named| named.recipe.truth.effects.len() == 1);
    let stages: BTreeSet<Stage> = single
        .filter_map(|named| effects::find(&named.recipe.truth.effects[0].id))
        .map(|effect| effect.descriptor().stage)
        .collect();
    let of_catalogue: BTreeSet<Stage> = effects::catalogue().iter().map(|effect| effect.descriptor().stage).collect();
    assert_eq!(stages, of_catalogue);
}

#[test]
fn expectations_are_consistent() {
    for Named { name, recipe } in all() {
        let truth = &recipe.truth;
        match truth.verdict {
            ExpectedVerdict::Adequate => assert!(truth.effects.is_empty() && truth.noncentrality == 0.0, "{name}"),
            ExpectedVerdict::Missing => assert!(!truth.effects.is_empty(), "{name}"),
            ExpectedVerdict::Unexplained | ExpectedVerdict::Mistake => {}
        }
        assert!(
            truth.verdict == ExpectedVerdict::Adequate || truth.noncentrality >= VISIBLE,
            "{name}: too small to be asked for"
        );
        let ratio = recipe.noise.stated_px / recipe.noise.px;
        assert!((0.2..=0.5).contains(&recipe.noise.px) && (0.5..=2.0).contains(&ratio), "{name}");
        for expected in &truth.effects {
            if expected.id.starts_with("free:") {
                continue;
            }
            let effect = effects::find(&expected.id).unwrap_or_else(|| panic!("{name}: no effect `{}`", expected.id));
            assert_eq!(effect.descriptor().kind, effects::Kind::Physical, "{name}");
            for (size, value) in &expected.sizes {
                let of_size = |parameter: &&effects::Parameter| size.split('[').next() == Some(&*parameter.name);
                let parameter = effect.descriptor().parameters.iter().find(of_size);
                let range = parameter.and_then(|parameter| parameter.plausible.as_ref());
                let possible = range.is_none_or(|range| (range.min..=range.max).contains(value));
                assert!(possible, "{name}: no {} has {size} = {value}", expected.id);
            }
        }
    }
}

#[test]
fn blocks_are_deterministic_and_as_stated() {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for Named { name, recipe } in all() {
        let made = recipe.build().unwrap_or_else(|error| panic!("{name}: {error:#}"));
        let again = one_thread.install(|| recipe.build()).expect("as before");
        assert!(made.block == again.block && made.truth == again.truth, "{name}: another run gives another block");
        let block = &made.block;
        assert_eq!(block.sigma.tie_px, recipe.noise.stated_px, "{name}");
        let fraction = recipe.outliers.map_or(0.0, |outliers| outliers.fraction);
        let share = made.report.outliers.len() as f64 / block.ties.len() as f64;
        // Those that fell off the sensor are counted, but no longer there.
        assert!((share - fraction).abs() <= 0.02 * fraction, "{name}: {share} outliers");
        let approximate = recipe.start.is_none_or(|start| start.points);
        assert_eq!(block.tie_points.iter().all(|point| point.position.is_some()), approximate, "{name}");
        assert_ne!(
            recipe.with_known_noise().build().expect("a block").block,
            recipe.without_random_errors().build().expect("a block").block
        );
    }
}

/// What a recipe should state. A new one is written with zeros, and takes its numbers from here.
fn print_numbers(name: &str, compared: &Compared) {
    let Compared { noncentrality, check_mm: [base, model], noisy, exact } = compared;
    println!(
        "{name:34} noncentrality {noncentrality:9.4e}  check_mm {base:8.4} {model:8.4}  sigma0 {:.4}",
        noisy.sigma0()
    );
    let exact = exact.as_ref().map(estimates).unwrap_or_default();
    for (k, noisy) in estimates(noisy).iter().enumerate() {
        let exact = exact.get(k).map_or(f64::NAN, |exact| exact.value);
        println!("    {:28} {:12.5e} +- {:.1e}, exact {exact:12.5e}", noisy.name, noisy.value, noisy.sigma);
    }
}

/// `MISCLOSURE_HIDDEN=dike-none cargo test --release --test diagnosis stated_numbers -- --nocapture` prints those of
/// one recipe.
#[test]
fn stated_numbers_are_those_of_the_adjustments() {
    for Named { name, recipe } in selected() {
        let compared = compare(&recipe);
        print_numbers(&name, &compared);
        let Compared { noncentrality, check_mm: [base, model], noisy, exact } = compared;
        let truth = &recipe.truth;
        let near = |what: &str, stated: f64, found: f64| {
            let close = (stated - found).abs() <= STATED_DIGITS * found.abs();
            assert!(close, "{name}: {what} is {found:.4e}, the recipe states {stated:.4e}");
        };
        near("noncentrality", truth.noncentrality, noncentrality);
        near("base model's check RMS (mm)", truth.check_mm.base, base);
        near("true model's check RMS (mm)", truth.check_mm.model, model);
        let (Some(exact), false) = (exact, has_random_effect(&recipe)) else { continue };
        let (exact, noisy) = (estimates(&exact), estimates(&noisy));
        for expected in &truth.effects {
            for (parameter, size) in &expected.sizes {
                let of = format!("{}.{parameter}", expected.id);
                let k = exact.iter().position(|estimate| estimate.name == of);
                let k = k.unwrap_or_else(|| panic!("{name}: no estimate of {of}"));
                let (value, sigma) = (exact[k].value, noisy[k].sigma);
                assert!(
                    (value - size).abs() <= EXACT_SIGMA * sigma,
                    "{name}: {of} is {value:.5e}, the recipe states {size:.5e}, sigma {sigma:.1e}"
                );
            }
        }
    }
}

/// Files of a folder, by name.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("readable").path())
        .map(|path| (path.file_name().expect("a name").to_string_lossy().into(), std::fs::read(&path).expect("a file")))
        .collect();
    files.sort();
    files
}

#[test]
fn received_blocks_are_those_of_their_recipes() {
    for name in ["received-1", "received-2"] {
        let recipe = misclosure::inject::recipe::read(&folder().join(format!("{name}.toml"))).expect("a recipe");
        let scratch = tempfile::tempdir().expect("a temporary folder");
        write_block(&recipe.build().expect("a block").block, scratch.path()).expect("written");
        let (made, kept) = (files(scratch.path()), files(&folder().join(name)));
        let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&made), names(&kept), "{name}");
        for ((file, made), (_, kept)) in made.iter().zip(&kept) {
            assert!(made == kept, "{name}/{file} is not what the recipe gives");
        }
        let size: usize = kept.iter().map(|(_, bytes)| bytes.len()).sum();
        assert!(size <= 400_000, "{name} has {size} bytes");
    }
}
