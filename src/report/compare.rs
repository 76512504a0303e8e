//! Runs side by side: the tables, alike in the terminal and on the page, and the page.

use super::figures::{VectorField, vector_field};
use super::headline::{in_words, short_mm};
use super::html::Page;
use super::numbers::{fixed, or_dash, significant, unit_of, with_sigma};
use super::tables::Table;
use crate::compare::cameras::CameraDifference;
use crate::compare::places::Distances;
use crate::compare::{Compared, RunDifference};
use crate::diagnose::verdict::{EstimateEntry, Verdict};
use std::collections::{BTreeMap, BTreeSet};

/// Parameters of an effect that are named one by one.
const NAMED_PARAMETERS: usize = 3;
/// Arrows of a field over the sensor, at most: of every so many rows and columns one.
const ARROWS: usize = 400;

const REFERENCE: &str = "Every other run is compared with the first one: its value minus that of the first.";
const CAMERAS: &str = "Image point of one viewing ray, second calibration minus first. The orientations of the images \
                       absorb a rotation of all rays, and flying heights most of a change of f. Both are fitted by \
                       least squares and taken out, one after the other. The poses cannot absorb the remainder.";

/// All of it as text.
pub fn text(compared: &Compared) -> String {
    let mut text = tables(compared).iter().map(Table::to_text).collect::<Vec<_>>().join("\n");
    for of in &compared.differences {
        for (camera, reason) in &of.not_compared {
            text += &format!("Camera {camera} of {} is not compared: {reason}.\n", of.run);
        }
    }
    text
}

