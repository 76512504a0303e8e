//! `misclosure validate`: certified problems, for our solvers and for anybody's results.

use super::exit::{NotCertified, Usage};
use super::model_options::SolverChoice;
use super::output::writable_beside_blocks;
use super::text::path_text;
use super::{Answer, Console};
use crate::io::write_atomically;
use crate::report::numbers::{fixed, or_dash, significant};
use crate::report::tables::Table;
use crate::validate::nist;
use crate::validate::problems::{BundleProblem, Size, find, problems};
use crate::validate::solve::{Outcome, Verdict, certify_anew, solve};
use crate::validate::{judge, suite};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Checks the solvers, or the result of any program, on problems with a certified solution
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure validate                     every problem
  misclosure validate --quick             without the problems of thousands of images
  misclosure validate pair huber          these alone
  misclosure validate --nist DIR          the native solver's loop on NIST's regression sets, whose files are in DIR
  misclosure validate --suite DIR         writes the problems as blocks, and as COLMAP and BAL where these can express \
  them
  misclosure validate --judge DIR         digits of the results in DIR: a block, a run or a COLMAP model per problem

A digit is one of sigma: with 6, no value is off by more than a millionth of its standard deviation. The exit code is \
4 where a
result has fewer than asked for, or where what has no solution got one.")]
pub struct Arguments {
    /// Problems by name [default: all]
    #[arg(value_name = "PROBLEM")]
    problems: Vec<String>,
    /// Without the problems of thousands of images
    #[arg(long)]
    quick: bool,
    /// Which of our solvers
    #[arg(long, value_parser = SolverChoice::parser(), default_value = SolverChoice::DEFAULT)]
    solver: SolverChoice,
    /// Digits of sigma that a result needs
    #[arg(long, value_name = "N", default_value_t = crate::validate::solve::DIGITS)]
    digits: f64,
    /// Write the problems into this folder, for any program
    #[arg(long, value_name = "DIR", group = "what")]
    suite: Option<PathBuf>,
    /// Judge the results in this folder: DIR/PROBLEM, or DIR/PROBLEM/result
    #[arg(long, value_name = "DIR", group = "what")]
    judge: Option<PathBuf>,
    /// The regression sets of NIST in this folder (Misra1a.dat and 26 more), from both starting points
    #[arg(long, value_name = "DIR", group = "what")]
    nist: Option<PathBuf>,
    /// Compute the certificates anew, in extended precision, and write them into this folder
    #[arg(long, value_name = "DIR", group = "what")]
    certify: Option<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    if !(0.0..=16.0).contains(&arguments.digits) {
        return Err(Usage(format!("--digits {}: expected 0 to 16, doubles have no more", arguments.digits)).into());
    }
    if let Some(folder) = &arguments.nist {
        return regression(folder);
    }
    let chosen = chosen(arguments)?;
    match arguments {
        Arguments { suite: Some(folder), .. } => write_suite(&chosen, folder, console),
        Arguments { judge: Some(folder), .. } => judge_results(&chosen, folder, arguments, console),
        Arguments { certify: Some(folder), .. } => certify(&chosen, folder, console, threads),
        _ => solve_all(&chosen, arguments, console, threads),
    }
}

fn chosen(arguments: &Arguments) -> anyhow::Result<Vec<&'static BundleProblem>> {
    if arguments.problems.is_empty() {
        let wanted = |problem: &&BundleProblem| !arguments.quick || problem.size == Size::Small;
        return Ok(problems()?.iter().filter(wanted).collect());
    }
    arguments.problems.iter().map(|name| find(name).map_err(|error| Usage(error.to_string()).into())).collect()
}

fn solve_all(
    chosen: &[&BundleProblem],
    arguments: &Arguments,
    console: &Console,
    threads: usize,
) -> anyhow::Result<Answer> {
    let progress = console.progress("validate");
    let mut outcomes = Vec::new();
    for bundle in chosen {
        progress.step(&bundle.name);
        outcomes.extend(solve(bundle, &arguments.solver.solvers(), threads)?);
    }
    drop(progress);
    Ok(answer(&outcomes, arguments.digits))
}

