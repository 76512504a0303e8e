//! Over the block: flights, residuals in plan, histograms.

use crate::{FLIGHTS, Noise};
use misclosure::report::figures::*;
use misclosure::report::html::Page;
use misclosure::report::{numbers, tables::Table};

pub fn draw(page: &mut Page, noise: &mut Noise) {
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
                ..Station::default()
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
        ..FlightPlan::default()
    };
    page.figure("flights", flights_plan_profile(&plan), "The block runs north: Y points up.");

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
    let horizontal = PlanArrows {
        title: "Check points: residuals in planimetry".into(),
        arrows,
        unit: "mm".into(),
        ..PlanArrows::default()
    };
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
    page.figure("corridor", residuals_plan_signed(&corridor), "A long corridor keeps its one scale.");

    let column = |k: usize| residuals.iter().map(|r| r[k]).collect::<Vec<_>>();
    let one = Histogram {
        title: "Height residuals at check points".into(),
        x: Axis::new("computed − surveyed", "mm"),
        samples: vec![Sample { label: "height".into(), values: column(2), ..Sample::default() }],
        ..Histogram::default()
    };
    page.figure("histogram", histogram(&one), "");
    let samples = ["X", "Y", "Z"].iter().enumerate().map(|(k, l)| Sample {
        label: l.to_string(),
        values: column(k),
        ..Sample::default()
    });
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
