//! What a diagnosis adds to the page of a run.

use super::diagnosis_tables::{candidates_table, ledger_table, structure_table, untested_table};
use super::figures::{Axis, BinnedProfile, ImageBar, ImageBars, Ledger, LedgerStep, image_bars, ledger, profile};
use super::html::Page;
use super::numbers::{fixed, significant};
use super::pictures::RunFolder;
use super::sensor_section::sensor_figures;
use super::tables::Table;
use crate::diagnose::verdict::Diagnosis;
use crate::run::fit::FEW_ITERATIONS;
use crate::run::folder::ProfileRow;

/// An effect whole, as it stands in the catalogue: what one writes oneself looks the same.
const EXAMPLE: &str = include_str!("../../cpp/effects/focal-time.h");

/// What is left, in words.
pub(super) fn left(page: &mut Page, diagnosis: &Diagnosis) {
    if !diagnosis.left.is_empty() {
        page.section("What is left").list(&diagnosis.left);
        own_effect(page);
    }
}

/// How the diagnosis went about it: levels, weights, what was set aside.
pub(super) fn how(page: &mut Page, diagnosis: &Diagnosis) {
    let slow = slow_refits(diagnosis);
    if !slow.is_empty() {
        page.note(&slow);
    }
    if let Some(set_aside) = diagnosis.set_aside() {
        page.note(&set_aside);
    }
    for known in &diagnosis.known {
        page.paragraph(&format!(
            "{} is in every model with {} = {}: {}.",
            known.effect,
            known.parameter,
            significant(known.value, 3),
            known.source
        ));
    }
    let factors = &diagnosis.sigma_factors;
    page.paragraph(&format!(
        "Tests are at the level {} over the whole catalogue. The residuals gave factors on the stated standard \
         deviations; 1 means as stated. They are {} (image), {} beside that (marks), {} and {} (control, plan and \
         height), {} and {} (GNSS, plan and height).",
        diagnosis.significance,
        fixed(factors.image, 3),
        fixed(factors.mark, 3),
        fixed(factors.control, 3),
        fixed(factors.control_z, 3),
        fixed(factors.gnss, 3),
        fixed(factors.gnss_z, 3)
    ));
    for (flight, of) in &diagnosis.flight_factors {
        page.paragraph(&format!(
            "Those of flight {flight} were multiplied by {} (image), {} and {} (GNSS, plan and height) beside that.",
            fixed(of.image, 3),
            fixed(of.gnss, 3),
            fixed(of.gnss_z, 3)
        ));
    }
}

/// Refits that took more steps than one that starts at the predicted solution should.
fn slow_refits(diagnosis: &Diagnosis) -> String {
    let slow = diagnosis.ledger.iter().filter(|row| row.step > 0 && row.iterations > FEW_ITERATIONS);
    let slow: Vec<String> =
        slow.map(|row| format!("{} ({})", row.added.as_deref().unwrap_or("base"), row.iterations)).collect();
    if slow.is_empty() {
        return String::new();
    }
    format!("Refits that took more than {FEW_ITERATIONS} iterations: {}.", slow.join(", "))
}

fn own_effect(page: &mut Page) {
    page.details("How to write the effect yourself", |page| {
        page.paragraph(
            "An effect is one C++ header: what it is called, its parameters, and one formula from the values without \
             it to the values with it. At the nominal parameters it must change nothing. Derivatives come from the \
             formula. This one is whole:",
        );
        page.code(EXAMPLE);
        page.paragraph(
            "From a template to a plug-in that takes part in adjustment, diagnosis and report like those of the \
                        catalogue:",
        );
        page.code(
            "misclosure effects new my-effect --stage image\n\
             misclosure effects build my-effect.h -o my-effect.so\n\
             misclosure effects check my-effect.so\n\
             misclosure diagnose BLOCK -o RUN --plugin my-effect.so",
        );
        page.paragraph(
            "A plug-in has one derivation: the two solvers are not independent there. Where they are compared the \
             native one differentiates its values numerically, so that a wrong derivative still shows.",
        );
    });
}

/// Every candidate.
pub(super) fn candidates(page: &mut Page, diagnosis: &Diagnosis, scaled: bool) {
    page.section("Candidates");
    page.paragraph(
        "Every effect of the catalogue was tested at the base model, before any was added. A refit with the effect \
         would lower the weighted sum of squares by the predicted drop. The change of check points is that of their \
         errors with the effect added. Check points decide nothing.",
    );
    let (significant, others): (Vec<_>, Vec<_>) =
        diagnosis.candidates.iter().cloned().partition(|candidate| candidate.significant);
    if significant.is_empty() {
        page.paragraph("None was significant.");
    } else {
        page.table(&candidates_table(&significant, usize::MAX, scaled));
    }
    page.details("Candidates that were not significant, or that this block cannot test", |page| {
        page.table(&candidates_table(&others, usize::MAX, scaled));
        if others.iter().any(|candidate| !candidate.tested) {
            page.table(&untested_table(&others));
        }
    });
}