/// Table, JSON and verdict of some outcomes.
fn answer(outcomes: &[Outcome], digits: f64) -> Answer {
    let mut table = Table::new("Digits of sigma that are correct")
        .text("problem", "")
        .text("solver", "")
        .number("digits", "")
        .number("worst value", "sigma")
        .number("all together", "sigma")
        .number("cost", "relative")
        .number("deviations", "relative")
        .number("steps", "")
        .number("time", "s")
        .text("", "");
    let short = |value: f64| format!("{value:.1e}");
    for outcome in outcomes {
        let Outcome { problem, solver, iterations, seconds, verdict } = outcome;
        let mut row = vec![problem.clone(), solver.clone()];
        let remark = match verdict {
            Verdict::Solved(score) => {
                row.extend([
                    fixed(score.digits, 1),
                    short(score.deviation),
                    short(score.distance),
                    short(score.cost),
                    or_dash(score.sigma, short),
                ]);
                if outcome.passes(digits) { String::new() } else { format!("not as certified: {}", score.worst) }
            }
            Verdict::NullSpace(count) => {
                row.extend(["-"; 5].map(String::from));
                format!("no solution, as certified: {count} directions")
            }
            Verdict::Failed(reason) => {
                row.extend(["-"; 5].map(String::from));
                reason.clone()
            }
        };
        row.push(iterations.map_or("-".into(), |steps| steps.to_string()));
        row.push(or_dash(*seconds, |seconds| significant(seconds, 2)));
        row.push(remark);
        table.row(row);
    }
    let missed: Vec<String> = outcomes
        .iter()
        .filter(|outcome| !outcome.passes(digits))
        .map(|outcome| format!("{} ({})", outcome.problem, outcome.solver))
        .collect();
    let passed = outcomes.len() - missed.len();
    let text = format!("{}\n{passed} of {} results have {digits} digits or more\n", table.to_text(), outcomes.len());
    let json = json!({ "format": 1, "digits_asked": digits, "passed": missed.is_empty(),
                       "results": outcomes.iter().map(|outcome| as_json(outcome, digits)).collect::<Vec<_>>() });
    let failure = (!missed.is_empty()).then(|| NotCertified(missed.join(", ")).into());
    Answer { text, json, failure }
}

fn as_json(outcome: &Outcome, digits: f64) -> Value {
    let Outcome { problem, solver, iterations, seconds, verdict } = outcome;
    let mut value = json!({ "problem": problem, "solver": solver, "passed": outcome.passes(digits),
                            "iterations": iterations, "seconds": seconds });
    match verdict {
        Verdict::Solved(score) => value["score"] = json!(score),
        Verdict::NullSpace(count) => value["null_dimension"] = json!(count),
        Verdict::Failed(reason) => value["failure"] = json!(reason),
    }
    value
}

fn judge_results(
    chosen: &[&BundleProblem],
    folder: &Path,
    arguments: &Arguments,
    console: &Console,
) -> anyhow::Result<Answer> {
    if !folder.is_dir() {
        return Err(Usage(format!("{}: no such folder", folder.display())).into());
    }
    let mut outcomes = Vec::new();
    for bundle in chosen.iter().filter(|bundle| !bundle.is_deficient()) {
        let Some(result) = judge::result_of(bundle, folder) else {
            // What is asked for by name has to be there.
            if !arguments.problems.is_empty() {
                return Err(Usage(format!("{}: no result of `{}`", folder.display(), bundle.name)).into());
            }
            continue;
        };
        let verdict = match judge::judge(bundle, &result) {
            Ok(score) => Verdict::Solved(score),
            Err(error) => Verdict::Failed(format!("{error:#}")),
        };
        let (problem, solver) = (bundle.name.clone(), "judged".to_owned());
        outcomes.push(Outcome { problem, solver, iterations: None, seconds: None, verdict });
    }
    if outcomes.is_empty() {
        let text = format!(
            "{}: no results; expected DIR/PROBLEM or DIR/PROBLEM/result with a block, a run or a COLMAP model",
            folder.display()
        );
        return Err(Usage(text).into());
    }
    console.message(&format!("{} of {} problems have a result", outcomes.len(), chosen.len()));
    Ok(answer(&outcomes, arguments.digits))
}

