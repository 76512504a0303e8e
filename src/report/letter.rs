//! The findings as an expert would write them: what each effect is, how large, what it did to the points, how sure that is, what else it could
//! be, what to do, and the one picture that shows it, before and after.

use super::figures::{Axis, ImageBar, ImageBars, LineChart, LineStyle, Panel, Series, image_bars, line_chart};
use super::html::Page;
use super::numbers::{fixed, mm, p_value, significant, with_sigma};
use super::run::{RunFolder, sensor_figures};
use super::words::{self, Picture};
use crate::diagnose::impact::Impact;
use crate::diagnose::verdict::{Diagnosis, EstimateEntry, FoundEntry};
use crate::run::folder::{BASE, FINAL, GnssRow, ProfileRow};
use std::collections::BTreeMap;

/// Parameters of an effect that are named one by one; of more, their number and their sizes in px and mm say it better.
const NAMED_PARAMETERS: usize = 4;

/// One section per effect that was found.
pub(super) fn letter(page: &mut Page, run: &RunFolder, diagnosis: &Diagnosis) {
    let mut sensor_shown = false;
    for found in &diagnosis.found {
        page.section(&format!("Found: {}", found.effect));
        for sentence in sentences(found) {
            page.paragraph(&sentence);
        }
        if !found.plausible {
            page.warning(
                "The estimate is beyond what physics allows of this effect: take it as a shape that looks like it, and look for the cause \
                 among what it could also be.",
            );
        }
        match words::of(&found.effect).map(|words| words.picture) {
            Some(Picture::Sensor) if !sensor_shown => {
                sensor_shown = true;
                sensor_figures(page, run, &found.effect);
            }
            Some(Picture::Against(against)) => against_figure(page, run, found, against),
            Some(Picture::Images) => image_figures(page, run, found),
            Some(Picture::Heading) => gnss_figure(page, run, found, "heading", "degrees", |row| row.heading_deg),
            Some(Picture::GnssTime) => gnss_figure(page, run, found, "time", "s", |row| row.time_s),
            _ => {}
        }
    }
}

/// The findings on one effect, a sentence or two each.
pub fn sentences(found: &FoundEntry) -> Vec<String> {
    let mut sentences = Vec::new();
    let words = words::of(&found.effect);
    sentences.extend(words.map(|words| words.what.to_string()));
    let mut size = format!("Size: {}.", sizes(&found.estimate));
    if let Some(impact) = &found.impact {
        size += &format!(" {}.", moved(impact));
    }
    size += &format!(
        " In the images it is {} px (RMS over all coordinates, what the other unknowns absorb left out).",
        significant(found.size_px, 2)
    );
    sentences.push(size);
    sentences.push(format!(
        "How sure: beside everything else in the model, chance alone would show as much with p = {}.",
        probability(found)
    ));
    let tell = words.map_or(String::new(), |words| format!(" To tell: {}.", words.tell));
    sentences.push(match found.inseparable_from.as_slice() {
        [] => format!("Nothing else of the catalogue looks like it in this block.{tell}"),
        others => format!("It could also be {}: this block cannot tell.{tell}", others.join(", ")),
    });
    sentences.extend(words.map(|words| format!("What to do: {}", words.remedy)));
    sentences
}

fn probability(found: &FoundEntry) -> String {
    if found.p_value > 0.0 {
        return p_value(found.p_value);
    }
    format!("1e{:.0}", found.ln_p_value / std::f64::consts::LN_10)
}

fn sizes(estimate: &BTreeMap<String, EstimateEntry>) -> String {
    if estimate.len() > NAMED_PARAMETERS {
        return format!("{} coefficients, in summary.json", estimate.len());
    }
    let size = |(name, e): (&String, &EstimateEntry)| format!("{name} = {} {}", with_sigma(e.value, e.sigma), e.unit);
    estimate.iter().map(size).collect::<Vec<_>>().join(", ")
}

fn moved(Impact { rms_m, height_m, surveyed }: &Impact) -> String {
    let points = if *surveyed { "the surveyed points" } else { "the points (a sample, after a similarity)" };
    format!("It moved {points} by {} mm, of which {} mm in height", mm(*rms_m), mm(*height_m))
}

fn id(found: &FoundEntry) -> String {
    format!("found-{}", found.effect.replace(|c: char| !c.is_ascii_alphanumeric(), "-"))
}

