//! Both solvers on the same blocks, side by side, and beside them the reference for speed where there is one
//! (`../shared/perf`): `make bench`, or `cargo bench --bench solvers`, with names of blocks behind `--` for some of
//! them alone.
//!
//! Each solve runs in its own process. The solvers take turns, so that other load on the machine affects all alike.
//! Seconds are those that the processor spent, on one thread. `MISCLOSURE_BENCH_RUNS` sets the number of runs (5).

mod blocks;
mod once;
mod reference;

use anyhow::{Context, Result, bail, ensure};
use blocks::{BLOCKS, Block, FREE, MODELS, block, problem};
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use once::{Case, Measured, ONCE, available_memory};
use reference::{Program, Reference};
use std::process::Command;

/// First argument of the process that writes a problem for the reference; it prints the counts and the weight of the
/// measurements.
const WRITE: &str = "write";

/// Costs of two solvers agree to this share: the reference prints them to so many digits.
const SAME_COST: f64 = 2e-9;

/// Who solves, and the name in the table.
const SOLVERS: [(Who, &str); 4] = [
    (Who::Ours("native"), "native"),
    (Who::Ours("ceres"), "ceres"),
    (Who::Reference(Program::Native), "reference"),
    (Who::Reference(Program::Ceres), "reference's Ceres"),
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Who {
    Ours(&'static str),
    Reference(Program),
}

impl Who {
    fn is_ceres(self) -> bool {
        matches!(self, Who::Ours("ceres") | Who::Reference(Program::Ceres))
    }

    fn is_here(self, reference: Option<&Reference>) -> bool {
        match self {
            Who::Ours(_) => true,
            Who::Reference(program) => reference.is_some_and(|reference| reference.has(program)),
        }
    }
}

/// Limits of the ratios: block, native to the reference per iteration, native to the reference's Ceres per iteration
/// and to convergence.
const LIMITS: [(&str, f64, f64, f64); 3] =
    [("small", 1.2, 0.18, 0.15), ("medium", 1.3, 0.15, 0.12), ("areal", f64::INFINITY, 0.15, 0.15)];
/// Ours to the reference's Ceres, per iteration.
const CERES_LIMIT: f64 = 1.2;
/// A model with effects to the plain camera, per iteration.
const MODEL_LIMIT: f64 = 1.6;
/// One thread to two, on the clock.
const THREADS_LIMIT: f64 = 1.8;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        [once, solver, block, model, threads] if *once == ONCE => {
            let measured = Case { solver, block, model, threads: threads.parse()? }.solve()?;
            println!("{}", serde_json::to_string(&measured)?);
            Ok(())
        }
        [write, name, path] if *write == WRITE => {
            let problem = problem(block(name)?, FREE)?;
            reference::write(&problem, path.as_ref())?;
            let counts = [problem.observations.len(), problem.image_names.len(), problem.point_names.len()];
            println!("{}", serde_json::to_string(&(counts, reference::weight_of(&problem)?))?);
            Ok(())
        }
        [] => compare(&BLOCKS.iter().collect::<Vec<_>>()),
        names => compare(&names.iter().map(|name| block(name)).collect::<Result<Vec<_>>>()?),
    }
}

fn compare(blocks: &[&Block]) -> Result<()> {
    let runs = match std::env::var("MISCLOSURE_BENCH_RUNS") {
        Ok(text) => text.parse().with_context(|| format!("MISCLOSURE_BENCH_RUNS = {text}: expected a number"))?,
        Err(_) => 5,
    };
    ensure!(runs > 0, "MISCLOSURE_BENCH_RUNS = {runs}: expected at least 1");
    let reference = Reference::find()?;
    let mut table = Table::new("")
        .text("block", "")
        .text("solver", "")
        .number("iterations", "")
        .number("per iteration", "s")
        .number("to convergence", "s")
        .number("whole call", "s")
        .number("peak memory", "MB")
        .number("per measurement", "B")
        .number("with the block", "MB");
    let mut ratios = Ratios(Table::new("").text("ratio", "").text("block", "").number("is", "").number("at most", ""));
    for block in blocks {
        let available = available_memory()?;
        if available < block.needs {
            let gigabytes = |bytes: u64| bytes as f64 / 1e9;
            let (needs, has) = (gigabytes(block.needs), gigabytes(available));
            eprintln!("skipped: block {} needs {needs:.0} GB of memory, {has:.1} are free", block.name);
            continue;
        }
        side_by_side(block, reference.as_ref(), runs, &mut table, &mut ratios)?;
        if !block.with_ceres {
            continue;
        }
        by_model(block, runs, &mut ratios)?;
        by_threads(block, runs, &mut ratios)?;
    }
    println!("\nmedian of {runs}, seconds of the processor, one thread\n\n{}", table.to_text());
    println!("{}", ratios.0.to_text());
    Ok(())
}

