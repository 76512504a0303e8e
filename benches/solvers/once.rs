//! One solve, in a process of its own, so that its peak memory is its own.

use super::blocks::{block, problem};
use anyhow::{Context, Result, ensure};
use cpu_time::ProcessTime;
use misclosure::adjust::ceres::Ceres;
use misclosure::adjust::native::Native;
use misclosure::adjust::{CovarianceOf, Options, Solver};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::process::{Command, Stdio};
use std::time::Instant;

/// First argument of the process that solves once.
pub const ONCE: &str = "once";

/// Converged is the first iteration whose cost exceeds the final one by no more than this share: the reference prints
/// its costs to so many digits. The same rule for every solver. Later steps, which gain less,
/// count in the whole call alone.
pub const CONVERGED: f64 = 1e-9;

/// What one process measured. Seconds are those of the processor, of all threads, where nothing else is said.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Measured {
    /// Final cost.
    pub cost: f64,
    /// To convergence.
    pub iterations: usize,
    /// From the first linearisation to convergence, per iteration.
    pub per_iteration: f64,
    /// The same on the clock.
    pub wall_per_iteration: f64,
    /// From the call to convergence, set-up included.
    pub to_convergence: f64,
    /// Of the whole call, with the solver's own last checks.
    pub call: f64,
    /// Largest resident memory during the iterations above that before the call, bytes; the reference does not tell
    /// everywhere.
    pub peak: Option<u64>,
    /// The same with what the process held before: the problem above all.
    pub peak_of_process: u64,
}

/// What is solved: solver, block, model, threads.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    pub solver: &'a str,
    pub block: &'a str,
    pub model: &'a str,
    pub threads: usize,
}

impl Case<'_> {
    /// Solves it in a process of its own.
    pub fn measure(&self) -> Result<Measured> {
        let Self { solver, block, model, threads } = self;
        let output = Command::new(std::env::current_exe()?)
            .args([ONCE, solver, block, model, &threads.to_string()])
            .env("OPENBLAS_NUM_THREADS", threads.to_string())
            .stderr(Stdio::inherit())
            .output()?;
        ensure!(output.status.success(), "{solver} on {block}: {}", output.status);
        serde_json::from_slice(&output.stdout).with_context(|| format!("{solver} on {block}"))
    }

    /// Solves it here.
    pub fn solve(&self) -> Result<Measured> {
        let solver: &dyn Solver = if self.solver == Native.name() { &Native } else { &Ceres };
        let problem = problem(block(self.block)?, self.model)?;
        let options = Options { threads: self.threads, covariance: CovarianceOf::Nothing, ..Options::default() };
        forget_peak()?;
        let before = memory("VmRSS")?;
        let (started, clock) = (ProcessTime::now(), Instant::now());
        let mut reports = Vec::new();
        let mut peak_of_process = Ok(0);
        let solution = solver.solve(&problem, &options, &mut |iteration| {
            let seconds = [started.elapsed(), clock.elapsed()].map(|time| time.as_secs_f64());
            reports.push((iteration.number, iteration.cost, seconds));
            peak_of_process = memory("VmHWM");
            ControlFlow::Continue(())
        })?;
        let call = started.elapsed().as_secs_f64();
        let peak_of_process = peak_of_process?;
        let is_converged = |cost: f64| cost <= solution.cost * (1.0 + CONVERGED);
        let converged = reports.iter().find(|(_, cost, _)| is_converged(*cost));
        let (first, last) = reports.first().zip(converged).context("no converged iteration reported")?;
        ensure!(last.0 > first.0, "a single iteration cannot be timed");
        let iterations = last.0 - first.0;
        let [per_iteration, wall_per_iteration] = [0, 1].map(|k| (last.2[k] - first.2[k]) / iterations as f64);
        Ok(Measured {
            cost: solution.cost,
            iterations,
            per_iteration,
            wall_per_iteration,
            to_convergence: last.2[0],
            call,
            peak: Some(peak_of_process.saturating_sub(before)),
            peak_of_process,
        })
    }
}

/// Sets the peak that Linux keeps of this process to what it uses now.
fn forget_peak() -> Result<()> {
    std::fs::write("/proc/self/clear_refs", "5").context("peak memory can be measured on Linux alone")
}

/// A line of `/proc/self/status`, bytes.
fn memory(key: &str) -> Result<u64> {
    kilobytes("/proc/self/status", key)
}

/// Memory that the machine can give now, bytes.
pub fn available_memory() -> Result<u64> {
    kilobytes("/proc/meminfo", "MemAvailable")
}

fn kilobytes(file: &str, key: &str) -> Result<u64> {
    let text = std::fs::read_to_string(file)?;
    let line = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    let kilobytes =
        line.and_then(|line| line.trim().strip_suffix("kB")).with_context(|| format!("no {key} in {file}"))?;
    Ok(1024 * kilobytes.trim().parse::<u64>()?)
}
