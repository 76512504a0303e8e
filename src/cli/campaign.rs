//! `misclosure campaign`: thousands of cases from one grid, on one machine or many.

use super::text::path_text;
use super::{Answer, Console, Usage};
use crate::campaign::analyse::{page, tables};
use crate::campaign::folder::{Folder, State};
use crate::campaign::gather::{self, Row};
use crate::campaign::run::{Event, Work, run as work};
use crate::campaign::scripts::{Engine, script};
use crate::campaign::{execute, lease};
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Seconds between two lines of progress where there is no bar.
const LINE_SECONDS: f64 = 10.0;
/// Reasons of failures that `status` shows.
const REASONS: usize = 5;
/// Figure of the analysis of variance where none is asked for.
const FIGURE: &str = "check_rms_m_final";

/// Works off thousands of cases from one grid, on this machine or on many that share a folder
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure campaign plan campaigns/null.toml -o null     the cases, one for each combination of levels
  misclosure campaign run null                             works them off; more workers may join at any time
  misclosure campaign status null
  misclosure campaign gather null                          results.csv, candidates.csv, estimates.csv
  misclosure campaign analyse null                         power, confusion, calibration, variance; report.html
  misclosure campaign script null --for slurm --shards 20  a script that starts 20 workers

The state is the folder: whoever sees it may work. A killed worker loses the case that it had, no more; another one
takes it over.")]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Writes the cases of a grid: one for each combination of the levels of its factors
    #[command(after_help = "Examples:\n  misclosure campaign plan campaigns/null.toml -o null")]
    Plan {
        /// The grid
        #[arg(value_name = "GRID.toml")]
        grid: PathBuf,
        /// Folder of the campaign, new or empty
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
    },
    Run(Run),
    /// Says how many cases are done, failed and open
    #[command(after_help = "Examples:\n  misclosure campaign status null")]
    Status {
        /// Folder of the campaign
        folder: PathBuf,
    },
    /// Writes the results as tables: results.csv with a row for each case, candidates.csv, estimates.csv
    #[command(after_help = "Examples:\n  misclosure campaign gather null")]
    Gather {
        /// Folder of the campaign
        folder: PathBuf,
        /// Also as Parquet (a build with Cargo's feature parquet)
        #[arg(long)]
        parquet: bool,
    },
    /// Power, confusion, calibration and analysis of variance: tables, and analysis/report.html
    #[command(
        after_help = "Examples:\n  misclosure campaign analyse null\n  misclosure campaign analyse null --figure \
                            tie_rms_px_final"
    )]
    Analyse {
        /// Folder of the campaign
        folder: PathBuf,
        /// Column of results.csv that the analysis of variance is of
        #[arg(long, default_value = FIGURE)]
        figure: String,
    },
    /// Prints a script that starts workers on many machines
    #[command(after_help = "Examples:\n  misclosure campaign script null --for slurm --shards 20 > null.sbatch")]
    Script {
        /// Folder of the campaign, as the machines see it
        folder: PathBuf,
        /// Program that starts them
        #[arg(long = "for", value_name = "PROGRAM")]
        engine: Choice,
        /// Workers
        #[arg(long, default_value_t = 8)]
        shards: usize,
        /// Cases at a time, by each worker
        #[arg(long, default_value_t = 1)]
        jobs: usize,
    },
}

/// Works off the cases that nobody has, and those of workers that died
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure campaign run null
  misclosure campaign run null --shard 3/20 --jobs 2     the third of twenty parts, two cases at a time
  misclosure campaign run null --again                   also what was given up")]