/// Mean residuals against what was recorded, before and after in one picture: the same axes.
fn against_figure(page: &mut Page, run: &RunFolder, found: &FoundEntry, against: &str) {
    let component_of = |row: &&ProfileRow| row.against == against;
    let Some(first) = run.profiles.iter().find(component_of) else {
        return image_figures(page, run, found);
    };
    let (component, unit) = (first.component.clone(), first.unit.clone());
    let series = |stage: &str, label: &str| {
        let rows = run.profiles.iter().filter(|row| {
            row.stage == stage && row.against == against && row.component == component && row.unit == unit
        });
        let (points, sigma): (Vec<_>, Vec<_>) =
            rows.map(|row| ([row.x, row.mean_px], 2.0 * row.sigma_px.unwrap_or(f64::NAN))).unzip();
        Series::new(label, points).sigma(sigma)
    };
    let panel = Panel {
        x: Axis::new(against, unit.as_str()),
        y: Axis::new(format!("mean residual, {component}"), "px"),
        series: vec![series(BASE, "before"), series(FINAL, "after")],
        ..Panel::default()
    };
    let chart = LineChart {
        title: format!("Mean residual against {against}"),
        panels: vec![panel],
        columns: 1,
        note: "Bars: ± 2 sigma of the mean.".into(),
    };
    page.figure(&id(found), line_chart(&chart), "What was left without the effect, and what is left with it.");
}

/// The scale of each image, before and after.
fn image_figures(page: &mut Page, run: &RunFolder, found: &FoundEntry) {
    let flights = run.flights();
    let largest = run.scales.iter().filter_map(|row| row.scale_px).fold(0.0, |a: f64, b| a.max(b.abs()));
    let chart = |stage: &str, title: &str| {
        let bar = |row: &crate::run::folder::ImageScaleRow| {
            let flight = flights.iter().position(|name| *name == row.flight)?;
            let whisker = row.sigma_px.map(|sigma| 2.0 * sigma);
            Some(ImageBar { value: row.scale_px?, whisker, flight, significant: false })
        };
        let bars: Vec<ImageBar> = run.scales.iter().filter(|row| row.stage == stage).filter_map(bar).collect();
        (!bars.is_empty()).then(|| {
            image_bars(&ImageBars {
                title: title.into(),
                order: "image in the order of the block".into(),
                y: Axis::new("at half the diagonal", "px").range(-largest, largest),
                flights: flights.clone(),
                bars,
                whisker_means: "± 2 sigma".into(),
                ..ImageBars::default()
            })
        })
    };
    if let (Some(before), Some(after)) = (chart(BASE, "Scale of each image, before"), chart(FINAL, "After")) {
        page.pair(
            (
                &format!("{}-base", id(found)),
                before,
                "By how much an image is too large or too small for its neighbours.",
            ),
            (&format!("{}-final", id(found)), after, "The same with the effect in the model."),
        );
    }
}

/// One of the three residuals of a position, m.
type Residual = fn(&GnssRow) -> Option<f64>;

/// GNSS residuals along the track, across and up, before and after.
fn gnss_figure(
    page: &mut Page,
    run: &RunFolder,
    found: &FoundEntry,
    against: &str,
    unit: &str,
    x: impl Fn(&GnssRow) -> Option<f64>,
) {
    if run.gnss.is_empty() {
        return;
    }
    let values: [(&str, Residual); 3] = [
        ("along the track", |row| row.along_m),
        ("across the track", |row| row.across_m),
        ("up", |row| Some(row.up_m)),
    ];
    let panel = |(title, value): &(&str, Residual)| {
        let series = |stage: &str, label: &str| {
            let rows = run.gnss.iter().filter(|row| row.stage == stage);
            let points = rows.filter_map(|row| Some([x(row)?, 1e3 * value(row)?])).collect();
            Series::new(label, points).style(LineStyle::Markers)
        };
        Panel {
            x: Axis::new(against, unit),
            y: Axis::new(*title, "mm"),
            series: vec![series(BASE, "before"), series(FINAL, "after")],
            ..Panel::default()
        }
    };
    let chart = LineChart {
        title: format!("GNSS residuals against {against}"),
        panels: values.iter().map(panel).collect(),
        columns: 1,
        note: "Observed minus computed, one mark per image.".into(),
    };
    page.figure(&id(found), line_chart(&chart), "What was left without the effect, and what is left with it.");
}

/// The sentence that weighs what is left.
pub(super) fn weight(page: &mut Page, diagnosis: &Diagnosis) {
    if let Some(weight) = &diagnosis.weight {
        page.paragraph(&weight.sentence);
    }
}

/// A finding of its own: stated precisions that the residuals contradict.
pub fn weights_sentence(diagnosis: &Diagnosis) -> Option<String> {
    let factors = &diagnosis.sigma_factors;
    let all = [
        ("image measurements", factors.image),
        ("control in plan", factors.control),
        ("control in height", factors.control_z),
        ("GNSS in plan", factors.gnss),
        ("GNSS in height", factors.gnss_z),
    ];
    let beyond: Vec<String> = all
        .iter()
        .filter(|(_, factor)| *factor >= crate::diagnose::weights::MOST)
        .map(|(what, factor)| format!("{what} ({} times)", fixed(*factor, 1)))
        .collect();
    (!beyond.is_empty()).then(|| {
        format!(
            "Much less precise than stated: {}. That is no question of precision any more: look for wrong coordinates, a wrong frame or a \
             missing effect, first in the images and points with the largest residuals.",
            beyond.join(", ")
        )
    })
}
