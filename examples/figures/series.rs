//! Along something: lines, a ledger, profiles, bars per image.

use crate::{FLIGHTS, Noise};
use misclosure::report::figures::*;
use misclosure::report::html::Page;

pub fn draw(page: &mut Page, noise: &mut Noise) {
    page.section("Along something");
    lines(page, noise);
    steps(page);
    profile_and_images(page, noise);
}

fn lines(page: &mut Page, noise: &mut Noise) {
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
        ..LineChart::default()
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
}

fn steps(page: &mut Page) {
    let steps = [
        ("base", 0.412, 2.9, 1.37),
        ("+ rolling-shutter", 0.331, 1.6, 1.10),
        ("+ focal-thermal", 0.302, 0.41, 1.004),
        ("+ lever-arm", 0.3005, 0.38, 1.0),
    ];
    let steps =
        steps.map(|(name, h, c, s)| LedgerStep { name: name.into(), heldout_px: h, check_mm: Some(c), sigma0: s });
    page.figure(
        "ledger",
        ledger(&Ledger { title: "What each added effect did".into(), steps: steps.to_vec(), ..Ledger::default() }),
        "",
    );
}

fn profile_and_images(page: &mut Page, noise: &mut Noise) {
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
        ..BinnedProfile::default()
    };
    page.figure("profile", profile(&binned), "");

    let mut bars = Vec::new();
    for (flight, (_, n)) in FLIGHTS.iter().enumerate() {
        for i in 0..*n {
            let value = 0.12 * ((bars.len() as f64) / 9.0).sin() + noise.normal(0.03) + if i == 4 { 0.2 } else { 0.0 };
            bars.push(ImageBar {
                value,
                whisker: Some(0.07),
                flight,
                significant: value.abs() > 0.14,
                ..ImageBar::default()
            });
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
        ..ImageBars::default()
    };
    page.figure("images", image_bars(&chart), "");
    let many = (0..2000).map(|i| ImageBar {
        value: (i as f64 / 150.0).sin() + noise.normal(0.3),
        whisker: Some(0.4),
        flight: i / 250,
        significant: i % 457 == 0,
        ..ImageBar::default()
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
