//! `misclosure lab`: the laboratory, a page of this machine alone.

use super::host::Live;
use super::model_options::{ModelOptions, Treatment};
use super::output::{may_be_laboratory, usable};
use super::simulate::scenario_text;
use super::{Answer, Console, Usage};
use crate::adjust::Options;
use crate::block::Block;
use crate::files::scratch::Scratch;
use crate::inject;
use crate::io::block::{fingerprint, read_block};
use crate::lab::photos::Photos;
use crate::lab::planning::Planning;
use crate::lab::server::Server;
use crate::lab::setup::Setup;
use crate::lab::simulated::Simulated;
use crate::lab::tree::Folder;
use crate::model::Datum;
use crate::run;
use crate::scenario::{Scenario, simulate};
use anyhow::Context;
use maud::{DOCTYPE, html};
use serde_json::json;
use std::collections::BTreeMap;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Significance level: the probability that a block without any misfit gets a finding.
const SIGNIFICANCE: f64 = 0.001;
/// In the folder of the laboratory: leads a browser to the address.
const OPENING: &str = "open.html";
/// Errors of a simulated block until others are chosen.
const FIRST_ERRORS: [&str; 1] = ["noise:px=0.3"];

/// Opens the laboratory, a local web page: see where a model fails, add effects, watch the error fall
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure lab block                       opens a page in the browser; every step is kept in block.lab
  misclosure lab block --datum control       begins with another model
  misclosure lab block --no-open --port 8000 prints the address alone
  misclosure lab block --images flight       shows the images in that folder behind the residuals
  misclosure lab --simulate dike             a simulated block whose errors are chosen on the page
  misclosure lab --plan mapping              a flight that is planned with sliders: what it would show

The page is for this machine alone: the address carries a token that every request needs. Each step is the complete
folder of a run, which `misclosure report` reads. Ending the program loses nothing.")]
pub struct Arguments {
    /// Folder of the block
    #[arg(required_unless_present_any = ["simulate", "plan"])]
    block: Option<PathBuf>,
    /// Folder of the steps [default: the block's name with .lab, beside the block]
    #[arg(short, long, value_name = "FOLDER", conflicts_with = "plan")]
    output: Option<PathBuf>,
    /// Port on 127.0.0.1 [default: any that is free]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    port: u16,
    /// Print the address, open no browser
    #[arg(long)]
    no_open: bool,
    /// Folder with the block's images (JPEG, PNG or WebP, called as in the block): shown behind residuals and marks
    #[arg(long, value_name = "FOLDER", conflicts_with = "drawn")]
    images: Option<PathBuf>,
    /// A simulated block: dike, corridor, mapping or closerange
    #[arg(long, value_name = "PRESET", conflicts_with = "block", group = "drawn")]
    simulate: Option<String>,
    /// A scenario on sliders, a preset or a file: what it would show before it is flown
    #[arg(long, value_name = "SCENARIO", conflicts_with = "block", group = "drawn")]
    plan: Option<PathBuf>,
    /// Error of the first measurement of a simulated block, as `inject --error` takes it (repeatable) [default:
    /// noise:px=0.3]
    #[arg(long = "error", value_name = "ID[:key=value,...]", requires = "simulate", conflicts_with = "plan")]
    errors: Vec<String>,
    /// Mistake of a person in the files of a simulated block, as `inject --mistake` takes it (repeatable)
    #[arg(long = "mistake", value_name = "KIND[:key=value,...]", requires = "simulate", conflicts_with = "plan")]
    mistakes: Vec<String>,
    /// Seed of a simulated block, or of a plan
    #[arg(long, default_value_t = 1, requires = "drawn")]
    seed: u64,
    /// Significance level: the probability that a block without any misfit gets a finding
    #[arg(long, default_value_t = SIGNIFICANCE, value_name = "P")]
    significance: f64,
    #[command(flatten)]
    model: ModelOptions,
}