fn tables(compared: &Compared) -> Vec<Table> {
    let all = [runs(compared), findings(compared), cameras(compared), places(compared)];
    all.into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// The page.
pub fn page(compared: &Compared) -> String {
    let mut page = Page::new("Runs side by side");
    page.subtitle(&compared.runs.iter().map(|run| run.run.as_str()).collect::<Vec<_>>().join(" · "));
    page.paragraph(REFERENCE);
    page.section("Runs and findings").table(&runs(compared));
    let findings = findings(compared);
    if !findings.rows.is_empty() {
        page.table(&findings);
    }
    if compared.differences.iter().any(|of| !of.cameras.is_empty()) {
        page.section("Cameras").paragraph(CAMERAS).table(&cameras(compared));
    }
    for (number, of) in compared.differences.iter().enumerate() {
        for (k, camera) in of.cameras.iter().enumerate() {
            let caption = format!(
                "{} minus {}, after a rotation and a change of f by {} px.",
                of.run,
                of.against,
                significant(camera.f_px, 3)
            );
            page.figure(&format!("camera-{}-{}", number + 1, k + 1), vector_field(&field(camera)), &caption);
        }
        for (camera, reason) in &of.not_compared {
            page.note(&format!("Camera {camera} of {} is not compared: {reason}.", of.run));
        }
    }
    page.section("Images and points").table(&places(compared));
    page.html()
}

/// Every run in a row.
fn runs(compared: &Compared) -> Table {
    let mut table = Table::new("Runs")
        .text("run", "")
        .text("verdict", "")
        .number("sigma0", "")
        .number("tie RMS", "px")
        .number("control", "mm")
        .number("check", "mm")
        .number("check, height", "mm");
    for run in &compared.runs {
        let mm = |metres: Option<f64>| or_dash(metres.filter(|_| run.scaled), short_mm);
        let verdict = match run.verdict {
            None => "adjusted",
            Some(Verdict::Adequate) => "adequate",
            Some(Verdict::Missing) => "missing effect",
            Some(Verdict::Unexplained) => "unexplained",
            Some(Verdict::Mistake) => "mistake",
        };
        table.row([
            run.run.clone(),
            verdict.into(),
            or_dash(run.sigma0, |sigma0| fixed(sigma0, 4)),
            or_dash(run.tie_rms_px, |rms| fixed(rms, 4)),
            mm(run.control_rms_m),
            mm(run.check_rms_m),
            mm(run.check_height_m),
        ]);
    }
    table.note("control, check: computed minus surveyed, RMS in space");
    table
}

/// Effects and mistakes, a column for each run.
fn findings(compared: &Compared) -> Table {
    let effects: BTreeSet<&String> = compared.runs.iter().flat_map(|run| run.effects.keys()).collect();
    let kinds: BTreeSet<&String> = compared.runs.iter().flat_map(|run| &run.mistakes).collect();
    let mut table = Table::new("Findings").text("finding", "");
    for run in &compared.runs {
        table = table.text(&run.run, "");
    }
    for effect in effects {
        let cells = compared.runs.iter().map(|run| run.effects.get(effect).map_or("-".into(), sizes));
        table.row(std::iter::once(in_words(effect)).chain(cells));
    }
    for kind in kinds {
        let cells = compared.runs.iter().map(|run| if run.mistakes.contains(kind) { "found" } else { "-" }.to_string());
        table.row(std::iter::once(format!("mistake: {}", in_words(kind))).chain(cells));
    }
    table
}

fn sizes(estimate: &BTreeMap<String, EstimateEntry>) -> String {
    if estimate.len() > NAMED_PARAMETERS {
        return format!("{} parameters", estimate.len());
    }
    let size = |(name, of): (&String, &EstimateEntry)| {
        let value = if of.sigma > 0.0 { with_sigma(of.value, of.sigma) } else { significant(of.value, 4) };
        format!("{name} = {value} {}", unit_of(&of.unit)).trim_end().to_string()
    };
    estimate.iter().map(size).collect::<Vec<_>>().join(", ")
}

fn cameras(compared: &Compared) -> Table {
    let mut table = Table::new("Cameras: difference over the sensor, RMS (greatest)")
        .text("run", "")
        .text("camera", "")
        .number("as it is", "px")
        .number("after a rotation", "px")
        .number("and a change of f", "px")
        .number("rotation", "mrad")
        .number("change of f", "px");
    for of in &compared.differences {
        for camera in &of.cameras {
            let lengths = [camera.whole, camera.after_rotation, camera.after_rotation_and_f]
                .map(|of| format!("{} ({})", significant(of.rms_px, 3), significant(of.max_px, 3)));
            let [x, y, z] = camera.rotation_mrad;
            let cells = [of.run.clone(), camera.camera.clone()].into_iter().chain(lengths);
            table.row(cells.chain([significant(x.hypot(y).hypot(z), 3), significant(camera.f_px, 3)]));
        }
    }
    table
}

fn places(compared: &Compared) -> Table {
    let mut table = Table::new("Images and points: distance from the first run")
        .text("run", "")
        .text("of", "")
        .number("n", "")
        .number("RMS", "mm")
        .number("height", "mm")
        .number("greatest", "mm")
        .text("at", "")
        .number("rotation", "mrad");
    for of in &compared.differences {
        let rows = [("images", &of.images), ("tie points", &of.points), ("check points", &of.check_points)];
        for (what, distances) in rows.into_iter().filter_map(|(what, of)| Some((what, of.as_ref()?))) {
            table.row(place(of, what, distances));
        }
    }
    if compared.differences.iter().any(|of| of.after_similarity) {
        table.note("A run without scale lies anywhere: its images and points are compared after a similarity.");
    }
    table
}

fn place(of: &RunDifference, what: &str, distances: &Distances) -> [String; 8] {
    let rotation = of.rotation_rms_mrad.filter(|_| what == "images");
    [
        of.run.clone(),
        what.into(),
        distances.n.to_string(),
        short_mm(distances.rms_m),
        short_mm(distances.height_m),
        short_mm(distances.max_m),
        distances.worst.clone(),
        or_dash(rotation, |angle| significant(angle, 3)),
    ]
}

/// Thinned, so that arrows stand apart.
fn field(camera: &CameraDifference) -> VectorField {
    let columns: BTreeSet<u64> = camera.field.iter().map(|(at, _)| at[0].to_bits()).collect();
    let rows: BTreeSet<u64> = camera.field.iter().map(|(at, _)| at[1].to_bits()).collect();
    let every = ((camera.field.len() as f64 / ARROWS as f64).sqrt().ceil() as usize).max(1);
    let kept = |all: &BTreeSet<u64>| -> BTreeSet<u64> { all.iter().skip(every / 2).step_by(every).copied().collect() };
    let (columns, rows) = (kept(&columns), kept(&rows));
    let is_kept = |at: &[f64; 2]| columns.contains(&at[0].to_bits()) && rows.contains(&at[1].to_bits());
    let arrows = camera.field.iter().filter(|(at, _)| is_kept(at)).copied().collect();
    VectorField::single(&format!("Difference of the calibrations, camera {}", camera.camera), camera.size, arrows, "px")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::cameras::difference;

    #[test]
    fn arrows_of_a_field_stand_apart_and_cover_the_sensor() {
        let mut a = [0.0; 12];
        (a[0], a[1], a[2]) = (5000.0, 3000.0, 2000.0);
        let mut b = a;
        b[5] = 1e-9;
        let camera = difference("c", [6000.0, 4000.0], &a, &b).expect("a field");
        let arrows = &field(&camera).sets[0].arrows;
        assert!(arrows.len() <= ARROWS && 4 * arrows.len() > ARROWS, "{}", arrows.len());
        let right = arrows.iter().map(|(at, _)| at[0]).fold(0.0, f64::max);
        assert!(right > 0.9 * 6000.0, "{right}");
    }
}
