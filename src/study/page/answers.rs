//! What the publication left open.

use super::tables::{check_table, judged_row, residual_figures};
use crate::camera::F;
use crate::math::probability::p_value;
use crate::report::figures::{Axis, LineChart, LineStyle, Panel, Series, line_chart};
use crate::report::html::Page;
use crate::report::numbers::{fixed, mm, or_dash, percent, significant};
use crate::report::tables::Table;
use crate::study::cases::{
    FLIGHTS, FLIGHTS_FOCAL_ERROR_PX, GROWTH, LENGTHS_M, REALISTIC_K, flight_choices, flights_key, length_key,
    realistic_key, warming_key,
};
use crate::study::outcome::{Adjusted, Judged, Outcome};
use crate::study::results::{PowerLaw, Results, power_law};
use anyhow::Result;

/// The answers whose cases were run.
pub fn sections(page: &mut Page, results: &Results) -> Result<()> {
    if results.has(&length_key(LENGTHS_M[0])) {
        lengths(page, results)?;
    }
    if results.has(&flights_key("s1", &FLIGHTS)) {
        flight_patterns(page, results)?;
    }
    if results.has("s4-flaw") {
        repairs(page, results)?;
    }
    if results.has(&realistic_key(REALISTIC_K[0])) {
        realistic(page, results)?;
    }
    Ok(())
}

fn lengths(page: &mut Page, results: &Results) -> Result<()> {
    page.section("Left open: how the bowl grows with the length of the corridor");
    page.paragraph(
        "The dike's flights over corridors of 200 m to 5 km, the focal length growing per image as in S3. A longer \
         corridor has more images, so the drift grows with it. Ten control points, whatever the length.",
    );
    let mut table = (Table::new("Bowl against length"))
        .number("length", "m")
        .number("images", "")
        .number("drift, first to last", "px")
        .number("bowl", "mm")
        .number("bowl, exact marks", "mm")
        .number("3D RMS", "mm")
        .number("3D RMS, exact marks", "mm");
    let mut curves: [Vec<[f64; 2]>; 4] = Default::default();
    let mut least_significant = 0.0f64;
    for length in LENGTHS_M {
        let case = match results.outcome(&length_key(length))? {
            Outcome::Adjusted(case) => case,
            Outcome::Impossible { reason, .. } => {
                table.note(format!("{length} m: cannot be adjusted: {reason}"));
                continue;
            }
        };
        let drift = case.true_interior[F] * ((1.0 + GROWTH.0).powf(case.images as f64 - 1.0) - 1.0);
        let (erroneous, exact) = (&case.erroneous_marks, &case.exact_marks);
        let height = |judged: &Judged| judged.bowl.map(|bowl| bowl.height_m);
        least_significant = least_significant.max(erroneous.bowl.map_or(1.0, |bowl| bowl.p_value));
        table.row([
            fixed(length, 0),
            case.images.to_string(),
            fixed(drift, 2),
            or_dash(height(erroneous), mm),
            or_dash(height(exact), mm),
            mm(erroneous.check.rms_m.xyz),
            mm(exact.check.rms_m.xyz),
        ]);
        let values = [height(erroneous), height(exact), Some(erroneous.check.rms_m.xyz), Some(exact.check.rms_m.xyz)];
        for (curve, value) in curves.iter_mut().zip(values) {
            curve.extend(value.map(|value| [length, 1e3 * value.abs()]));
        }
    }
    table.note(format!("Every bowl, marks in the erroneous images: p {}.", p_value(least_significant)));
    let names = ["bowl", "bowl, exact marks", "3D RMS", "3D RMS, exact marks"];
    let mut series = Vec::new();
    for (name, curve) in names.into_iter().zip(curves) {
        if let Some(law) = power_law(&curve) {
            let label = law_of_length(&law);
            table.note(format!("{name}: {label}, within {}.", percent(law.departure)));
            // One law in the picture: that of the bowl.
            if series.is_empty() {
                let ends = [LENGTHS_M[0], LENGTHS_M[LENGTHS_M.len() - 1]];
                series.push(Series::new(label, ends.map(|x| [x, law.at(x)]).to_vec()).style(LineStyle::Dashed));
            }
        }
        series.push(Series::new(name, curve).style(LineStyle::Markers));
    }
    page.table(&table);
    page.paragraph(
        "The bowl grows with the cube of the length. The drift grows with the number of images, and so with the \
         length. A bent strip departs from its chord by the square of the length.",
    );
    let panel = Panel {
        x: Axis::new("length of the corridor", "m").log(),
        y: Axis::new("size", "mm").log(),
        series,
        ..Panel::default()
    };
    let chart = LineChart {
        title: "Deformation against the length of the corridor".into(),
        panels: vec![panel],
        columns: 1,
        ..LineChart::default()
    };
    page.figure("length", line_chart(&chart), "Sizes without sign; dashed: power law fitted to the bowl.");
    Ok(())
}