/// Runs the command, until the program is ended.
pub fn run(arguments: &Arguments, console: &Console, threads: usize, as_json: bool) -> anyhow::Result<Answer> {
    if !(arguments.significance > 0.0 && arguments.significance < 0.5) {
        let text = format!("--significance {}: expected a probability above 0 and below 0.5", arguments.significance);
        return Err(Usage(text).into());
    }
    if let Some(scenario) = &arguments.plan {
        let server = Server::of_plan(planning(scenario, arguments, threads)?, arguments.port)?;
        console.message("lab: end with Ctrl-C");
        // Nothing is kept: the page that leads to the address goes with the program.
        let folder = Scratch::new_in(&std::env::temp_dir())?;
        return served(server, &folder.path().join(OPENING), arguments, console, as_json);
    }
    let (source, read, simulated) = match (&arguments.block, &arguments.simulate) {
        (Some(block), _) => (block.clone(), read(block, console)?, None),
        (None, Some(preset)) => {
            let simulated = simulated(preset, arguments)?;
            (PathBuf::from(format!("simulate:{preset}")), simulated.truth.clone(), Some(simulated))
        }
        (None, None) => return Err(Usage("the folder of a block is missing".into()).into()),
    };
    let folder = arguments.output.clone().unwrap_or_else(|| beside(&source, arguments.simulate.as_deref()));
    may_be_laboratory(&folder, arguments.block.as_deref())?;
    let sha256 = match &simulated {
        None => fingerprint(&source)?,
        Some(simulated) => {
            // The truth as it would stand in files: seed, preset, mistakes and this program's way to fly are in it.
            let written = tempfile::tempdir()?;
            simulated.write_truth(written.path()).map_err(|refused| Usage(format!("--mistake: {refused:#}")))?;
            if !simulated.mistakes.is_empty() {
                usable(written.path())?;
            }
            fingerprint(written.path())?
        }
    };
    let folder = Folder::open(&folder, &source, &sha256).map_err(|error| Usage(format!("{error:#}")))?;
    let host = Live::new(console, "lab");
    let (left, set_aside) = arguments.model.without_outliers(read.clone(), &host)?;
    let model = arguments.model.model(run::default_diagnosis_datum(&left))?;
    let options = Options { threads, ..Options::default() };
    arguments.model.judge_start(&left, &model, &host)?;
    let (block, model) = arguments.model.started(read, model, &options, &|what| console.message(what))?;
    let names: Vec<&str> = block.images.iter().map(|image| image.name.as_str()).collect();
    let photos = arguments.images.as_deref().map(|folder| Photos::find(folder, &names));
    let photos = photos.transpose().map_err(|refused| Usage(format!("--images {refused:#}")))?;
    if let Some(photos) = &photos {
        console.message(&format!("lab: {} of {} images found", photos.count(), block.images.len()));
    }
    let setup = Setup {
        source,
        block,
        set_aside,
        model: crate::model::Model { datum: arguments.model.datum.unwrap_or(model.datum), ..model },
        plugins: arguments.model.plugin_effects()?,
        solvers: arguments.model.solvers(),
        snoop: arguments.model.outliers.unwrap_or(Treatment::Snoop) == Treatment::Snoop,
        significance: arguments.significance,
        threads,
        folder,
        simulated,
        photos,
    };
    let page = setup.folder.path().join(OPENING);
    console.message(&format!("lab: every step is kept in {}; end with Ctrl-C", setup.folder.path().display()));
    served(Server::of_lab(setup, arguments.port)?, &page, arguments, console, as_json)
}

/// Says the address, opens a browser, and answers until the program is ended.
fn served(
    server: Server,
    page: &Path,
    arguments: &Arguments,
    console: &Console,
    as_json: bool,
) -> anyhow::Result<Answer> {
    let address = server.address();
    let mut out = std::io::stdout().lock();
    match as_json {
        true => writeln!(out, "{}", json!({ "address": address }))?,
        false => writeln!(out, "{address}")?,
    }
    out.flush()?;
    drop(out);
    if !arguments.no_open && !opened(page, &address)? {
        console.message("lab: no browser was found; open the address yourself");
    }
    server.serve()?;
    Ok(Answer::default())
}

