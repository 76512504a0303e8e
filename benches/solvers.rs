//! Both solvers on the same blocks, side by side: `make bench`, or `cargo bench --bench solvers`.
//!
//! Every solve runs in a process of its own, so that its peak memory is its own; the solvers take turns, so that what else the machine
//! does meets both. `MISCLOSURE_BENCH_RUNS` sets the number of runs (5), `MISCLOSURE_BENCH_THREADS` that of the threads (2).

use anyhow::{Context, Result, ensure};
use misclosure::adjust::ceres::Ceres;
use misclosure::adjust::native::Native;
use misclosure::adjust::{CovarianceOf, Options, Solver};
use misclosure::model::Model;
use misclosure::problem::Problem;
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use misclosure::scenario::{Perturbation, Scenario, add_noise, simulate};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Preset and its parameters. The corridor has 2 million observations, two per image measurement.
const BLOCKS: [(&str, &[(&str, f64)]); 2] =
    [("dike", &[("check", 0.0)]), ("corridor", &[("length_m", 2000.0), ("points", 171_000.0), ("check", 0.0)])];

const SOLVERS: [&str; 2] = ["native", "ceres"];

/// First argument of the process that solves once.
const ONCE: &str = "once";

const SEED: u64 = 1;
const NOISE_PX: f64 = 0.3;

/// Approximations as a GNSS receiver of one frequency and a gimbal give them; the points are intersected.
const START: Perturbation = Perturbation { focal_fraction: 2e-3, position_m: 0.1, angle_rad: 2e-3, points: true };

/// Converged is the first iteration whose cost exceeds the final one by no more than this share. At 2 million observations chi-square is
/// then known to 2e-6 and a parameter to 1e-3 sigma, what the solvers must agree to. One rule for both: what a solver spends on
/// steps within rounding, until its own rule stops it, is not counted.
const CONVERGED: f64 = 1e-12;

/// What one process measured.
#[derive(Debug, Serialize, Deserialize)]
struct Measured {
    images: usize,
    points: usize,
    measurements: usize,
    /// Final cost.
    cost: f64,
    /// To convergence.
    iterations: usize,
    /// From the first linearisation to convergence, per iteration.
    seconds_per_iteration: f64,
    /// From the call to convergence, set-up included.
    seconds_to_convergence: f64,
    /// Of the whole call, with the solver's own last checks.
    seconds_of_call: f64,
    /// Largest resident memory during the iterations, above that before the call, bytes.
    peak: u64,
    /// The same with what the process held before: the problem above all.
    peak_of_process: u64,
}

/// A value of a run, and its decimals in the table.
type Column = (fn(&Measured) -> f64, usize);

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match arguments.as_slice() {
        [] => compare(),
        [once, solver, block, threads] if once == ONCE => {
            println!("{}", serde_json::to_string(&solve_once(solver, block, threads.parse()?)?)?);
            Ok(())
        }
        other => anyhow::bail!("unknown arguments {other:?}: none are expected"),
    }
}

fn from_environment(name: &str, default: usize) -> Result<usize> {
    let Ok(text) = std::env::var(name) else { return Ok(default) };
    let value = text.parse().with_context(|| format!("{name} = {text}: expected a number"))?;
    ensure!(value > 0, "{name} = {text}: expected at least 1");
    Ok(value)
}

fn compare() -> Result<()> {
    let runs = from_environment("MISCLOSURE_BENCH_RUNS", 5)?;
    let threads = from_environment("MISCLOSURE_BENCH_THREADS", 2)?;
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
    for (block, _) in BLOCKS {
        let mut measured: [Vec<Measured>; 2] = Default::default();
        for run in 0..runs {
            for (solver, results) in SOLVERS.iter().zip(&mut measured) {
                let result = in_own_process(solver, block, threads)?;
                eprintln!(
                    "{block}, run {} of {runs}, {solver}: {:.2} s to convergence, {:.0} MB",
                    run + 1,
                    result.seconds_to_convergence,
                    megabytes(result.peak as f64)
                );
                results.push(result);
            }
        }
        let [native, ceres] = &measured;
        let (a, b) = (&native[0], &ceres[0]);
        println!("{block}: {} observations, {} images, {} points", 2 * a.measurements, a.images, a.points);
        ensure!(
            (a.cost - b.cost).abs() <= CONVERGED * b.cost,
            "{block}: the solvers end at costs {} and {}",
            a.cost,
            b.cost
        );
        let columns: [Column; 7] = [
            (|m| m.iterations as f64, 0),
            (|m| m.seconds_per_iteration, 3),
            (|m| m.seconds_to_convergence, 2),
            (|m| m.seconds_of_call, 2),
            (|m| megabytes(m.peak as f64), 0),
            (|m| m.peak as f64 / m.measurements as f64, 0),
            (|m| megabytes(m.peak_of_process as f64), 0),
        ];
        for (solver, results) in SOLVERS.iter().zip(&measured) {
            let cells = columns.iter().map(|(value, digits)| fixed(median(results, value), *digits));
            table.row([block.to_owned(), solver.to_string()].into_iter().chain(cells));
        }
        let ratios = columns.iter().map(|(value, _)| fixed(median(native, value) / median(ceres, value), 2));
        table.row([block.to_owned(), "native / ceres".to_owned()].into_iter().chain(ratios));
    }
    println!("\nmedian of {runs}, {threads} threads\n\n{}", table.to_text());
    Ok(())
}

