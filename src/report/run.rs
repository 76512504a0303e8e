//! The page of a run: what was adjusted, how well it fits, and, after a diagnosis, what was missing.

use super::coverage;
pub use super::coverage::Coverage;
use super::figures::{
    PlanArrows, PlanSigned, flights_plan_profile, histogram, image_bars, line_chart, residuals_plan_arrows,
    residuals_plan_signed,
};
use super::finding::finding;
use super::html::Page;
use super::numbers::{fixed, or_dash, px, significant};
use super::pictures::{GnssAgainst, RunFolder};
use super::run_tables::{
    Conclusion, camera_table, compared, effects_table, one_solver, residuals_table, solvers_table, solvers_verdict,
};
use super::sensor_section::sensor_figures;
use super::tables::Table;
use super::{detectable, diagnosis, geojson, glossary, letter, pictures, points, provenance, uncertainty};
use crate::block::Block;
use crate::diagnose::pictures::Shown;
use crate::diagnose::verdict::Diagnosis;
use crate::model::Model;
use crate::run::folder::{self, CheckRow, OutlierRow};
use crate::run::summary::Summary;
use crate::run::{Run, TieResiduals, gnss_residuals, residual_rows};
use anyhow::Result;
use std::path::Path;

/// A distribution of fewer values is no picture.
const FEWEST_FOR_HISTOGRAM: usize = 50;

/// One page of a run, for the client.
pub const CLIENT: &str = "client.html";

/// Reads the folder of a run and writes its `report.html` and `figures/`, and its places on the globe; `client`:
/// [`CLIENT`], too.
///
/// # Errors
/// A file that is missing, cannot be read or cannot be written.
pub fn write_page(dir: &Path, client: bool) -> Result<()> {
    let run = RunFolder::read(dir)?;
    let ties = TieResiduals::read(dir, &run.images)?;
    let page = page(&run, ties, &Coverage::read(dir)?);
    page.write(dir)?;
    geojson::write(&run, dir)?;
    if client {
        folder::write_atomically(&dir.join(CLIENT), page.client().as_bytes())?;
    }
    Ok(())
}

/// As [`write_page`], where the residuals of the run are at hand.
///
/// # Errors
/// As [`write_page`].
pub fn write_page_of(dir: &Path, ties: TieResiduals) -> Result<()> {
    let run = RunFolder::read(dir)?;
    page(&run, ties, &Coverage::read(dir)?).write(dir)?;
    geojson::write(&run, dir)
}

/// The folder of a run that was diagnosed, to be written.
pub struct Diagnosed<'a> {
    /// Folder of the block that was read; `None` of a block that lies in none.
    pub source: Option<&'a Path>,
    /// The block without what is set aside.
    pub block: &'a Block,
    /// The model that is handed on.
    pub model: &'a Model,
    /// Its adjustment.
    pub run: &'a Run,
    /// What is set aside.
    pub outliers: Vec<OutlierRow>,
    /// What was found.
    pub diagnosis: &'a Diagnosis,
    /// Its pictures.
    pub shown: Shown<'a>,
}

impl Diagnosed<'_> {
    /// Writes everything that the folder of a run has into `dir`.
    ///
    /// # Errors
    /// A model that cannot be projected; a file that cannot be written.
    pub fn write(self, dir: &Path) -> Result<()> {
        let Self { source, block, model, run, outliers, diagnosis, shown } = self;
        let (state, comparison) = (&run.solution().state, run.comparison.as_ref());
        let rows = residual_rows(block, &run.problem, state, comparison)?;
        let gnss = gnss_residuals(block, &run.problem, state, comparison)?;
        folder::write(dir, block, model, run, &rows, &gnss)?;
        let ties = TieResiduals::of(block, &rows);
        // Of millions of measurements: they are not needed any more.
        drop(rows);
        folder::write_outliers(dir, outliers)?;
        if let Some(source) = source {
            folder::write_source(dir, source, &block.crs)?;
        }
        folder::write_diagnosis(dir, diagnosis, shown.rows()?)?;
        write_page_of(dir, ties)
    }
}