/// The scenario of a plan on sliders, and how it will be diagnosed.
fn planning(scenario: &Path, arguments: &Arguments, threads: usize) -> anyhow::Result<Planning> {
    let ModelOptions { free, tie, datum, .. } = arguments.model.clone();
    if arguments.model != (ModelOptions { free, tie, datum, ..ModelOptions::default() }) {
        return Err(Usage("--plan: of the model options, --free, --tie and --datum alone".into()).into());
    }
    let (text, name) = scenario_text(scenario)?;
    Scenario::from_toml(&text, &name)?;
    // Its datum is chosen when the block is there.
    let model = arguments.model.model(Datum::All)?;
    let mut command = format!("misclosure plan {name}");
    if arguments.seed != 1 {
        command += &format!(" --seed {}", arguments.seed);
    }
    if arguments.significance != SIGNIFICANCE {
        command += &format!(" --significance {}", arguments.significance);
    }
    arguments.model.free.iter().for_each(|free| command += &format!(" --free {free}"));
    command += if tie.is_some() { " --tie dc=pp" } else { "" };
    let (seed, significance) = (arguments.seed, arguments.significance);
    Ok(Planning { text, name, seed, model, datum, significance, threads, command })
}

fn read(block: &Path, console: &Console) -> anyhow::Result<Block> {
    let loaded = read_block(block)?;
    if !loaded.set_aside.is_empty() {
        console.message(&format!("{}: set aside: {}", block.display(), loaded.set_aside));
    }
    Ok(loaded.block.about_its_centre())
}

fn simulated(preset: &str, arguments: &Arguments) -> anyhow::Result<Simulated> {
    let scenario = Scenario::preset(preset, &BTreeMap::new())?;
    let truth = simulate(&scenario, arguments.seed)?.block;
    let errors = match arguments.errors.is_empty() {
        true => FIRST_ERRORS.map(String::from).to_vec(),
        false => arguments.errors.clone(),
    };
    for error in &errors {
        inject::parse(error).map_err(|refused| Usage(format!("--error {error}: {refused:#}")))?;
    }
    let mistakes = arguments.mistakes.clone();
    for mistake in &mistakes {
        inject::mistakes::parse(mistake).map_err(|refused| Usage(format!("--mistake {mistake}: {refused:#}")))?;
    }
    Ok(Simulated { preset: preset.into(), truth, errors, seed: arguments.seed, mistakes })
}

/// The folder of a laboratory that nobody named.
fn beside(block: &Path, preset: Option<&str>) -> PathBuf {
    if let Some(preset) = preset {
        return PathBuf::from(format!("{preset}.lab"));
    }
    // `.` has a name, too.
    let block = block.canonicalize().unwrap_or_else(|_| block.to_owned());
    let mut name = block.file_name().unwrap_or_default().to_owned();
    name.push(".lab");
    block.with_file_name(name)
}

/// Opens the address in a browser; was there one? Everybody on this machine sees the arguments of a program: it gets a
/// page that leads to the address, and that nobody else can read.
fn opened(page: &Path, address: &str) -> anyhow::Result<bool> {
    let text = html! {
        (DOCTYPE)
        meta charset="utf-8";
        meta name="referrer" content="no-referrer";
        title { "misclosure lab" }
        meta http-equiv="refresh" content={ "0; url=" (address) };
        a href=(address) { "The laboratory" }
    };
    let context = || format!("{}: cannot write", page.display());
    match std::fs::remove_file(page) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error).with_context(context),
        _ => {}
    }
    let mut file =
        std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(page).with_context(context)?;
    file.write_all(text.0.as_bytes()).with_context(context)?;
    let openers: &[&str] = if cfg!(target_os = "macos") { &["open"] } else { &["xdg-open"] };
    Ok(openers.iter().any(|opener| {
        let mut command = Command::new(opener);
        command.arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().is_ok()
    }))
}