/// A law of sizes in mm against the length in m.
pub fn law_of_length(law: &PowerLaw) -> String {
    let [size, exponent] = [significant(law.at(LENGTHS_M[0]), 3), fixed(law.exponent, 2)];
    format!("{size} mm (length / {} m)^{exponent}", LENGTHS_M[0])
}

fn flight_patterns(page: &mut Page, results: &Results) -> Result<()> {
    page.section("Left open: which flights limit the deformation");
    page.paragraph(&format!(
        "S1 (f wrong by {FLIGHTS_FOCAL_ERROR_PX} px and held), S2 about PP, S3 and S4 for every choice of the four \
         flights. The errors are put into the whole block first, so an image has the same error in every choice."
    ));
    let mut table = (Table::new("Every choice of flights: 3D RMS at the check points, change of camera height, bowl"))
        .text("flights", "")
        .number("S1 RMS", "mm")
        .number("S1 height", "m")
        .number("S2 RMS", "µm")
        .number("S3 RMS", "mm")
        .number("S3 bowl", "mm")
        .number("S4 RMS", "mm")
        .number("S4 bowl", "mm");
    table.note(format!("Flights: {SHORT}."));
    let mut reasons: Vec<(String, String)> = Vec::new();
    let mut curves: [Vec<[f64; 2]>; 3] = Default::default();
    let choices = flight_choices();
    for (place, flights) in choices.iter().enumerate() {
        let mut cases: Vec<Option<&Adjusted>> = Vec::new();
        for experiment in ["s1", "s2", "s3", "s4"] {
            let outcome = results.outcome(&flights_key(experiment, flights))?;
            if let Outcome::Impossible { reason, .. } = outcome {
                reasons.push((format!("{} of {}", experiment.to_uppercase(), flights.join(" + ")), reason.clone()));
            }
            cases.push(outcome.adjusted());
        }
        let rms = |k: usize| cases[k].map(|case| case.erroneous_marks.check.rms_m.xyz);
        let bowl = |k: usize| cases[k].and_then(|case| case.erroneous_marks.bowl).map(|bowl| bowl.height_m);
        table.row([
            short(flights),
            or_dash(rms(0), mm),
            or_dash(cases[0].map(|case| case.camera_height_change_m), |h| fixed(h, 3)),
            or_dash(rms(1), |metres| significant(1e6 * metres, 2)),
            or_dash(rms(2), mm),
            or_dash(bowl(2), mm),
            or_dash(rms(3), mm),
            or_dash(bowl(3), mm),
        ]);
        for (curve, k) in curves.iter_mut().zip([0, 2, 3]) {
            curve.extend(rms(k).map(|metres| [place as f64, 1e3 * metres]));
        }
    }
    if !reasons.is_empty() {
        table.note("-: cannot be adjusted; the reasons stand below.");
    }
    page.table(&table);
    let letters: Vec<String> = choices.iter().map(|flights| short(flights)).collect();
    let series = ["S1", "S3", "S4"].into_iter().zip(curves);
    let panel = Panel {
        x: Axis::named(format!("flights ({SHORT})"), letters),
        y: Axis::new("3D RMS at the check points", "mm").log(),
        series: series.map(|(name, curve)| Series::new(name, curve).style(LineStyle::Markers)).collect(),
        ..Panel::default()
    };
    let chart = LineChart {
        title: "Deformation by choice of flights".into(),
        panels: vec![panel],
        columns: 1,
        ..LineChart::default()
    };
    page.figure("choices", line_chart(&chart), "Every choice of flights; missing where the block cannot be adjusted.");
    if !reasons.is_empty() {
        page.details("Choices that cannot be adjusted, and why", |page| {
            page.list(reasons.iter().map(|(what, reason)| format!("{what}: {reason}")));
        });
    }
    Ok(())
}

/// What the letters of [`short`] mean.
const SHORT: &str = "O oblique at 50 m; 5, 3, 7 nadir at 50, 30, 70 m";

