//! `misclosure simulate`: a block of a scenario, or the error-free twin of a real block, with its truth.

use super::output::{Output, usable};
use super::plan::mission::{MissionOptions, with_mission};
use super::text::{multiplicity, path_text};
use super::{Answer, Console, Usage};
use crate::block::Block;
use crate::io::block::{BLOCK_FILE, read_block, write_block};
use crate::report::numbers::{fixed, mm};
use crate::report::tables::Table;
use crate::scenario::{
    OverlapReport, Perturbation, Scenario, Simulation, SurveyNoise, add_noise, add_survey_noise, preset_names,
    preset_text, simulate, twin_of,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Simulates a block, or makes the error-free twin of a real one
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure simulate dike -o dike                            error-free
  misclosure simulate dike -o noisy --noise-px 0.3 --seed 7   with noise
  misclosure simulate corridor -o km --set length_m=1000      with a parameter of the scenario
  misclosure simulate my.toml -o mine                         a scenario of your own
  misclosure simulate dike -o km --mission survey.plan        the images of a planned mission
  misclosure simulate --from real -o twin                     the twin of a real block

The truth (cameras, poses, points, exact measurements) is written to truth/ inside the block;
no adjustment reads it.")]
pub struct Arguments {
    /// A preset (dike, corridor, mapping, closerange) or a scenario's file
    #[arg(value_name = "PRESET|SCENARIO.toml", required_unless_present = "from")]
    scenario: Option<PathBuf>,
    /// Make the twin of this block instead: its tie points are intersected and reprojected
    #[arg(long, value_name = "BLOCK", conflicts_with_all = ["scenario", "set"])]
    from: Option<PathBuf>,
    /// Folder of the new block
    #[arg(short, long, value_name = "BLOCK")]
    output: PathBuf,
    /// Seed of everything random; the same seed gives the same bytes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviation of the noise of each image coordinate, px
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    noise_px: f64,
    /// Give GNSS positions, control and check points errors of their stated standard deviations
    #[arg(long)]
    noise_survey: bool,
    /// A parameter of the scenario (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    mission: MissionOptions,
    #[command(flatten)]
    start: Start,
}

/// Wrong values to start an adjustment from; the measurements stay.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Wrong start values")]
struct Start {
    /// Multiply every focal length by one plus this
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0, allow_negative_numbers = true)]
    start_f: f64,
    /// Standard deviation of each coordinate of a projection centre, m
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    start_position: f64,
    /// Standard deviation of each component of a small rotation, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0)]
    start_angle: f64,
    /// Leave out the coordinates of the tie points: they have to be intersected
    #[arg(long)]
    start_without_points: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console) -> anyhow::Result<Answer> {
    let output = Output::of_block(&arguments.output, arguments.from.as_deref())?;
    arguments.mission.judge(arguments.from.as_deref())?;
    let mut simulation = match &arguments.from {
        Some(real) => {
            let loaded = read_block(real)?;
            if !loaded.set_aside.is_empty() {
                console.message(&format!("{}: set aside: {}", real.display(), loaded.set_aside));
            }
            twin_of(&loaded.block.about_its_centre())?
        }
        None => {
            // Clap asks for it where `--from` is absent.
            let base = scenario(arguments.scenario.as_deref().unwrap_or(Path::new("")), &arguments.set)?;
            let mission = arguments.mission.read(|| Ok(base.clone()))?;
            mission.as_ref().map(|mission| mission.told(console)).transpose()?;
            let scenario = with_mission(base, mission.as_ref())?;
            let progress = console.progress("simulate");
            progress.step(&format!("flying `{}`", scenario.name));
            simulate(&scenario, arguments.seed)?
        }
    };
    let truth = truth(&simulation);
    disturb(&mut simulation, arguments)?;
    let progress = console.progress("simulate");
    progress.step(&format!("writing {}", arguments.output.display()));
    output.write(&[], BLOCK_FILE, |dir| {
        write_block(&truth, &dir.join("truth"))?;
        write_block(&simulation.block, dir)?;
        usable(dir)
    })?;
    drop(progress);
    let mut text = text(&simulation.block, &simulation.report);
    text +=
        &format!("\nBlock: {}; its truth: {}\n", arguments.output.display(), arguments.output.join("truth").display());
    Ok(Answer { text, json: as_json(&simulation.block, &simulation.report), failure: None })
}

/// A preset, or a scenario's file; `set`: parameters as `KEY=VALUE`.
pub(super) fn scenario(path: &Path, set: &[String]) -> anyhow::Result<Scenario> {
    let overrides = overrides(set)?;
    let (text, name) = scenario_text(path)?;
    Ok(Scenario::from_toml_with(&text, &name, &overrides)?)
}

