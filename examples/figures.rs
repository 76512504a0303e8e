//! Draws every figure of a report from made-up data, so that each can be looked at.
//!
//! `cargo run --release --example figures` writes `out/report.html` and the pictures to `out/figures`, with an
//! `index.html` beside them.

use misclosure::report::figures::*;
use misclosure::report::html::{Page, Verdict};
use misclosure::report::{numbers, tables::Table};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::path::Path;

const SENSOR: [f64; 2] = [5120.0, 3840.0];
const FLIGHTS: [(&str, usize); 4] =
    [("oblique, 50 m", 42), ("nadir, 50 m", 43), ("nadir, 30 m", 16), ("nadir, 70 m", 12)];

struct Noise(ChaCha8Rng);

impl Noise {
    fn normal(&mut self, sigma: f64) -> f64 {
        Normal::new(0.0, sigma).map_or(0.0, |n| n.sample(&mut self.0))
    }
}

fn main() -> anyhow::Result<()> {
    let mut noise = Noise(ChaCha8Rng::seed_from_u64(1));
    let mut page = Page::new("Every figure, from made-up data");
    page.subtitle("Nothing here was measured: the page shows what a report looks like.");
    page.verdict(Verdict::Missing, "focal-time explains what was left over; F(1, 41 210) = 512, p < 1e-300.");
    page.verdict(Verdict::Adequate, "No test is significant at 0.001 over the whole catalogue.");
    page.verdict(Verdict::Unexplained, "A pattern of 240 px wavelength along the rows, 0.08 px high, in all flights.");
    sensor(&mut page, &mut noise);
    block(&mut page, &mut noise);
    series(&mut page, &mut noise);
    candidates(&mut page);
    odd(&mut page);
    page.write(Path::new("out"))?;
    std::fs::write("out/figures/index.html", page.html())?;
    println!("out/report.html");
    Ok(())
}

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

