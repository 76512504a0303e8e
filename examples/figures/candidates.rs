//! Candidates: which look alike, and their table.

use misclosure::math::probability::p_value;
use misclosure::report::figures::*;
use misclosure::report::html::Page;
use misclosure::report::{numbers, tables::Table};

pub fn draw(page: &mut Page) {
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
        p_value(0.0),
        numbers::with_sigma(0.0312, 0.0011) + " s",
    ]);
    table.row([
        "2".into(),
        "gnss-delay".into(),
        "498".into(),
        p_value(3e-88),
        numbers::with_sigma(-0.0301, 0.0011) + " s",
    ]);
    page.table(&table);
    page.note("rolling-shutter or gnss-delay: this block cannot tell. Opposite strips would.");
    page.warning("1.2 % of the measurements were found to be outliers.");
    page.details("Model as used", |p| {
        p.code("[camera]\nfree = [\"f\", \"pp\"]");
    });
}