/// `O57` for the oblique flight and the nadir flights at 50 and 70 m.
fn short(flights: &[&str]) -> String {
    flights
        .iter()
        .map(|name| if *name == FLIGHTS[0] { "O".into() } else { name["nadir".len()..][..1].to_string() })
        .collect()
}

fn repairs(page: &mut Page, results: &Results) -> Result<()> {
    page.section("Left open: does a better camera model repair it");
    let cases = [
        ("s3", "S3, plain"),
        ("s3-order", "focal-time by image"),
        ("s3-time", "focal-time by time"),
        ("s3-spline", "focal-spline"),
        ("s4", "S4, plain"),
        ("s4-flaw", "local-flaw, from the known place"),
        ("s4-grid", "image-grid around the known place"),
        ("s4-grid-sensor", "image-grid over the sensor"),
    ];
    let mut table = check_table("Check points before and after").number("RMS falls", "times");
    for (key, name) in cases {
        match results.outcome(key)? {
            Outcome::Adjusted(case) => {
                let before = results.adjusted(&key[..2])?.erroneous_marks.check.rms_m.xyz;
                judged_row(&mut table, name, &case.erroneous_marks);
                if let Some(row) = table.rows.last_mut() {
                    row.push(significant(before / case.erroneous_marks.check.rms_m.xyz, 3));
                }
            }
            Outcome::Impossible { reason, .. } => {
                table.note(format!("{name}: cannot be adjusted: {reason}"));
            }
        }
    }
    table.note(
        "Marks in the erroneous images: a model that has the error in it would take it out of exact marks a second \
                time.",
    );
    page.table(&table);
    let mut table = (Table::new("What was estimated"))
        .text("case", "")
        .text("parameter", "")
        .number("value", "")
        .number("sigma for 0.5 px", "");
    for key in ["s3-order", "s3-time", "s4-flaw"] {
        for (name, value, sigma) in results.outcome(key)?.adjusted().map_or(&[][..], |case| &case.effects) {
            table.row([key.to_string(), name.clone(), significant(*value, 7), significant(*sigma, 2)]);
        }
    }
    page.table(&table);
    page.paragraph(
        "The drift of S3 goes by the number of the image. Against time it is only nearly linear, since flights differ \
         in speed and pauses lie between them: focal-time cannot model the difference. A grid repairs the part of the \
         flaw that its cells can follow. Cells of 100 px around the known place follow all but its sharp middle. The \
         cells of 1000 px over the whole sensor follow next to nothing.",
    );
    for (key, title) in
        [("s3-time", "S3 with focal-time against time"), ("s4-grid", "S4 with image-grid around the known place")]
    {
        if let Some(pictures) = results.outcome(key)?.adjusted().and_then(|case| case.pictures.as_ref()) {
            page.details(&format!("Remaining residuals: {title}"), |page| {
                residual_figures(page, key, title, &pictures.erroneous, None);
            });
        }
    }
    Ok(())
}

fn realistic(page: &mut Page, results: &Results) -> Result<()> {
    page.section("Left open: realistic temperatures");
    page.paragraph(
        "6.17 px stand for 80 K in the publication, which gives 20 to 40 K as realistic. One case grows as in S3, in \
         proportion; in the other a lens warms up evenly in time. Each is adjusted without and with the effect \
         focal-temperature.",
    );
    let mut table =
        check_table("Residuals at the check points, marks in the erroneous images").number("estimated f", "px");
    let mut row = |name: String, key: &str| -> Result<()> {
        match results.outcome(key)? {
            Outcome::Adjusted(case) => {
                judged_row(&mut table, &name, &case.erroneous_marks);
                if let Some(row) = table.rows.last_mut() {
                    row.push(fixed(case.interior[F], 3));
                }
            }
            Outcome::Impossible { reason, .. } => drop(table.note(format!("{name}: cannot be adjusted: {reason}"))),
        }
        Ok(())
    };
    row("80 K, by image (S3)".into(), "s3")?;
    for rise in REALISTIC_K {
        row(format!("{rise} K, by image"), &realistic_key(rise))?;
    }
    for rise in REALISTIC_K {
        row(format!("{rise} K in time"), &warming_key(rise, false))?;
        row(format!("{rise} K in time, temperature in the model"), &warming_key(rise, true))?;
    }
    page.table(&table);
    Ok(())
}