fn sensor(page: &mut Page, noise: &mut Noise) {
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

fn block(page: &mut Page, noise: &mut Noise) {
    page.section("Over the block");
    let mut images = Vec::new();
    for (flight, (_, n)) in FLIGHTS.iter().enumerate() {
        let (strips, height) = [(3, 50.0), (3, 50.0), (1, 30.0), (1, 70.0)][flight];
        for i in 0..*n {
            let (strip, along) = (i % strips, (i / strips) as f64 / (n / strips).max(1) as f64);
            let across = if strips == 3 { 15.0 * (strip as f64 - 1.0) } else { 2.0 };
            images.push(Station {
                position_m: [across + noise.normal(0.8), 200.0 * along, height + noise.normal(0.4)],
                flight,
            });
        }
    }
    let check: Vec<[f64; 3]> = (0..5000)
        .map(|i| [((i * 37) % 97) as f64 / 97.0 * 60.0 - 30.0, i as f64 / 5000.0 * 200.0, 2.0 + noise.normal(0.5)])
        .collect();
    let plan = FlightPlan {
        title: "Dike: flights, control and check points".into(),
        flights: FLIGHTS.iter().map(|(n, _)| n.to_string()).collect(),
        images,
        control_m: (0..10).map(|i| [if i % 2 == 0 { -22.0 } else { 22.0 }, 10.0 + 20.0 * i as f64, 2.0]).collect(),
        check_m: check.clone(),
    };
    page.figure("flights", flights_plan_profile(&plan), "The block runs north: Y lies along the page.");

    let height = |p: &[f64; 3]| 1.8 * ((p[1] - 100.0) / 100.0).powi(2) - 0.7;
    let residuals: Vec<[f64; 3]> = check
        .iter()
        .map(|p| {
            [
                0.01 * p[0] + noise.normal(0.1),
                0.004 * (p[1] - 100.0) + noise.normal(0.1),
                height(p) + noise.normal(0.15),
            ]
        })
        .collect();
    let arrows = check.iter().zip(&residuals).map(|(p, d)| ([p[0], p[1]], [d[0], d[1]])).collect();
    let horizontal =
        PlanArrows { title: "Check points: residuals in planimetry".into(), arrows, unit: "mm".into(), scale: None };
    page.figure("check-plan", residuals_plan_arrows(&horizontal), "Computed minus surveyed.");
    let mut signed = PlanSigned {
        title: "Check points: residuals in height".into(),
        values: check.iter().zip(&residuals).map(|(p, d)| ([p[0], p[1]], d[2])).collect(),
        unit: "mm".into(),
        ..PlanSigned::default()
    };
    page.figure("check-height", residuals_plan_signed(&signed), "The ends rise, the middle sinks.");
    signed.style = SignedStyle::Dots;
    signed.values = signed.values.into_iter().step_by(31).map(|(p, v)| ([20.0 * p[0], 30.0 * p[1]], v)).collect();
    signed.title = "Height residuals of a 6 km mapping block, as dots".into();
    page.figure("check-dots", residuals_plan_signed(&signed), "The same as dots.");
    let long = (0..400).map(|i| {
        ([452_300.0 + 12.5 * i as f64, 5_411_820.0 + 30.0 * (0.05 * i as f64).sin()], (0.03 * i as f64).cos())
    });
    let corridor = PlanSigned {
        title: "A corridor of 5 km, in UTM".into(),
        values: long.collect(),
        unit: "mm".into(),
        ..PlanSigned::default()
    };
    page.figure("corridor", residuals_plan_signed(&corridor), "Long corridors are stretched across.");

    let column = |k: usize| residuals.iter().map(|r| r[k]).collect::<Vec<_>>();
    let one = Histogram {
        title: "Height residuals at check points".into(),
        x: Axis::new("computed − surveyed", "mm"),
        samples: vec![Sample { label: "height".into(), values: column(2) }],
        bins: 0,
    };
    page.figure("histogram", histogram(&one), "");
    let samples = ["X", "Y", "Z"].iter().enumerate().map(|(k, l)| Sample { label: l.to_string(), values: column(k) });
    page.figure(
        "histograms",
        histogram(&Histogram { title: "Residuals at check points".into(), samples: samples.collect(), ..one }),
        "",
    );
    let mut table =
        Table::new("Residuals at check points").text("component", "").number("mean", "mm").number("sigma", "mm");
    for (k, name) in ["X", "Y", "Z"].iter().enumerate() {
        let v = column(k);
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        let sigma = (v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / v.len() as f64).sqrt();
        table.row([name.to_string(), numbers::significant(mean, 3), numbers::significant(sigma, 3)]);
    }
    table.note("5000 points, after a similarity on ten control points");
    print!("{}", table.to_text());
    page.table(&table);
}

fn series(page: &mut Page, noise: &mut Noise) {
    page.section("Along something");
    let line = |f: fn(f64) -> f64| (-5..=5).map(|i| [10.0 * i as f64, f(10.0 * i as f64)]).collect::<Vec<_>>();
    let panel = |title: &str, y: Axis, series: Vec<Series>| Panel {
        title: title.into(),
        x: Axis::new("error of f", "px"),
        y,
        series,
    };
    let three = |k: f64| {
        let part = |label: &str, q: f64| {
            Series::new(label, line(f64::abs).into_iter().map(|p| [p[0], k * q * p[1]]).collect())
        };
        vec![part("planimetry", 0.4), part("height", 0.9), part("3D", 1.0)]
    };
    let s1 = LineChart {
        title: "A wrong focal length, held: what happens to check points and camera height".into(),
        columns: 3,
        panels: vec![
            panel("All flights", Axis::new("RMS at check points", "mm").from_zero(), three(1.7)),
            panel("Nadir flights alone", Axis::new("RMS at check points", "mm").from_zero(), three(0.5)),
            panel(
                "Mean camera height",
                Axis::new("change", "m"),
                vec![
                    Series::new("all flights", line(|x| 0.0024 * x)),
                    Series::new("nadir alone", line(|x| 0.0086 * x)),
                ],
            ),
        ],
        note: String::new(),
    };
    page.figure("s1", line_chart(&s1), "");
    let lengths: [f64; 5] = [200.0, 500.0, 1000.0, 2000.0, 5000.0];
    let power = LineChart {
        title: "Height of the bowl against the length of the corridor".into(),
        panels: vec![Panel {
            x: Axis::new("length of the corridor", "m").log(),
            y: Axis::new("height of the bowl", "mm").log(),
            series: vec![
                Series::new(
                    "simulated",
                    lengths.iter().map(|l| [*l, 3e-5 * l.powf(1.9) * (1.0 + noise.normal(0.05))]).collect(),
                )
                .style(LineStyle::Markers),
                Series::new(
                    "fitted power law, exponent 1.90 ± 0.03",
                    lengths.iter().map(|l| [*l, 3e-5 * l.powf(1.9)]).collect(),
                )
                .style(LineStyle::Dashed),
            ],
            ..Panel::default()
        }],
        ..LineChart::default()
    };
    page.figure("power-law", line_chart(&power), "");
    let mut at = 0;
    let mut focal: Vec<Series> = FLIGHTS
        .iter()
        .map(|(name, n)| {
            at += n;
            let points = (at - n..at).map(|i| [i as f64 + 1.0, 5510.09 * 1.00001f64.powi(i as i32)]).collect();
            Series::new(*name, points).style(LineStyle::Markers)
        })
        .collect();
    focal.push(Series::new("estimated, one camera", vec![[1.0, 5512.27], [113.0, 5512.27]]).style(LineStyle::Dashed));
    let focal = Panel {
        x: Axis::new("image in order of flight", "").whole(),
        y: Axis::new("focal length", "px"),
        series: focal,
        ..Panel::default()
    };
    page.figure(
        "focal",
        line_chart(&LineChart {
            title: "Focal length along the flights".into(),
            panels: vec![focal],
            ..LineChart::default()
        }),
        "",
    );

    let steps = [
        ("base", 0.412, 2.9, 1.37),
        ("+ rolling-shutter", 0.331, 1.6, 1.10),
        ("+ focal-thermal", 0.302, 0.41, 1.004),
        ("+ lever-arm", 0.3005, 0.38, 1.0),
    ];
    let steps =
        steps.map(|(name, h, c, s)| LedgerStep { name: name.into(), heldout_px: h, check_mm: Some(c), sigma0: s });
    page.figure("ledger", ledger(&Ledger { title: "What each added effect did".into(), steps: steps.to_vec() }), "");

    let cloud: Vec<[f64; 2]> =
        (0..3000).map(|i| [i as f64 * 0.4, 0.15 * (i as f64 / 400.0).sin() + noise.normal(0.3)]).collect();
    let bins =
        |phase: f64| (0..24).map(|b| [25.0 + 50.0 * b as f64, 0.15 * (b as f64 * 0.31 + phase).sin(), 0.05]).collect();
    let binned = BinnedProfile {
        title: "Residual against time".into(),
        x: Axis::new("time since the first image", "s"),
        y: Axis::new("residual", "px"),
        cloud,
        bins: vec![("x".into(), bins(0.0)), ("y".into(), bins(2.0))],
        bars: "± 2 sigma of the mean".into(),
    };
    page.figure("profile", profile(&binned), "");

    let mut bars = Vec::new();
    for (flight, (_, n)) in FLIGHTS.iter().enumerate() {
        for i in 0..*n {
            let value = 0.12 * ((bars.len() as f64) / 9.0).sin() + noise.normal(0.03) + if i == 4 { 0.2 } else { 0.0 };
            bars.push(ImageBar { value, whisker: Some(0.07), flight, significant: value.abs() > 0.14 });
        }
    }
    let chart = ImageBars {
        title: "Mean x residual of each image".into(),
        order: "image in order of time".into(),
        y: Axis::new("mean residual", "px"),
        flights: FLIGHTS.iter().map(|(n, _)| n.to_string()).collect(),
        bars,
        whisker_means: "± 2 sigma".into(),
        star_means: "significant at 0.001, all images together".into(),
    };
    page.figure("images", image_bars(&chart), "");
    let many = (0..2000).map(|i| ImageBar {
        value: (i as f64 / 150.0).sin() + noise.normal(0.3),
        whisker: Some(0.4),
        flight: i / 250,
        significant: i % 457 == 0,
    });
    page.figure(
        "images-many",
        image_bars(&ImageBars {
            title: "2000 images in eight flights".into(),
            bars: many.collect(),
            flights: vec![],
            ..chart
        }),
        "",
    );
}

fn candidates(page: &mut Page) {
    page.section("Candidates");
    let names = [
        "rolling-shutter",
        "gnss-delay",
        "lever-arm",
        "focal-thermal",
        "focal-time",
        "pp-drift",
        "refraction",
        "earth-curvature",
        "local-flaw",
        "image-grid",
    ];
    let n = names.len();
    let r = |i: usize, j: usize| {
        if i == j {
            1.0
        } else {
            (-((i as f64 - j as f64).abs()) / 2.5).exp() * if (i * j) % 3 == 1 { -1.0 } else { 1.0 }
        }
    };
    let mut values: Vec<f64> = (0..n * n).map(|k| r((k / n).min(k % n), (k / n).max(k % n))).collect();
    (values[1], values[n]) = (0.97, 0.97);
    (values[8 * n + 9], values[9 * n + 8]) = (f64::NAN, f64::NAN);
    let matrix = CorrelationMatrix {
        title: "Which candidates look alike in this block".into(),
        names: names.map(String::from).to_vec(),
        values,
        threshold: 0.9,
    };
    page.figure("correlation", correlation_matrix(&matrix), "");
    let big = 34;
    let values = (0..big * big).map(|k| (((k / big) as f64 - (k % big) as f64) / 4.0).cos()).collect();
    let names = (0..big).map(|i| format!("candidate-effect-{i}")).collect();
    page.figure(
        "correlation-big",
        correlation_matrix(&CorrelationMatrix {
            title: "Thirty-four candidates".into(),
            names,
            values,
            threshold: 0.9,
        }),
        "",
    );
    let mut table = Table::new("Candidates")
        .number("rank", "")
        .text("effect", "")
        .number("F", "")
        .number("p", "")
        .number("estimate", "");
    table.row([
        "1".into(),
        "rolling-shutter".into(),
        "512".into(),
        numbers::p_value(0.0),
        numbers::with_sigma(0.0312, 0.0011) + " s",
    ]);
    table.row([
        "2".into(),
        "gnss-delay".into(),
        "498".into(),
        numbers::p_value(3e-88),
        numbers::with_sigma(-0.0301, 0.0011) + " s",
    ]);
    page.table(&table);
    page.note("rolling-shutter or gnss-delay: this block cannot tell. Opposite strips would.");
    page.warning("1.2 % of the measurements were found to be outliers.");
    page.details("Model as used", |p| {
        p.code("[camera]\nfree = [\"f\", \"pp\"]");
    });
}

fn odd(page: &mut Page) {
    page.section("Odd data");
    page.figure("odd-empty", histogram(&Histogram { title: "No data".into(), ..Histogram::default() }), "");
    let one = vec![
        Series::new("one value", vec![[3.0, 5510.094]]),
        Series::new("broken", vec![[1.0, f64::NAN], [2.0, 5510.1]]),
    ];
    let panels = vec![
        Panel { title: "A single value".into(), x: Axis::new("t", "s"), y: Axis::new("f", "px"), series: one },
        Panel { title: "Nothing".into(), ..Panel::default() },
    ];
    page.figure(
        "odd-lines",
        line_chart(&LineChart { title: "Single values and none".into(), panels, columns: 2, note: String::new() }),
        "",
    );
    let names = [
        "nothing added",
        "+ rolling-shutter of the front camera",
        "+ focal-thermal with lag",
        "+ local-flaw",
        "+ lever-arm",
        "+ pp-drift",
        "+ gnss-drift",
    ];
    let steps = names.map(|n| LedgerStep { name: n.into(), heldout_px: 0.4, check_mm: None, sigma0: 1.2 }).to_vec();
    page.figure(
        "odd-ledger",
        ledger(&Ledger { title: "A ledger with long names and no check points".into(), steps }),
        "",
    );
}