/// All solvers on a block.
fn side_by_side(
    block: &Block,
    reference: Option<&Reference>,
    runs: usize,
    table: &mut Table,
    ratios: &mut Ratios,
) -> Result<()> {
    let name = block.name;
    let target = reference.map_or_else(|| std::env::temp_dir().join("misclosure-bench.fba"), |r| r.file(name));
    let output = Command::new(std::env::current_exe()?).args([WRITE, name]).arg(&target).output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let ([measurements, images, points], weight): ([usize; 3], f64) = serde_json::from_slice(&output.stdout)?;
    println!("{name}: {measurements} measurements, {images} images, {points} points");
    let takes_part = |who: Who| (block.with_ceres || !who.is_ceres()) && who.is_here(reference);
    let mut measured: [Vec<Measured>; SOLVERS.len()] = Default::default();
    for run in 0..runs {
        for ((who, label), results) in SOLVERS.iter().zip(&mut measured).filter(|((who, _), _)| takes_part(*who)) {
            let result = match (who, reference) {
                (Who::Ours(solver), _) => Case { solver, block: name, model: FREE, threads: 1 }.measure()?,
                (Who::Reference(program), Some(reference)) => reference.measure(*program, &target, weight)?,
                (Who::Reference(_), None) => bail!("no reference"),
            };
            eprintln!("{name}, run {} of {runs}, {label}: {:.3} s per iteration", run + 1, result.per_iteration);
            results.push(result);
        }
    }
    std::fs::remove_file(&target)?;
    let cost = measured[0][0].cost;
    for ((_, label), results) in SOLVERS.iter().zip(&measured) {
        let Some(first) = results.first() else { continue };
        ensure!(
            (first.cost - cost).abs() <= SAME_COST * cost,
            "{name}: native ends at {cost}, {label} at {}",
            first.cost
        );
        let peak = median(results, |m| m.peak.map_or(f64::NAN, |peak| peak as f64));
        let or_nothing = |value: f64| if value.is_nan() { "-".to_owned() } else { fixed(value, 0) };
        table.row([
            name.to_owned(),
            label.to_string(),
            fixed(median(results, |m| m.iterations as f64), 0),
            fixed(median(results, |m| m.per_iteration), 4),
            fixed(median(results, |m| m.to_convergence), 3),
            fixed(median(results, |m| m.call), 3),
            or_nothing(peak / 1e6),
            or_nothing(peak / measurements as f64),
            fixed(median(results, |m| m.peak_of_process as f64) / 1e6, 0),
        ]);
    }
    let limit = LIMITS.iter().find(|(of, ..)| *of == name);
    let (by_hand, per_iteration, to_convergence) = limit
        .map_or((None, None, None), |(_, a, b, c)| (Some(*a).filter(|limit| limit.is_finite()), Some(*b), Some(*c)));
    let [native, ceres, by_reference, by_its_ceres] = &measured;
    let once = |m: &Measured| m.per_iteration;
    let all = |m: &Measured| m.to_convergence;
    ratios.add("native / ceres, per iteration", name, native, ceres, once, None);
    ratios.add("native / reference, per iteration", name, native, by_reference, once, by_hand);
    ratios.add("native / reference's Ceres, per iteration", name, native, by_its_ceres, once, per_iteration);
    ratios.add("native / reference's Ceres, to convergence", name, native, by_its_ceres, all, to_convergence);
    ratios.add("ceres / reference's Ceres, per iteration", name, ceres, by_its_ceres, once, Some(CERES_LIMIT));
    Ok(())
}

/// The native solver with every model.
fn by_model(block: &Block, runs: usize, ratios: &mut Ratios) -> Result<()> {
    let mut measured: [Vec<Measured>; MODELS.len()] = Default::default();
    for _ in 0..runs {
        for ((model, _), results) in MODELS.iter().zip(&mut measured) {
            results.push(Case { solver: "native", block: block.name, model, threads: 1 }.measure()?);
        }
    }
    for ((model, _), results) in MODELS.iter().zip(&measured).skip(1) {
        let what = format!("native, {model} / {}, per iteration", MODELS[0].0);
        ratios.add(&what, block.name, results, &measured[0], |m| m.per_iteration, Some(MODEL_LIMIT));
    }
    Ok(())
}

/// One thread beside two.
fn by_threads(block: &Block, runs: usize, ratios: &mut Ratios) -> Result<()> {
    let mut measured: [Vec<Measured>; 2] = Default::default();
    for _ in 0..runs {
        for (threads, results) in [1, 2].into_iter().zip(&mut measured) {
            results.push(Case { solver: "native", block: block.name, model: FREE, threads }.measure()?);
        }
    }
    let [one, two] = &measured;
    let what = "native, two threads / one, by the clock, per iteration";
    ratios.add(what, block.name, two, one, |m| m.wall_per_iteration, Some(1.0 / THREADS_LIMIT));
    Ok(())
}

/// Ratios of medians, and what is wanted of them.
struct Ratios(Table);

impl Ratios {
    fn add(
        &mut self,
        what: &str,
        block: &str,
        above: &[Measured],
        below: &[Measured],
        value: impl Fn(&Measured) -> f64,
        limit: Option<f64>,
    ) {
        if above.is_empty() || below.is_empty() {
            return;
        }
        let ratio = median(above, &value) / median(below, &value);
        let limit = limit.map_or_else(|| "-".to_owned(), |limit| fixed(limit, 2));
        self.0.row([what.to_owned(), block.to_owned(), fixed(ratio, 2), limit]);
    }
}

fn median(results: &[Measured], value: impl Fn(&Measured) -> f64) -> f64 {
    let mut values: Vec<f64> = results.iter().map(value).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}
