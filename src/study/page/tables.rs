//! Tables and pictures that several sections share.

use crate::evaluate::Statistics;
use crate::evaluate::distortion_field::{FieldStatistics, FieldVector};
use crate::report::figures::{
    Arrow, Axis, Histogram, PlanArrows, PlanSigned, Sample, histogram, residuals_plan_arrows, residuals_plan_signed,
};
use crate::report::html::Page;
use crate::report::numbers::{mm, or_dash, px};
use crate::report::tables::Table;
use crate::study::outcome::{Adjusted, Judged};

/// Sensor of the study's camera, px.
pub const SENSOR_PX: [f64; 2] = [5120.0, 3840.0];

/// A table of residuals at check points: mean and standard deviation in plan, height and space, and RMS in space.
pub fn check_table(caption: &str) -> Table {
    (Table::new(caption))
        .text("", "")
        .number("planimetry", "mm")
        .number("altimetry", "mm")
        .number("3D", "mm")
        .number("3D RMS", "mm")
        .number("bowl", "mm")
}

/// The published row.
pub fn published_row(table: &mut Table, values: [[f64; 2]; 3]) {
    let cell = |[mean, std]: [f64; 2]| format!("{mean} ± {std}");
    let [plan, height, space] = values.map(cell);
    table.row(["published".to_string(), plan, height, space, "-".into(), "-".into()]);
}

/// A row of ours.
pub fn judged_row(table: &mut Table, name: &str, judged: &Judged) {
    let check = &judged.check;
    let [plan, height, space] = means(check);
    table.row([
        name.to_string(),
        plan,
        height,
        space,
        mm(check.rms_m.xyz),
        or_dash(judged.bowl.map(|bowl| bowl.height_m), mm),
    ]);
}

/// The rows of one case: its three kinds of marks, and the rays.
pub fn case_rows(table: &mut Table, case: &Adjusted) {
    judged_row(table, "ours, marks in the erroneous images", &case.erroneous_marks);
    judged_row(table, "ours, exact marks of the check points", &case.exact_check_marks);
    judged_row(table, "ours, exact marks of check and control points", &case.exact_marks);
    if let Some(rays) = case.erroneous_marks.rays_rms_m {
        table.row([
            "ours, rays intersected in space".into(),
            "-".into(),
            "-".into(),
            "-".into(),
            mm(rays),
            "-".to_string(),
        ]);
    }
}

fn means(check: &Statistics) -> [String; 3] {
    let (mean, std) = (check.mean_m, check.std_m);
    let cell = |mean: f64, std: Option<f64>| format!("{} ± {}", mm(mean), or_dash(std, mm));
    [
        cell(mean.xy, std.map(|std| std.xy)),
        cell(mean.abs_z, std.map(|std| std.abs_z)),
        cell(mean.xyz, std.map(|std| std.xyz)),
    ]
}

/// A table of changes of a camera over the sensor.
pub fn change_table(caption: &str) -> Table {
    (Table::new(caption)).text("", "").number("min", "px").number("max", "px").number("mean", "px").number("std", "px")
}

/// The published row: least, largest, mean, standard deviation.
pub fn published_change(table: &mut Table, name: &str, values: [f64; 4]) {
    let [min, max, mean, std] = values.map(|value| value.to_string());
    table.row([name.to_string(), min, max, mean, std]);
}

/// Our rows: whole camera, whole camera up to a rotation, distortion alone.
pub fn change_rows(table: &mut Table, name: &str, case: &Adjusted) {
    let mut row = |kind: &str, field: &FieldStatistics| {
        let [min, max, mean, std] = [field.min, field.max, field.mean, field.std].map(px);
        table.row([format!("{name}: {kind}"), min, max, mean, std]);
    };
    row("whole camera", &case.whole_camera);
    if let Some(field) = &case.camera_up_to_rotation {
        row("whole camera up to a rotation", field);
    }
    row("distortion alone", &case.distortion);
}

/// What the three comparisons of cameras mean.
pub const CHANGE_NOTE: &str = "Whole camera: image point of the same viewing ray, estimated minus true camera, on a \
                               grid of 64 x 48 places over the sensor. Up to a rotation: after the one rotation of all \
                               rays that makes it least, which the orientation of the images takes up. Distortion \
                               alone: change of the correction (distorted minus ideal point) at the same image point.";

/// Arrows of a field.
pub fn arrows(field: &[FieldVector]) -> Vec<Arrow> {
    field.iter().map(|vector| (vector.at, vector.d)).collect()
}

/// Residuals at check points as in the published figure `number`, where there is one: plan, height, histogram. Plan and
/// height share one scale.
pub fn residual_figures(page: &mut Page, id: &str, title: &str, rows: &[[f64; 5]], number: Option<u32>) {
    let millimetres = |value: f64| 1e3 * value;
    let arrows = rows.iter().map(|[x, y, dx, dy, _]| ([*x, *y], [millimetres(*dx), millimetres(*dy)])).collect();
    let values = rows.iter().map(|[x, y, _, _, dz]| ([*x, *y], millimetres(*dz))).collect();
    let mut plan =
        PlanArrows { title: format!("{title}: in plan"), arrows, unit: "mm".into(), ..PlanArrows::default() };
    let mut height =
        PlanSigned { title: format!("{title}: in height"), values, unit: "mm".into(), ..PlanSigned::default() };
    let scale = [plan.natural_scale(), height.natural_scale()].into_iter().flatten().reduce(f64::min);
    (plan.scale, height.scale) = (scale, scale);
    let sample = |label: &str, length: &dyn Fn(&[f64; 5]) -> f64| Sample {
        label: label.into(),
        values: rows.iter().map(|row| millimetres(length(row))).collect(),
        ..Sample::default()
    };
    let samples = vec![
        sample("planimetry", &|[_, _, dx, dy, _]| dx.hypot(*dy)),
        sample("altimetry", &|row| row[4].abs()),
        sample("3D", &|[_, _, dx, dy, dz]| dx.hypot(*dy).hypot(*dz)),
    ];
    let bars = Histogram {
        title: format!("{title}: distribution"),
        x: Axis::new("size of the residual", "mm"),
        samples,
        ..Histogram::default()
    };
    let caption = |part: char, text: &str| match number {
        Some(number) => format!("Figure {number}{part}: {text}"),
        None => text.to_string(),
    };
    page.figure(
        &format!("{id}-plan"),
        residuals_plan_arrows(&plan),
        &caption('a', "Horizontal residuals at the check points."),
    );
    page.figure(
        &format!("{id}-height"),
        residuals_plan_signed(&height),
        &caption('b', "Residuals in height: red arrows up, blue arrows down; same scale as in plan."),
    );
    page.figure(&format!("{id}-histogram"), histogram(&bars), &caption('c', "Sizes of the residuals."));
}
