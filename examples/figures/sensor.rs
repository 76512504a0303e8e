//! Over the sensor: arrows, cells, a spectrum.

use crate::Noise;
use misclosure::report::figures::*;
use misclosure::report::html::Page;

const SENSOR: [f64; 2] = [5120.0, 3840.0];

/// Arrows on a grid over the sensor.
fn grid(step: f64, f: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Arrow> {
    let (nx, ny) = ((SENSOR[0] / step) as usize, (SENSOR[1] / step) as usize);
    (0..nx * ny).map(|k| [((k % nx) as f64 + 0.5) * step, ((k / nx) as f64 + 0.5) * step]).map(|p| (p, f(p))).collect()
}

fn flaw(p: [f64; 2]) -> [f64; 2] {
    let d = [p[0] - 1000.0, p[1] - 1000.0];
    let r = d[0].hypot(d[1]);
    let size = 0.6 * (-(r / 600.0).powi(2)).exp();
    [size * d[0] / r.max(1.0), size * d[1] / r.max(1.0)]
}

pub fn draw(page: &mut Page, noise: &mut Noise) {
    page.section("Over the sensor");
    let pp = [2539.75, 1945.80];
    let homothety = |lambda: f64| grid(256.0, move |p| [lambda * (p[0] - pp[0]), lambda * (p[1] - pp[1])]);
    let set = |label: &str, arrows| ArrowSet { label: label.into(), arrows, ..ArrowSet::default() };
    let mut field =
        VectorField::single("Homothety centred on the principal point, and change of the camera", SENSOR, vec![], "px");
    field.sets = vec![set("added error", homothety(0.005)), set("change of the camera", homothety(0.0046))];
    field.marks = vec![("principal point".into(), pp), ("centre of distortion".into(), [2537.97, 2155.92])];
    page.figure("field-two-sets", vector_field(&field), "Error and answer over the sensor.");

    let mut rng = |p| -> [f64; 2] {
        let d = flaw(p);
        [d[0] + noise.normal(0.03), d[1] + noise.normal(0.03)]
    };
    let before: Vec<Arrow> = grid(256.0, |p| p).into_iter().map(|(p, _)| (p, rng(p))).collect();
    let after: Vec<Arrow> = before.iter().map(|(p, d)| (*p, [d[0] - flaw(*p)[0], d[1] - flaw(*p)[1]])).collect();
    let flagged = |title: &str, arrows: &Vec<Arrow>| {
        let significant = arrows.iter().map(|(_, d)| d[0].hypot(d[1]) > 0.1).collect();
        let mut f = VectorField::single(title, SENSOR, vec![], "px");
        f.sets = vec![ArrowSet { arrows: arrows.clone(), significant, ..ArrowSet::default() }];
        f
    };
    let (mut left, mut right) =
        (flagged("Mean residual before", &before), flagged("Mean residual after adding local-flaw", &after));
    left.scale = left.natural_scale();
    right.scale = left.scale;
    page.pair(("before", vector_field(&left), "Before."), ("after", vector_field(&right), "After, at the same scale."));

    let cells: Vec<f64> = before.iter().map(|(_, d)| d[0] / 0.03).collect();
    let map = HeatMap {
        title: "Mean of the x residual in cells, in units of its sigma".into(),
        x: Axis::new("x", "px").range(0.0, SENSOR[0]),
        y: Axis::new("y", "px").range(0.0, SENSOR[1]),
        y_down: true,
        columns: 20,
        marked: cells.iter().map(|v| v.abs() > 4.0).collect(),
        mark_means: "significant at 0.001, all cells together".into(),
        values: cells.iter().enumerate().map(|(k, v)| if k == 299 { f64::NAN } else { *v }).collect(),
        value: Axis::new("mean / sigma", ""),
        limit: Some(12.0),
        ..HeatMap::default()
    };
    page.figure("cells", heat_map(&map), "Significance of cell means.");
    let power = |k: usize| {
        let (u, v) = ((k % 40) as f64 - 20.0, (k / 40) as f64 - 15.0);
        0.05 + 3.0 * (-((u.abs() - 12.0).powi(2) + v * v) / 1.5).exp()
    };
    let spectrum = HeatMap {
        title: "Spectrum of the y residual".into(),
        x: Axis::new("frequency along x", "cycles / 1000 px").range(-5.0, 5.0),
        y: Axis::new("frequency along y", "cycles / 1000 px").range(-3.75, 3.75),
        columns: 40,
        values: (0..1200).map(power).collect(),
        value: Axis::new("amplitude", "px"),
        colours: Colours::Magnitude,
        ..HeatMap::default()
    };
    page.figure("spectrum", heat_map(&spectrum), "A periodic pattern of 333 px along x.");
}
