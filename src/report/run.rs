//! The page of a run: what was adjusted, how well it fits, and, after a diagnosis, what was missing.

use super::figures::{
    Arrow, ArrowSet, Axis, FlightPlan, Histogram, ImageBar, ImageBars, PlanArrows, PlanSigned, Sample, Station,
    VectorField, flights_plan_profile, histogram, image_bars, residuals_plan_arrows, residuals_plan_signed,
    vector_field,
};
use super::html::Page;
use super::numbers::{fixed, or_dash, px, significant};
use super::run_tables::{
    Conclusion, camera_table, compared, effects_table, residuals_table, solvers_table, solvers_verdict,
};
use super::tables::Table;
use super::{diagnosis, letter};
use crate::diagnose::verdict::Diagnosis;
use crate::run::folder::{self, CheckRow, SensorRow};
use crate::run::rms_by;
use crate::run::summary::Summary;
use anyhow::Result;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Cells below this p-value are marked. A cell is one of hundreds: 1e-5 marks no cell of a clean block in most pictures.
const MARKED_P: f64 = 1e-5;

/// A distribution of fewer values is no picture.
const FEWEST_FOR_HISTOGRAM: usize = 50;

/// The folder of a run, with what a diagnosis left in it.
pub type RunFolder = folder::RunFolder<Diagnosis>;

/// Reads the folder of a run and writes its `report.html` and `figures/`.
///
/// # Errors
/// A file that is missing, cannot be read or cannot be written.
pub fn write_page(dir: &Path) -> Result<()> {
    page(&RunFolder::read(dir)?).write(dir)
}

/// The page.
pub fn page(run: &RunFolder) -> Page {
    let what = if run.diagnosis.is_some() { "Diagnosis" } else { "Adjustment" };
    let mut page = Page::new(format!("{what} of the block {}", run.summary.block));
    let (flights, images) = (run.flights().len(), run.images.len());
    page.subtitle(&format!("{images} images, {flights} flights; written by misclosure"));
    if let Some(found) = &run.diagnosis {
        diagnosis::verdict(&mut page, found);
        letter::letter(&mut page, run, found);
        diagnosis::ledger_section(&mut page, found);
        diagnosis::structure(&mut page, run, found);
        diagnosis::candidates(&mut page, found);
    }
    adjustment(&mut page, run);
    parameters(&mut page, run);
    if run.diagnosis.is_none() {
        page.section("Residuals over the sensor");
        sensor_figures(&mut page, run);
    }
    image_section(&mut page, run);
    block_section(&mut page, run);
    checks_section(&mut page, run);
    page
}