/// The text of a preset or of a scenario's file, and its name for messages.
pub(super) fn scenario_text(path: &Path) -> anyhow::Result<(String, String)> {
    let name = path_text(path);
    if let Some(text) = preset_text(&name) {
        return Ok((text.to_string(), name));
    }
    if !path.exists() && !name.ends_with(".toml") {
        let presets = preset_names().join(", ");
        return Err(Usage(format!("`{name}` is neither a preset ({presets}) nor a scenario's file")).into());
    }
    let text =
        crate::files::read_text(path).map_err(|error| Usage(format!("cannot read the scenario {name}: {error}")))?;
    Ok((text, name))
}

/// Parses `--set key=value`.
pub(super) fn overrides(settings: &[String]) -> Result<BTreeMap<String, f64>, Usage> {
    let parse = |setting: &String| {
        let (key, value) = setting.split_once('=')?;
        Some((key.trim().to_string(), value.trim().parse::<f64>().ok().filter(|value| value.is_finite())?))
    };
    let mut found = BTreeMap::new();
    for setting in settings {
        let (key, value) = parse(setting).ok_or_else(|| Usage(format!("--set {setting}: expected KEY=NUMBER")))?;
        if found.insert(key, value).is_some() {
            return Err(Usage(format!("--set {setting}: stands there twice")));
        }
    }
    Ok(found)
}

/// The true cameras, poses and points, with the error-free measurements: a block like any other.
fn truth(simulation: &Simulation) -> Block {
    let exact = &simulation.block;
    Block { ties: exact.ties.clone(), marks: exact.marks.clone(), ..simulation.truth.clone() }
}

fn disturb(simulation: &mut Simulation, arguments: &Arguments) -> anyhow::Result<()> {
    add_noise(&mut simulation.block, arguments.noise_px, arguments.seed)?;
    if arguments.noise_survey {
        let all = SurveyNoise { gnss: true, control: true, check: true };
        add_survey_noise(&mut simulation.block, all, arguments.seed);
    }
    let start = &arguments.start;
    let perturbation = Perturbation {
        focal_fraction: start.start_f,
        position_m: start.start_position,
        angle_rad: start.start_angle.to_radians(),
        points: start.start_without_points,
    };
    Ok(simulation.perturb_start(perturbation, arguments.seed)?)
}

fn text(block: &Block, report: &OverlapReport) -> String {
    let mut text = format!(
        "Simulated `{}`: {} images, {} tie points with {} measurements, {} surveyed points with {} marks\n\n",
        block.name,
        block.images.len(),
        block.tie_points.len(),
        report.ties,
        block.surveyed.len(),
        report.marks,
    );
    if !report.flights.is_empty() {
        let mut flights = (Table::new("").text("flight", ""))
            .number("images", "")
            .number("strips", "")
            .number("pixel on ground", "mm")
            .number("base", "m")
            .number("forward overlap", "%")
            .number("side overlap", "%");
        for flight in &report.flights {
            let percent = |part: Option<f64>| part.map_or("-".into(), |part| fixed(100.0 * part, 0));
            flights.row([
                flight.flight.clone(),
                flight.images.to_string(),
                flight.strips.to_string(),
                mm(flight.gsd_m),
                flight.base_m.map_or("-".into(), |base| fixed(base, 1)),
                percent(flight.forward_overlap),
                percent(flight.side_overlap),
            ]);
        }
        text += &flights.to_text();
        text.push('\n');
    }
    text += &multiplicity(report.mean_multiplicity(), &report.multiplicity);
    text += &match report.least_ties_per_image {
        0 => "At least one image has no tie point.\n".to_owned(),
        least => format!("No image has fewer than {least} tie point{}.\n", if least == 1 { "" } else { "s" }),
    };
    let dropped = &report.dropped;
    if dropped.total() > 0 {
        text += &format!(
            "Points left out of the twin: {} with fewer than two rays, {} without an intersection, {} behind a camera, \
             {} that leave a sensor\n",
            dropped.too_few_rays, dropped.no_intersection, dropped.behind, dropped.outside
        );
    }
    text
}

fn as_json(block: &Block, report: &OverlapReport) -> Value {
    let flights = report.flights.iter().map(|flight| {
        json!({ "flight": flight.flight, "images": flight.images, "strips": flight.strips, "gsd_m": flight.gsd_m,
                "base_m": flight.base_m, "forward_overlap": flight.forward_overlap,
                "side_overlap": flight.side_overlap })
    });
    let dropped = &report.dropped;
    json!({
        "format": 1, "block": block.name, "images": block.images.len(), "flights": flights.collect::<Vec<_>>(),
        "tie_points": block.tie_points.len(), "tie_measurements": report.ties, "surveyed": block.surveyed.len(),
        "marks": report.marks, "multiplicity": report.multiplicity, "mean_multiplicity": report.mean_multiplicity(),
        "least_ties_per_image": report.least_ties_per_image,
        "dropped": { "too_few_rays": dropped.too_few_rays, "no_intersection": dropped.no_intersection,
                     "behind": dropped.behind, "outside": dropped.outside },
    })
}