fn megabytes(bytes: f64) -> f64 {
    bytes / 1e6
}

fn median(results: &[Measured], value: impl Fn(&Measured) -> f64) -> f64 {
    let mut values: Vec<f64> = results.iter().map(value).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

fn in_own_process(solver: &str, block: &str, threads: usize) -> Result<Measured> {
    let output = Command::new(std::env::current_exe()?)
        .args([ONCE, solver, block, &threads.to_string()])
        .stderr(Stdio::inherit())
        .output()?;
    ensure!(output.status.success(), "{solver} on {block}: {}", output.status);
    serde_json::from_slice(&output.stdout).with_context(|| format!("{solver} on {block}"))
}

fn solve_once(solver: &str, block: &str, threads: usize) -> Result<Measured> {
    let solver: &dyn Solver = if solver == Native.name() { &Native } else { &Ceres };
    let problem = problem(block)?;
    let options = Options { threads, covariance: CovarianceOf::Nothing, ..Options::default() };
    forget_peak()?;
    let before = memory("VmRSS")?;
    let started = Instant::now();
    let mut reports = Vec::new();
    let mut peak_of_process = Ok(0);
    let solution = solver.solve(&problem, &options, &mut |iteration| {
        reports.push((iteration.number, iteration.cost, started.elapsed().as_secs_f64()));
        peak_of_process = memory("VmHWM");
        ControlFlow::Continue(())
    })?;
    let seconds_of_call = started.elapsed().as_secs_f64();
    let peak_of_process = peak_of_process?;
    let converged = |(_, cost, _): &&(usize, f64, f64)| *cost <= solution.cost * (1.0 + CONVERGED);
    let (first, last) =
        reports.first().zip(reports.iter().find(converged)).context("no converged iteration reported")?;
    ensure!(last.0 > first.0, "a single iteration cannot be timed");
    let iterations = last.0 - first.0;
    Ok(Measured {
        images: problem.image_names.len(),
        points: problem.point_names.len(),
        measurements: problem.observations.len(),
        cost: solution.cost,
        iterations,
        seconds_per_iteration: (last.2 - first.2) / iterations as f64,
        seconds_to_convergence: last.2,
        seconds_of_call,
        peak: peak_of_process.saturating_sub(before),
        peak_of_process,
    })
}

fn problem(block: &str) -> Result<Problem> {
    let (_, parameters) = BLOCKS.iter().find(|(name, _)| *name == block).context("unknown block")?;
    let overrides: BTreeMap<String, f64> = parameters.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    let mut simulation = simulate(&Scenario::preset(block, &overrides)?, SEED)?;
    add_noise(&mut simulation.block, NOISE_PX, SEED)?;
    simulation.perturb_start(START, SEED)?;
    Ok(Problem::new(&simulation.block, &Model::default())?)
}

/// Sets the peak that Linux keeps of this process to what it uses now.
fn forget_peak() -> Result<()> {
    std::fs::write("/proc/self/clear_refs", "5").context("peak memory can be measured on Linux alone")
}

/// A line of `/proc/self/status`, bytes.
fn memory(key: &str) -> Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    let kilobytes =
        line.and_then(|line| line.trim().strip_suffix("kB")).context("unknown format of /proc/self/status")?;
    Ok(1024 * kilobytes.trim().parse::<u64>()?)
}