fn adjustment(page: &mut Page, run: &RunFolder) {
    let summary = &run.summary;
    page.section("Adjustment");
    page.table(&overview(summary)).table(&solvers_table(summary));
    match solvers_verdict(summary) {
        Some(Conclusion { sound: true, text }) => {
            page.paragraph(&format!("{text}."));
        }
        Some(Conclusion { sound: false, text }) => {
            page.warning(&format!("{text}. No figure of this page can be relied on."));
        }
        None => {}
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
        None if summary.solvers.0.len() == 1 => {
            page.note("One solver ran alone: nothing was compared.");
        }
        None => {}
    }
    page.details("The model, as in model.toml", |page| {
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
}

/// The mean residuals over the sensor, camera by camera; before and after side by side where the folder has both.
pub(super) fn sensor_figures(page: &mut Page, run: &RunFolder) {
    let cameras: BTreeSet<&str> = run.sensor.iter().map(|row| row.camera.as_str()).collect();
    if cameras.is_empty() {
        page.paragraph("There are no tie points.");
    }
    for (c, camera) in cameras.into_iter().enumerate() {
        let field = |stage: &str, title: &str| {
            let rows: Vec<&SensorRow> =
                run.sensor.iter().filter(|row| row.camera == camera && row.stage == stage).collect();
            let first = rows.first()?;
            let mut field = VectorField::single(
                &format!("{title}, camera {camera}"),
                [first.width_px, first.height_px],
                Vec::new(),
                "px",
            );
            let arrows: Vec<Arrow> = rows.iter().map(|row| ([row.x, row.y], [row.dx, row.dy])).collect();
            let tested = rows.iter().any(|row| row.p_value.is_some());
            let marked = rows.iter().filter(|_| tested).map(|row| row.p_value.is_some_and(|p| p < MARKED_P));
            field.sets = vec![ArrowSet { arrows, significant: marked.collect(), ..ArrowSet::default() }];
            Some(field)
        };
        let marks = format!(
            "Mean residual of the tie points in cells; cells marked as significant have p below {MARKED_P:e} each."
        );
        let id = |stage: &str| format!("sensor-{stage}-{}", c + 1);
        match (field("base", "Before"), field("final", "After")) {
            (Some(mut base), Some(mut last)) => {
                base.scale = [base.natural_scale(), last.natural_scale()].into_iter().flatten().reduce(f64::min);
                last.scale = base.scale;
                page.pair(
                    (&id("base"), vector_field(&base), &marks),
                    (&id("final"), vector_field(&last), "The same after the effects were added, at the same scale."),
                );
            }
            (_, Some(mut only)) => {
                only.title = format!("Mean residual of the tie points, camera {camera}");
                let tested = only.sets.iter().any(|set| !set.significant.is_empty());
                let caption = if tested { marks.as_str() } else { "Mean residual of the tie points in cells." };
                page.figure(&id("final"), vector_field(&only), caption);
            }
            _ => {}
        }
    }
}

fn image_section(page: &mut Page, run: &RunFolder) {
    page.section("Residuals of images");
    let flights = run.flights();
    let index: BTreeMap<&str, usize> = run.images.iter().enumerate().map(|(i, row)| (row.image.as_str(), i)).collect();
    let ties = || run.residuals.iter().filter(|row| row.kind == "tie");
    let residuals = ties().filter_map(|row| Some((*index.get(row.image.as_str())?, [row.rx, row.ry])));
    let rms = rms_by(run.images.len(), residuals);
    let bars = run.images.iter().zip(rms).filter_map(|(image, rms)| {
        let flight = flights.iter().position(|name| *name == image.flight)?;
        Some(ImageBar { value: rms?, flight, ..ImageBar::default() })
    });
    let chart = ImageBars {
        title: "RMS of the tie points of each image, per coordinate".into(),
        order: "image in the order of the block".into(),
        y: Axis::new("RMS", "px").from_zero(),
        flights: flights.clone(),
        bars: bars.collect(),
        ..ImageBars::default()
    };
    page.figure("image-rms", image_bars(&chart), "An image that stands out has outliers, or an error of its own.");
    let samples = vec![
        Sample { label: "x".into(), values: ties().map(|row| row.rx).collect() },
        Sample { label: "y".into(), values: ties().map(|row| row.ry).collect() },
    ];
    let chart = Histogram {
        title: "Residuals of the tie points".into(),
        x: Axis::new("observed − computed", "px"),
        samples,
        bins: 0,
    };
    page.figure("residual-histogram", histogram(&chart), "");
}

fn block_section(page: &mut Page, run: &RunFolder) {
    page.section("Flights and points");
    let flights = run.flights();
    let of_role = |role: &str| -> Vec<[f64; 3]> {
        run.checks.iter().filter(|row| row.role == role).map(|row| [row.x, row.y, row.z]).collect()
    };
    let stations = run.images.iter().filter_map(|image| {
        let flight = flights.iter().position(|name| *name == image.flight)?;
        Some(Station { position_m: [image.x, image.y, image.z], flight })
    });
    let plan = FlightPlan {
        title: "Projection centres, control and check points".into(),
        images: stations.collect(),
        control_m: of_role("control"),
        check_m: of_role("check"),
        flights: flights.clone(),
    };
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
    for (role, name) in [("check", "Check points"), ("control", "Control points")] {
        let rows: Vec<&CheckRow> = run.checks.iter().filter(|row| row.role == role).collect();
        if rows.is_empty() {
            continue;
        }
        page.subsection(name);
        let plan = PlanArrows {
            title: format!("{name}: residuals in planimetry"),
            arrows: rows.iter().map(|row| ([row.x, row.y], [1e3 * row.dx, 1e3 * row.dy])).collect(),
            unit: "mm".into(),
            scale: None,
        };
        page.figure(&format!("{role}-plan"), residuals_plan_arrows(&plan), "Computed minus surveyed.");
        let heights = PlanSigned {
            title: format!("{name}: residuals in height"),
            values: rows.iter().map(|row| ([row.x, row.y], 1e3 * row.dz)).collect(),
            unit: "mm".into(),
            ..PlanSigned::default()
        };
        page.figure(&format!("{role}-height"), residuals_plan_signed(&heights), "Computed minus surveyed.");
        let sample = |label: &str, value: fn(&CheckRow) -> f64| Sample {
            label: label.into(),
            values: rows.iter().map(|row| 1e3 * value(row)).collect(),
        };
        if rows.len() < FEWEST_FOR_HISTOGRAM {
            continue;
        }
        let chart = Histogram {
            title: format!("{name}: distribution of the residuals"),
            x: Axis::new("computed − surveyed", "mm"),
            samples: vec![sample("X", |row| row.dx), sample("Y", |row| row.dy), sample("Z", |row| row.dz)],
            bins: 0,
        };
        page.figure(&format!("{role}-histogram"), histogram(&chart), "");
    }
}