struct Run {
    /// Folder of the campaign
    folder: PathBuf,
    /// Cases at a time [default: one per processor, see --threads]
    #[arg(long, value_name = "N")]
    jobs: Option<std::num::NonZeroUsize>,
    /// A part of the cases alone: the I-th of N
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: (usize, usize),
    /// Forget failures and leases of earlier runs first; nobody else may be at work
    #[arg(long)]
    again: bool,
    /// Seconds without a sign of life after which a worker is taken for dead
    #[arg(long, value_name = "S", default_value_t = lease::LEASE.as_secs_f64())]
    lease: f64,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Choice {
    Slurm,
    Snakemake,
    #[value(name = "hyperqueue")]
    HyperQueue,
    Parallel,
}

fn shard(text: &str) -> Result<(usize, usize), String> {
    let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    parsed.filter(|(i, n)| (1..=*n).contains(i)).ok_or_else(|| format!("`{text}`: expected I/N with I from 1 to N"))
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    match &arguments.command {
        Command::Plan { grid, output } => {
            let (folder, grid) = Folder::plan(grid, output).map_err(|error| Usage(format!("{error:#}")))?;
            let cases = folder.cases.len();
            let text = format!("Campaign: {} ({cases} cases)\n", path_text(output));
            Ok(Answer { text, json: json!({ "format": 1, "about": grid.about, "cases": cases }), failure: None })
        }
        Command::Run(arguments) => arguments.run(console, threads),
        Command::Status { folder } => status(&open(folder)?),
        Command::Gather { folder, parquet } => {
            if *parquet && !cfg!(feature = "parquet") {
                bail!(Usage("--parquet: this build has none; build it with Cargo's feature parquet".into()));
            }
            let rows = gather::rows(&open(folder)?)?;
            gather::write(&rows, folder, *parquet)?;
            let done = rows.iter().filter(|row| row.outcome.is_some()).count();
            let text = format!("{done} of {} cases: {}\n", rows.len(), folder.join("results.csv").display());
            Ok(Answer { text, json: json!({ "format": 1, "cases": rows.len(), "done": done }), failure: None })
        }
        Command::Analyse { folder, figure } => analyse(folder, figure),
        Command::Script { folder, engine, shards, jobs } => {
            if *shards == 0 || *jobs == 0 {
                bail!(Usage("--shards, --jobs: expected at least 1".into()));
            }
            let engine = match engine {
                Choice::Slurm => Engine::Slurm,
                Choice::Snakemake => Engine::Snakemake,
                Choice::HyperQueue => Engine::HyperQueue,
                Choice::Parallel => Engine::Parallel,
            };
            let text = script(engine, &path_text(folder), *shards, *jobs);
            Ok(Answer { json: json!({ "format": 1, "script": text }), text, failure: None })
        }
    }
}

fn open(folder: &Path) -> anyhow::Result<Folder> {
    Folder::open(folder).map_err(|error| Usage(format!("{error:#}")).into())
}

impl Run {
    fn run(&self, console: &Console, threads: usize) -> anyhow::Result<Answer> {
        let lease = Duration::try_from_secs_f64(self.lease).ok().filter(|lease| *lease > lease::HEARTBEAT);
        let Some(lease) = lease else {
            bail!(Usage(format!("--lease {}: expected more than {} s", self.lease, lease::HEARTBEAT.as_secs())));
        };
        let folder = open(&self.folder)?;
        if self.again {
            folder.forget_failures()?;
        }
        let jobs = self.jobs.map_or(threads, usize::from);
        let all = (self.shard.0 - 1..folder.cases.len()).step_by(self.shard.1).count();
        let counter = Counter::new(console, &folder, all);
        work(&folder, &Work { jobs, shard: self.shard, lease }, &execute, &|event| counter.event(&event))?;
        let given_up = counter.given_up.load(Ordering::Relaxed);
        let here = counter.here.load(Ordering::Relaxed);
        drop(counter);
        let text = format!("{all} cases: {here} worked here, {given_up} given up\n");
        let failure = (given_up > 0).then(|| {
            let name = self.folder.display();
            anyhow::anyhow!("{given_up} cases were given up (misclosure campaign status {name} says why)")
        });
        Ok(Answer { text, json: json!({ "format": 1, "cases": all, "worked": here, "given_up": given_up }), failure })
    }
}

/// Counts cases on standard error: a bar on a terminal, now and then a line elsewhere.
struct Counter<'a> {
    console: &'a Console,
    folder: &'a Folder,
    bar: Option<ProgressBar>,
    all: usize,
    begun: Instant,
    ended: AtomicUsize,
    here: AtomicUsize,
    given_up: AtomicUsize,
    said: std::sync::Mutex<Instant>,
}

impl<'a> Counter<'a> {
    fn new(console: &'a Console, folder: &'a Folder, all: usize) -> Self {
        let bar = console.is_live().then(|| {
            let template = "{spinner} campaign [{elapsed_precise}] {bar:30} {pos}/{len} {wide_msg}";
            let style = ProgressStyle::with_template(template).expect("constant template");
            ProgressBar::new(all as u64).with_style(style)
        });
        let [ended, here, given_up] = [0; 3].map(AtomicUsize::new);
        let (begun, said) = (Instant::now(), std::sync::Mutex::new(Instant::now()));
        Self { console, folder, bar, all, begun, ended, here, given_up, said }
    }