fn write_suite(chosen: &[&BundleProblem], folder: &Path, console: &Console) -> anyhow::Result<Answer> {
    writable_beside_blocks(folder, None)?;
    let progress = console.progress("suite");
    let mut table = Table::new("")
        .text("problem", "")
        .number("images", "")
        .number("points", "")
        .number("measurements", "")
        .text("also as", "")
        .text("what it is", "");
    let mut entries = Vec::new();
    for bundle in chosen.iter().filter(|bundle| !bundle.is_deficient()) {
        progress.step(&bundle.name);
        let entry = suite::write(bundle, &folder.join(&bundle.name))?;
        let formats = [(entry.colmap.is_some(), "COLMAP"), (entry.bal, "BAL")];
        let formats: Vec<&str> = formats.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
        let [images, points, measurements] = entry.sizes.map(|size| size.to_string());
        table.row([entry.name.clone(), images, points, measurements, formats.join(", "), entry.about.clone()]);
        entries.push(entry);
    }
    drop(progress);
    suite::write_list(&entries, folder)?;
    let text = format!("{}\nFolder: {}\n", table.to_text(), folder.display());
    Ok(Answer { text, json: json!({ "format": 1, "folder": path_text(folder), "problems": entries }), failure: None })
}

fn certify(chosen: &[&BundleProblem], folder: &Path, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    writable_beside_blocks(folder, None)?;
    let progress = console.progress("certify");
    let mut table = Table::new("").text("problem", "").number("cost", "").number("last step", "sigma").text("", "");
    let mut rows = Vec::new();
    for bundle in chosen {
        progress.step(&bundle.name);
        let certificate = certify_anew(bundle, threads)?;
        let path = folder.join(format!("{}.json", bundle.name));
        write_atomically(&path, certificate.to_text()?.as_bytes())?;
        let remark = match certificate.null_dimension {
            0 => String::new(),
            count => format!("no solution: {count} directions"),
        };
        let (cost, step) = (certificate.cost[0], certificate.last_step_sigma);
        table.row([bundle.name.clone(), format!("{cost:.11e}"), format!("{step:.0e}"), remark]);
        rows.push(json!({ "problem": bundle.name, "cost": cost, "last_step_sigma": step,
                          "null_dimension": certificate.null_dimension }));
    }
    drop(progress);
    let text = format!("{}\nFolder: {}\n", table.to_text(), folder.display());
    Ok(Answer { text, json: json!({ "format": 1, "certificates": rows }), failure: None })
}

fn regression(folder: &Path) -> anyhow::Result<Answer> {
    let outcomes = nist::run_all(folder)?;
    let mut table = Table::new("NIST's regression sets, by the loop of the native solver; 11 digits are certified")
        .text("set", "")
        .text("difficulty", "")
        .text("start", "")
        .number("digits", "")
        .number("of the deviations", "")
        .number("steps", "")
        .text("", "");
    for outcome in &outcomes {
        let start = if outcome.near { "near" } else { "far" };
        let steps = outcome.iterations.map_or("-".into(), |steps| steps.to_string());
        let asked = if outcome.counts() { "fewer than asked for" } else { "far start of a set of higher difficulty" };
        let remark = match (&outcome.contradiction, &outcome.failure, &outcome.other_minimum) {
            (Some((stated, found)), ..) => format!(
                "the file contradicts itself: its certified values have the sum of squares {found:.4e}, {stated:.4e} \
                 is stated"
            ),
            (None, Some(reason), _) => format!("{asked}: {reason}"),
            (None, None, Some((sum, certified))) => {
                format!("{asked}: another minimum, of the sum of squares {sum:.4e} (certified: {certified:.4e})")
            }
            (None, None, None) if outcome.passes() => String::new(),
            (None, None, None) => asked.to_owned(),
        };
        let numbers = [fixed(outcome.digits, 1), fixed(outcome.deviation_digits, 1), steps, remark];
        table.row([outcome.set.clone(), outcome.difficulty.to_string(), start.to_owned()].into_iter().chain(numbers));
    }
    let missed: Vec<String> = outcomes
        .iter()
        .filter(|outcome| outcome.counts() && !outcome.passes())
        .map(|outcome| format!("{} from the {} start", outcome.set, if outcome.near { "near" } else { "far" }))
        .collect();
    let json: Vec<Value> = outcomes
        .iter()
        .map(|o| {
            json!({ "set": o.set, "difficulty": o.difficulty.to_string(), "near": o.near, "digits": o.digits,
                    "deviation_digits": o.deviation_digits, "iterations": o.iterations, "failure": o.failure,
                    "other_minimum": o.other_minimum, "contradiction": o.contradiction, "counts": o.counts(),
                    "passed": o.passes() })
        })
        .collect();
    let json = json!({ "format": 1, "passed": missed.is_empty(), "sets": json });
    let failure = (!missed.is_empty()).then(|| NotCertified(missed.join(", ")).into());
    Ok(Answer { text: table.to_text(), json, failure })
}