/// The page of a run with these residuals and this coverage.
pub fn page(run: &RunFolder, ties: TieResiduals, coverage: &Coverage) -> Page {
    let what = if run.diagnosis.is_some() { "Diagnosis" } else { "Adjustment" };
    let mut page = Page::new(format!("{what} of the block {}", run.summary.block));
    page.subtitle(&contents(run)).provenance(&provenance::short(run));
    finding(&mut page, run);
    if let Some(found) = &run.diagnosis {
        letter::letter(&mut page, run, found);
        diagnosis::left(&mut page, found);
    }
    checks_section(&mut page, run);
    if let Some(found) = &run.diagnosis {
        let lengths = found.has_lengths(run.summary.has_scale());
        diagnosis::ledger_section(&mut page, found, lengths);
        diagnosis::how(&mut page, found);
        diagnosis::structure(&mut page, run, found);
        diagnosis::candidates(&mut page, found, lengths);
        detectable::section(&mut page, found, lengths);
    }
    adjustment(&mut page, run);
    parameters(&mut page, run);
    if run.diagnosis.is_none() {
        page.section("Residuals over the sensor");
        sensor_figures(&mut page, run);
    }
    image_section(&mut page, run, ties);
    block_section(&mut page, run);
    coverage::section(&mut page, run, coverage);
    gnss_section(&mut page, run);
    glossary::literature(&mut page, run);
    glossary::section(&mut page);
    page
}

/// What the block has.
fn contents(run: &RunFolder) -> String {
    let counted = |n: usize, one: &str, many: &str| format!("{n} {}", if n == 1 { one } else { many });
    let of = |role: &str| run.checks.iter().filter(|row| row.role == role).count();
    let parts = [
        counted(run.images.len(), "image", "images"),
        counted(run.flights().len(), "flight", "flights"),
        counted(of("control"), "control point", "control points"),
        counted(of("check"), "check point", "check points"),
    ];
    parts.join(", ")
}

fn adjustment(page: &mut Page, run: &RunFolder) {
    let summary = &run.summary;
    page.section("Adjustment");
    page.table(&overview(summary)).table(&solvers_table(summary));
    // Solvers that do not agree stand on the first screen.
    if let Some(Conclusion { sound: true, text }) = solvers_verdict(summary) {
        page.paragraph(&format!("{text}."));
    }
    match &summary.agreement {
        Some(agreement) => {
            let mut table = Table::new("Agreement of the two solvers")
                .text("of", "")
                .number("largest difference", "")
                .number("allowed", "")
                .text("unit", "");
            for (what, difference, limit, unit) in compared(agreement) {
                table.row([what.into(), significant(difference, 2), format!("{limit:e}"), unit.to_string()]);
            }
            page.table(&table);
            page.note(
                "What agreement cannot prove: reading, weights, numbering and datum are shared by both solvers. \
                 An error there would be the same in both.",
            );
        }
        None => {
            if let Some(text) = one_solver(summary) {
                page.note(&format!("{text} Nothing was compared."));
            }
        }
    }
    for plugin in &summary.plugins {
        page.note(&format!("Plug-in {plugin}"));
    }
    page.data("The model, as in model.toml", |page| {
        page.code(&run.model);
    });
}

fn overview(summary: &Summary) -> Table {
    let mut table = Table::new("").text("quantity", "").number("value", "").text("unit", "");
    let mut row = |what: &str, value: String, unit: &str| {
        table.row([what.to_string(), value, unit.to_string()]);
    };
    row("observations", summary.observations.to_string(), "");
    row("unknowns", summary.unknowns.to_string(), "");
    row("datum defect", summary.datum_defect.to_string(), "");
    row("redundancy", summary.redundancy.to_string(), "");
    row("sigma0", or_dash(summary.sigma0, |sigma0| significant(sigma0, 5)), "");
    row("tie points, RMS per coordinate", or_dash(summary.tie_rms_px, px), "px");
    if let Some(similarity) = &summary.similarity {
        row("scale of the similarity from the control points", fixed(similarity.scale, 6), "");
    }
    table
}

