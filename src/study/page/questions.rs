//! What the publication left open, answered in a line each.

use super::answers::law_of_length;
use crate::report::numbers::{fixed, mm, percent, significant};
use crate::study::cases::{
    FLIGHTS, LENGTHS_M, REALISTIC_K, flight_choices, flights_key, length_key, realistic_key, warming_key,
};
use crate::study::outcome::Adjusted;
use crate::study::results::{Results, power_law};
use anyhow::Result;

/// A question and our answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// What was left open.
    pub question: String,
    /// What our runs say.
    pub answer: String,
}

/// Every question whose cases were run.
///
/// # Errors
/// A case of S3 or S4 that is missing or could not be adjusted.
pub fn questions(results: &Results) -> Result<Vec<Question>> {
    let mut list = Vec::new();
    let mut put = |question: &str, answer: String| list.push(Question { question: question.into(), answer });
    if let Some(answer) = length(results) {
        put("How does the bowl of S3 grow with the length of the corridor?", answer);
    }
    if results.has(&flights_key("s3", &FLIGHTS)) {
        put("Which flights limit the deformation?", flights(results)?);
    }
    if results.has("s3-order") {
        let models =
            [("s3-order", "focal-time by image"), ("s3-time", "focal-time by time"), ("s3-spline", "focal-spline")];
        put("Does a modelled drift repair S3?", folds(results, "s3", &models)?);
        let models = [
            ("s4-flaw", "local-flaw"),
            ("s4-grid", "image-grid around the flaw"),
            ("s4-grid-sensor", "image-grid over the sensor"),
        ];
        put("Do empirical camera models repair S4?", folds(results, "s4", &models)?);
    }
    if results.has(&realistic_key(REALISTIC_K[0])) {
        put("What do realistic temperatures do?", temperatures(results)?);
    }
    Ok(list)
}

fn rms(case: &Adjusted) -> f64 {
    case.erroneous_marks.check.rms_m.xyz
}

/// Height of the bowl against the length of the corridor, where the cases could be adjusted.
fn length(results: &Results) -> Option<String> {
    let bowl = |length: &f64| {
        let case = results.adjusted(&length_key(*length)).ok()?;
        Some([*length, 1e3 * case.erroneous_marks.bowl?.height_m])
    };
    let points: Vec<[f64; 2]> = LENGTHS_M.iter().filter_map(bowl).collect();
    let law = power_law(&points)?;
    let [longest, height] = points.last()?;
    Some(format!(
        "as {}, within {}: {} m at {longest} m",
        law_of_length(&law),
        percent(law.departure),
        significant(height / 1e3, 3)
    ))
}

/// Least and largest 3D RMS of each experiment over the choices with and without the oblique flight.
fn flights(results: &Results) -> Result<String> {
    let mut parts = Vec::new();
    for oblique in [true, false] {
        let mut ranges = Vec::new();
        for experiment in ["s1", "s3", "s4"] {
            let mut sizes = Vec::new();
            for flights in flight_choices().iter().filter(|flights| flights.contains(&FLIGHTS[0]) == oblique) {
                sizes.extend(results.outcome(&flights_key(experiment, flights))?.adjusted().map(rms));
            }
            let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = sizes.iter().copied().fold(0.0, f64::max);
            ranges.push(format!("{} {} to {}", experiment.to_uppercase(), mm(least), mm(largest)));
        }
        let choices = if oblique { "choices with the oblique flight" } else { "without it" };
        parts.push(format!("{choices}: {}", ranges.join(", ")));
    }
    Ok(format!("3D RMS in mm, {}", parts.join("; ")))
}

/// By how much the 3D RMS falls with each model.
fn folds(results: &Results, plain: &str, models: &[(&str, &str)]) -> Result<String> {
    let before = rms(results.adjusted(plain)?);
    let mut parts = Vec::new();
    for (key, name) in models {
        let part = match results.outcome(key)?.adjusted() {
            Some(case) => format!("{} times with {name}", significant(before / rms(case), 3)),
            None => format!("{name} cannot be adjusted"),
        };
        parts.push(part);
    }
    Ok(format!("the 3D RMS falls {}", parts.join(", ")))
}

fn temperatures(results: &Results) -> Result<String> {
    let mean = |key: &str| {
        let case = results.outcome(key)?.adjusted();
        Ok::<_, anyhow::Error>(case.map_or_else(|| "-".into(), |case| mm(case.erroneous_marks.check.mean_m.xyz)))
    };
    let mut parts = Vec::new();
    for rise in REALISTIC_K {
        let [image, time, modelled] =
            [realistic_key(rise), warming_key(rise, false), warming_key(rise, true)].map(|key| mean(&key));
        parts.push(format!("{} K {}, {}, {}", fixed(rise, 0), image?, time?, modelled?));
    }
    Ok(format!("3D mean in mm by image, in time, in time with focal-temperature: {}", parts.join("; ")))
}
