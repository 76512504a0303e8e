//! `misclosure reproduce`: the published study, its tables and figures beside ours.

use super::exit::Disagreement;
use super::model_options::SolverChoice;
use super::output::writable_beside_blocks;
use super::{Answer, Console};
use crate::effects::literature::STUDY;
use crate::io::table::write_json;
use crate::report::numbers::fixed;
use crate::study::page::{Finding, Question, findings, findings_table, page, questions};
use crate::study::{Event, Outcome, Results, Simulations, Store, cases, run as run_cases};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Characters of a line of text.
const LINE: usize = 80;

/// Repeats a published study and prints its tables and figures beside the published ones
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure reproduce calibration-error -o study                    everything
  misclosure reproduce calibration-error -o study --part published   S0 to S4 alone

The report is study/report.html. Each finished case is kept in study/cases: what was killed goes on where it was.")]
pub struct Arguments {
    /// Which study
    study: Study,
    /// Folder of the report and of the finished cases
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// How much of it
    #[arg(long, default_value = "all")]
    part: Part,
    /// Which solvers adjust each case
    #[arg(long, value_parser = SolverChoice::parser(), default_value = SolverChoice::DEFAULT)]
    solver: SolverChoice,
}

/// The studies that there are.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Study {
    /// Influence of camera calibration errors on a corridor block.
    CalibrationError,
}

/// Parts of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// What is published: S0 to S4.
    Published,
    /// And what was left open there.
    All,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let Study::CalibrationError = arguments.study;
    writable_beside_blocks(&arguments.output, None)?;
    let mut cases = cases::published();
    if arguments.part == Part::All {
        cases.extend(cases::answers());
    }
    let solvers = arguments.solver.solvers();
    let names: Vec<&str> = solvers.iter().map(|solver| solver.name()).collect();
    let store = Store::open(&arguments.output.join("cases"), &format!("{} {}", program()?, names.join(" ")))?;
    let counter = Counter::new(console, cases.len());
    let outcomes = run_cases(&cases, &store, &solvers, threads, &|event| counter.event(event))?;
    drop(counter);
    let results = Results::new(&cases, outcomes);
    let (findings, questions) = (findings(&results)?, questions(&results)?);
    let simulation = Simulations::default().of(&cases[0])?;
    page(&results, &simulation)?.write(&arguments.output)?;
    let json = as_json(&results, &findings, &questions);
    write_json(&arguments.output.join("study.json"), &json)?;
    let apart: Vec<&str> = results.iter().filter(|(_, outcome)| outcome.disagrees()).map(|(key, _)| key).collect();
    let failure = (!apart.is_empty()).then(|| Disagreement(format!("in {}", apart.join(", "))).into());
    Ok(Answer { text: text(&findings, &questions, &arguments.output), json, failure })
}

/// What stands for this program: a result of another build is not taken for one of this.
fn program() -> anyhow::Result<String> {
    let path = std::env::current_exe().context("cannot find this program")?;
    let file = std::fs::metadata(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let changed = file.modified()?.duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    Ok(format!("{} {} {}", env!("CARGO_PKG_VERSION"), file.len(), changed.as_nanos()))
}

/// Counts the cases on standard error: a bar on a terminal, a line per case elsewhere.
struct Counter<'a> {
    console: &'a Console,
    bar: Option<ProgressBar>,
    cases: usize,
    done: AtomicUsize,
    /// Where there is no bar: says now and then that it goes on.
    heartbeat: Option<Heartbeat>,
}

impl<'a> Counter<'a> {
    fn new(console: &'a Console, cases: usize) -> Self {
        let bar = console.is_live().then(|| {
            let template = "{spinner} reproduce [{elapsed_precise}] {bar:30} {pos}/{len} {wide_msg}";
            let style = ProgressStyle::with_template(template).expect("constant template");
            let bar = ProgressBar::new(cases as u64).with_style(style);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        let heartbeat = bar.is_none().then(|| Heartbeat::start(*console));
        Self { console, bar, cases, done: AtomicUsize::new(0), heartbeat }
    }

    fn event(&self, event: Event<'_>) {
        let line = match event {
            Event::Started(case) => return self.show(&case.key),
            Event::Kept(case) => format!("{}: kept", case.key),
            Event::Finished(case, outcome, seconds) => {
                format!("{}: {} in {} s", case.key, ending(outcome), fixed(seconds, 1))
            }
        };
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        match &self.bar {
            Some(bar) => {
                bar.inc(1);
                bar.set_message(line);
            }
            None => self.console.message(&format!("reproduce: {done}/{} {line}", self.cases)),
        }
    }

    fn show(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.set_message(text.to_string()),
            None => self.console.message(&format!("reproduce: {text}: begins")),
        }
    }
}

impl Drop for Counter<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        drop(self.heartbeat.take());
    }
}

/// Seconds between two signs of life: a case of the study takes minutes.
const SILENT_SECONDS: u64 = 30;

/// A thread that says every [`SILENT_SECONDS`] how long the command has been at work.
struct Heartbeat {
    end: mpsc::Sender<()>,
    thread: Option<JoinHandle<()>>,
}

impl Heartbeat {
    fn start(console: Console) -> Self {
        let (end, ended) = mpsc::channel();
        let begun = Instant::now();
        let thread = std::thread::spawn(move || {
            while ended.recv_timeout(Duration::from_secs(SILENT_SECONDS)) == Err(mpsc::RecvTimeoutError::Timeout) {
                console.message(&format!("reproduce: at work for {} s", begun.elapsed().as_secs()));
            }
        });
        Self { end, thread: Some(thread) }
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        // It is gone already where its thread has ended.
        let _ = self.end.send(());
        self.thread.take().map(JoinHandle::join);
    }
}

fn ending(outcome: &Outcome) -> &'static str {
    match outcome {
        _ if outcome.disagrees() => "the solvers disagree",
        Outcome::Adjusted(_) => "done",
        Outcome::Impossible { .. } => "cannot be adjusted",
    }
}

fn text(findings: &[Finding], questions: &[Question], output: &Path) -> String {
    let mut text = findings_table(findings).to_text();
    for question in questions {
        text.push_str(&format!("\n{}\n    {}\n", question.question, question.answer));
    }
    let study = textwrap::fill(&format!("Study: {STUDY}"), LINE);
    format!("{text}\n{study}\nReport: {}\n", output.join("report.html").display())
}

fn as_json(results: &Results, findings: &[Finding], questions: &[Question]) -> Value {
    let findings = findings.iter().map(|finding| {
        json!({ "statement": finding.statement, "published": finding.published, "ours": finding.ours,
                "agrees": finding.agrees })
    });
    let questions =
        questions.iter().map(|question| json!({ "question": question.question, "answer": question.answer }));
    let case = |outcome: &Outcome| match outcome {
        Outcome::Impossible { reason, .. } => json!({ "impossible": reason }),
        Outcome::Adjusted(case) => {
            // What pictures need stands in the files of the cases.
            let mut value = serde_json::to_value(case).unwrap_or_default();
            if let Some(object) = value.as_object_mut() {
                object.remove("pictures");
            }
            value
        }
    };
    let cases: serde_json::Map<String, Value> =
        results.iter().map(|(key, outcome)| (key.to_string(), case(outcome))).collect();
    json!({ "format": 1, "study": "calibration-error", "findings": findings.collect::<Vec<_>>(),
            "questions": questions.collect::<Vec<_>>(), "cases": cases })
}