fn parameters(page: &mut Page, run: &RunFolder) {
    page.section("Camera and effects");
    for (camera, parameters) in &run.summary.cameras.0 {
        page.table(&camera_table(camera, parameters));
    }
    if run.summary.effects.0.is_empty() {
        page.paragraph("No effect was added to the camera model.");
    } else {
        page.table(&effects_table(&run.summary));
    }
    uncertainty::section(page, run);
}

fn image_section(page: &mut Page, run: &RunFolder, ties: TieResiduals) {
    page.section("Residuals of images");
    let chart = pictures::image_rms(run, &ties.rms);
    let caption = "An image that stands out has outliers, or an error that other images do not have.";
    page.figure("image-rms", image_bars(&chart), caption);
    points::images(page, run, &ties.rms);
    let chart = pictures::residual_histogram(ties.x, ties.y);
    page.figure("residual-histogram", histogram(&chart), "");
}

fn block_section(page: &mut Page, run: &RunFolder) {
    page.section("Flights and points");
    let plan = pictures::flights(run);
    page.figure("flights", flights_plan_profile(&plan), "Above in plan, below from the side.");
}

fn checks_section(page: &mut Page, run: &RunFolder) {
    page.section("Control and check points");
    if run.checks.is_empty() {
        page.paragraph(
            "The block has no surveyed points that can be compared: nothing outside the images judges the result.",
        );
        return;
    }
    page.table(&residuals_table(&run.summary));
    if let Some(sentence) = points::control_beside_check(run) {
        page.paragraph(&sentence);
    }
    let frame = pictures::frame(run);
    for (role, name) in [("check", "Check points"), ("control", "Control points")] {
        let rows: Vec<&CheckRow> = run.checks.iter().filter(|row| row.role == role).collect();
        if rows.is_empty() {
            continue;
        }
        page.subsection(name);
        points::by_name(page, name, &rows);
        let plan = pictures::plan(name, frame, rows.iter().copied());
        let heights = pictures::heights(name, frame, rows.iter().copied());
        let ids = [format!("{role}-plan"), format!("{role}-height")];
        maps(page, &ids, (&plan, &heights), "Computed minus surveyed.");
        if rows.len() < FEWEST_FOR_HISTOGRAM {
            continue;
        }
        let chart = pictures::check_histogram(name, &rows);
        page.figure(&format!("{role}-histogram"), histogram(&chart), "");
    }
}

/// Residuals in plan and in height on the same axes, side by side.
fn maps(page: &mut Page, ids: &[String; 2], (plan, heights): (&PlanArrows, &PlanSigned), caption: &str) {
    page.pair(
        (&ids[0], residuals_plan_arrows(plan), caption),
        (&ids[1], residuals_plan_signed(heights), "The same in height."),
    );
}

/// Of a block that has GNSS positions which the run can be compared with.
fn gnss_section(page: &mut Page, run: &RunFolder) {
    if run.gnss.is_empty() {
        return;
    }
    const SIGN: &str =
        "Computed minus measured: the antenna as the model predicts it less the position of the receiver.";
    page.section("GNSS positions");
    let frame = pictures::frame(run);
    let of = (&pictures::gnss_plan(frame, &run.gnss), &pictures::gnss_heights(frame, &run.gnss));
    maps(page, &["gnss-plan".into(), "gnss-height".into()], of, SIGN);
    points::gnss(page, run);
    for (id, against) in [("gnss-time", GnssAgainst::Time), ("gnss-heading", GnssAgainst::Heading)] {
        if let Some(chart) = pictures::gnss_series(&run.gnss, against, None) {
            page.figure(id, line_chart(&chart), SIGN);
        }
    }
}