    fn event(&self, event: &Event<'_>) {
        match event {
            Event::Failed(case, reason) => {
                let planned = &self.folder.cases[*case];
                let line = format!("campaign: {} {:?} failed: {reason}", planned.id, planned.factors);
                match &self.bar {
                    Some(bar) => bar.println(line),
                    None => self.console.message(&line),
                }
                return;
            }
            Event::GivenUp(_) => drop(self.given_up.fetch_add(1, Ordering::Relaxed)),
            Event::Done(_, Some(_)) => drop(self.here.fetch_add(1, Ordering::Relaxed)),
            Event::Done(_, None) => {}
        }
        let ended = 1 + self.ended.fetch_add(1, Ordering::Relaxed);
        let message = self.remaining(ended);
        if let Some(bar) = &self.bar {
            bar.set_position(ended as u64);
            bar.set_message(message);
            return;
        }
        let mut said = self.said.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if said.elapsed().as_secs_f64() > LINE_SECONDS {
            *said = Instant::now();
            self.console.message(&format!("campaign: {ended}/{} {message}", self.all));
        }
    }

    /// From the cases that were worked here: those of before took no time.
    fn remaining(&self, ended: usize) -> String {
        let here = self.here.load(Ordering::Relaxed);
        let seconds = self.begun.elapsed().as_secs_f64() / here.max(1) as f64 * (self.all - ended.min(self.all)) as f64;
        match here {
            0 => String::new(),
            _ if seconds < 120.0 => format!("about {seconds:.0} s left"),
            _ if seconds < 7200.0 => format!("about {:.0} min left", seconds / 60.0),
            _ => format!("about {:.1} h left", seconds / 3600.0),
        }
    }
}

impl Drop for Counter<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn status(folder: &Folder) -> anyhow::Result<Answer> {
    let states = folder.states()?;
    let count = |is: fn(&State) -> bool| states.iter().filter(|state| is(state)).count();
    let (done, open) = (count(|state| *state == State::Done), count(|state| *state == State::Open));
    let (taken, failed) = (count(|state| *state == State::Taken), count(|state| matches!(state, State::Failed(_))));
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for reason in states.iter().filter_map(|state| if let State::Failed(why) = state { Some(why) } else { None }) {
        match reasons.iter_mut().find(|(own, _)| own == reason) {
            Some((_, count)) => *count += 1,
            None => reasons.push((reason, 1)),
        }
    }
    reasons.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let all = states.len();
    let mut text = format!("{all} cases: {done} done, {failed} given up, {taken} taken, {open} open\n");
    for (reason, count) in reasons.iter().take(REASONS) {
        text += &format!("  {count} times: {reason}\n");
    }
    let of_reason = |(reason, count): &(&str, usize)| json!({ "reason": reason, "cases": count });
    let json = json!({
        "format": 1, "cases": all, "done": done, "given_up": failed, "taken": taken, "open": open,
        "reasons": reasons.iter().map(of_reason).collect::<Vec<Value>>(),
    });
    Ok(Answer { text, json, failure: None })
}

fn analyse(root: &Path, figure: &str) -> anyhow::Result<Answer> {
    let folder = open(root)?;
    let rows = gather::rows(&folder)?;
    let has_figure = |row: &Row| row.outcome.as_ref().is_some_and(|own| own.figures.contains_key(figure));
    if figure != FIGURE && !rows.iter().any(has_figure) {
        bail!(Usage(format!("--figure {figure}: no finished case has it; gather writes the columns that there are")));
    }
    let about = crate::campaign::grid::read(&root.join("grid.toml"))?.about;
    let to = root.join("analysis");
    std::fs::create_dir_all(&to).with_context(|| format!("{}: cannot be made", to.display()))?;
    page(&rows, &about, figure).write(&to)?;
    let tables = tables(&rows, figure);
    let text: String = tables.iter().map(|table| table.to_text() + "\n").collect();
    let of_table = |table: &crate::report::tables::Table| {
        let columns: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        json!({ "caption": table.caption, "columns": columns, "rows": table.rows, "notes": table.notes })
    };
    let json = json!({ "format": 1, "tables": tables.iter().map(of_table).collect::<Vec<Value>>() });
    Ok(Answer { text: text + &format!("Report: {}\n", to.join("report.html").display()), json, failure: None })
}