/// Steps of a search beyond which its first and last are shown, and the others folded.
const LONG_SEARCH: usize = 12;

/// The ledger as table and curves; without check points where lengths on the ground mean nothing.
pub(super) fn ledger_section(page: &mut Page, diagnosis: &Diagnosis, lengths: bool) {
    page.section("Ledger");
    let table = ledger_table(diagnosis, lengths);
    match table.rows.len() > LONG_SEARCH {
        true => {
            let last = table.rows.len() - 1;
            let ends = Table { rows: vec![table.rows[0].clone(), table.rows[last].clone()], ..table.clone() };
            page.table(&ends).details(&format!("All {} steps", table.rows.len()), |page| {
                page.table(&table);
            });
        }
        false => {
            page.table(&table);
        }
    }
    let steps = diagnosis.ledger.iter().map(|row| LedgerStep {
        name: match &row.added {
            None => "base".into(),
            Some(name) if name.starts_with('-') => name.clone(),
            Some(name) => format!("+ {name}"),
        },
        heldout_px: row.heldout_rms_px.unwrap_or(f64::NAN),
        check_mm: row.check_rms_m.filter(|_| lengths).map(|rms| 1e3 * rms),
        sigma0: row.sigma0,
    });
    let steps: Vec<LedgerStep> = steps.collect();
    if steps.len() > 1 {
        let curves = Ledger { title: "What each step did".into(), steps, without_lengths: !lengths, width: None };
        page.figure("ledger", ledger(&curves), "Left-out measurements are predicted by the model, not fitted.");
    }
}

/// Tests and pictures of residual structure.
pub(super) fn structure(page: &mut Page, run: &RunFolder, diagnosis: &Diagnosis) {
    page.section("Structure of the residuals");
    page.table(&structure_table(diagnosis));
    sensor_figures(page, run);
    image_scales(page, run);
    let mut shown: Vec<(&str, &str)> = Vec::new();
    for row in run.profiles.iter().filter(|row| row.stage == "final") {
        if shown.last() != Some(&(&row.against, &row.unit)) && !shown.contains(&(&row.against, &row.unit)) {
            shown.push((&row.against, &row.unit));
        }
    }
    if shown.is_empty() {
        return;
    }
    page.details("Mean residuals against what was recorded", |page| {
        page.part("pair", |page| {
            for (against, unit) in shown {
                profiles(page, run, against, unit);
            }
        });
    });
}

fn image_scales(page: &mut Page, run: &RunFolder) {
    let flights = run.flights();
    let chart = |stage: &str, title: &str| {
        let rows = run.scales.iter().filter(|row| row.stage == stage);
        let bars: Vec<ImageBar> = rows
            .filter_map(|row| {
                let flight = flights.iter().position(|name| *name == row.flight)?;
                let whisker = row.sigma_px.map(|sigma| 2.0 * sigma);
                let name = row.image.clone();
                Some(ImageBar { value: row.scale_px?, whisker, flight, name, ..ImageBar::default() })
            })
            .collect();
        let chart = ImageBars {
            title: title.into(),
            order: "image in the order of the block".into(),
            y: Axis::new("at half the diagonal", "px"),
            flights: flights.clone(),
            bars,
            whisker_means: "± 2 sigma".into(),
            ..ImageBars::default()
        };
        (!chart.bars.is_empty()).then(|| image_bars(&chart))
    };
    if let Some(svg) = chart("base", "Scale residual of each image, before") {
        page.figure("image-scale-base", svg, "By how much an image is too large or too small for its neighbours.");
    }
    if let Some(svg) = chart("final", "Scale residual of each image, at the final model") {
        page.figure("image-scale-final", svg, "");
    }
}

fn profiles(page: &mut Page, run: &RunFolder, against: &str, unit: &str) {
    let mut bins: Vec<(String, Vec<[f64; 3]>)> = Vec::new();
    let of_this = |row: &&ProfileRow| row.stage == "final" && row.against == against && row.unit == unit;
    for row in run.profiles.iter().filter(of_this) {
        let bin = [row.x, row.mean_px, 2.0 * row.sigma_px.unwrap_or(f64::NAN)];
        match bins.iter_mut().find(|(name, _)| *name == row.component) {
            Some((_, list)) => list.push(bin),
            None => bins.push((row.component.clone(), vec![bin])),
        }
    }
    let chart = BinnedProfile {
        title: format!("Mean residual against {against}"),
        x: Axis::new(against, unit),
        y: Axis::new("mean residual", "px"),
        cloud: Vec::new(),
        bins,
        bars: "± 2 sigma of the mean".into(),
        dimmed: 0,
        width: None,
    };
    let name = |text: &str| -> String {
        text.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
    };
    let id = format!("profile-{}-{}", name(against), name(unit));
    page.figure(&id, profile(&chart), "");
}
