//! The pictures of docs/how-it-decides.md, from blocks that it simulates: `cargo run --release --example
//! how_it_decides` writes them to docs/.
//!
//! 1. The objective along a search, two causes in one block.
//! 2. Hypotheses that look alike: what each of them alone would explain.
//! 3. Noise alone: p-values of all candidates are uniform.
//! 4. Power against size: how often a cause is found.

use misclosure::adjust::Options;
use misclosure::block::Block;
use misclosure::diagnose::verdict::{Diagnosis, LedgerRow};
use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::inject;
use misclosure::model::{Datum, Model};
use misclosure::report::figures::{Axis, LineChart, LineStyle, Panel, Series, line_chart};
use misclosure::scenario::{Scenario, SurveyNoise, add_survey_noise, simulate};
use std::error::Error;
use std::fs::write;

/// Blocks of noise alone: p-values of some forty candidates each.
const NOISE_BLOCKS: u64 = 60;
/// Blocks for each size of the cause.
const POWER_BLOCKS: u64 = 12;
/// Readout times of the rolling shutter, ms.
const READOUTS_MS: [f64; 7] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0];
/// Candidates in the second picture.
const BARS: usize = 12;

fn main() -> Result<(), Box<dyn Error>> {
    let truth = dike()?;
    let both = diagnosed(&measured(&truth, &["rolling-shutter:readout=0.02", "focal-growth"], 1)?)?;
    write("docs/how-it-decides-search.svg", search(&both))?;
    let growth = diagnosed(&measured(&truth, &["focal-growth"], 1)?)?;
    write("docs/how-it-decides-alike.svg", alike(&growth))?;
    write("docs/how-it-decides-noise.svg", noise(&truth)?)?;
    write("docs/how-it-decides-power.svg", power(&truth)?)?;
    println!("docs/how-it-decides-{{search,alike,noise,power}}.svg");
    Ok(())
}

/// A small dike without errors.
fn dike() -> Result<Block, Box<dyn Error>> {
    let scenario = Scenario::preset("dike", &[("points".to_string(), 600.0), ("check".to_string(), 20.0)].into())?;
    Ok(simulate(&scenario, 1)?.block)
}

/// The block measured anew under some errors, with noise of images and survey.
fn measured(truth: &Block, errors: &[&str], seed: u64) -> Result<Block, Box<dyn Error>> {
    let errors = errors.iter().chain(&["noise:px=0.3"]).map(|error| inject::parse(error));
    let errors: Vec<_> = errors.collect::<Result<_, _>>()?;
    let mut block = inject::apply(truth, truth, &errors, seed)?.block;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, seed);
    Ok(block)
}

fn diagnosed(block: &Block) -> Result<Diagnosis, Box<dyn Error>> {
    let settings =
        Settings { plugins: &[], options: Options::default(), significance: 1e-3, snoop: true, tell: &|_| {} };
    Ok(diagnose(block, &Model { datum: Datum::All, ..Model::default() }, &settings)?.diagnosis)
}

fn chart(title: &str, x: Axis, y: Axis, series: Vec<Series>, note: String) -> String {
    let panel = Panel { x, y, series, ..Panel::default() };
    line_chart(&LineChart { title: title.into(), panels: vec![panel], columns: 1, note, width: None })
}

/// The objective along the ledger.
fn search(diagnosis: &Diagnosis) -> String {
    let points = diagnosis.ledger.iter().map(|row| [row.step as f64, row.objective]).collect();
    let added = |row: &LedgerRow| row.added.clone().unwrap_or_else(|| "base".into());
    let steps: Vec<String> = diagnosis.ledger.iter().map(|row| format!("{}: {}", row.step, added(row))).collect();
    let note =
        format!("A dike with a rolling shutter of 20 ms and a focal length that grows. Steps: {}.", steps.join("; "));
    let series = vec![Series::new("objective", points)];
    chart("The objective falls with every step", Axis::new("step", ""), Axis::new("J", ""), series, note)
}

/// What each candidate alone would explain.
fn alike(diagnosis: &Diagnosis) -> String {
    let mut best: Vec<(f64, &str)> =
        diagnosis.candidates.iter().map(|own| (own.predicted_drop, own.effect.as_str())).collect();
    best.retain(|(drop, _)| drop.is_finite());
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(BARS);
    let points = best.iter().enumerate().map(|(k, (drop, _))| [k as f64 + 1.0, *drop]).collect();
    let names: Vec<String> = best.iter().enumerate().map(|(k, (_, name))| format!("{} {name}", k + 1)).collect();
    let note = format!("A dike whose focal length grows. {}.", names.join(", "));
    let series = vec![Series::new("alone", points).style(LineStyle::Markers)];
    chart("What each hypothesis alone explains", Axis::new("rank", ""), Axis::new("fall of v'Pv", ""), series, note)
}

/// Sorted p-values of all candidates against what is expected of uniform ones.
fn noise(truth: &Block) -> Result<String, Box<dyn Error>> {
    let mut p_values = Vec::new();
    let mut adequate = 0;
    for seed in 1..=NOISE_BLOCKS {
        let diagnosis = diagnosed(&measured(truth, &[], seed)?)?;
        adequate += usize::from(diagnosis.recommended.is_empty());
        let tested = diagnosis.candidates.iter().filter(|own| own.tested && own.kind == "physical");
        p_values.extend(tested.map(|own| own.p_value).filter(|p| p.is_finite()));
    }
    p_values.sort_by(f64::total_cmp);
    let n = p_values.len() as f64;
    let points = p_values.iter().enumerate().map(|(k, p)| [(k as f64 + 0.5) / n, *p]).collect();
    let line = Series::new("uniform", vec![[0.0, 0.0], [1.0, 1.0]]).style(LineStyle::Line);
    let note = format!(
        "{NOISE_BLOCKS} dikes of noise alone, {n} p-values; no cause named in {adequate}. Bounds (searched ranges, \
         variances) lie above the line."
    );
    let series = vec![Series::new("candidates", points).style(LineStyle::Line), line];
    Ok(chart("Noise alone: p-values", Axis::new("share of the candidates", ""), Axis::new("p-value", ""), series, note))
}

/// How often a rolling shutter is found.
fn power(truth: &Block) -> Result<String, Box<dyn Error>> {
    let mut points = Vec::new();
    for readout in READOUTS_MS {
        let mut found = 0;
        for seed in 1..=POWER_BLOCKS {
            let error = format!("rolling-shutter:readout={}", 1e-3 * readout);
            let errors: &[&str] = if readout > 0.0 { &[&error] } else { &[] };
            let diagnosis = diagnosed(&measured(truth, errors, 1000 + seed)?)?;
            found += u32::from(diagnosis.recommended == ["rolling-shutter"]);
        }
        points.push([readout, f64::from(found) / POWER_BLOCKS as f64]);
    }
    let note = format!("{POWER_BLOCKS} dikes of 600 tie points for each readout time, noise of 0.3 px.");
    let series = vec![Series::new("found, and nothing beside", points)];
    Ok(chart("Power: a rolling shutter", Axis::new("readout", "ms"), Axis::new("share found", ""), series, note))
}
