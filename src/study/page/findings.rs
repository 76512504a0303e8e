//! The publication's statements, each held against our figures.

use crate::camera::F;
use crate::math::probability::p_value;
use crate::report::numbers::{fixed, mm, percent, px, significant};
use crate::study::cases::{FOCAL_ERRORS_PX, s1_key};
use crate::study::outcome::Adjusted;
use crate::study::published;
use crate::study::results::{Results, asymmetry, proportionality};
use anyhow::Result;

/// A statement that can hold or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What is said.
    pub statement: String,
    /// The published figure.
    pub published: String,
    /// Ours.
    pub ours: String,
    /// Does ours bear the statement out?
    pub agrees: bool,
}

/// Departure from a law that still counts as the law.
const LAW: f64 = 0.05;
/// A bowl is there when chance would make it less often than this.
const BOWL_P: f64 = 1e-6;

fn finding(statement: &str, published: impl Into<String>, ours: String, agrees: bool) -> Finding {
    Finding { statement: statement.into(), published: published.into(), ours, agrees }
}

/// RMS at the check points (m) and change of the mean camera height (m) against the error of the focal length (px), for
/// the cases of S1 with these flights (`all` or `nadir`).
///
/// # Errors
/// A case that is missing or could not be adjusted.
pub fn s1_curves(results: &Results, group: &str) -> Result<[Vec<[f64; 2]>; 2]> {
    let mut curves = [Vec::new(), Vec::new()];
    for error in FOCAL_ERRORS_PX {
        let case = results.adjusted(&s1_key(group, error))?;
        curves[0].push([f64::from(error), case.erroneous_marks.check.rms_m.xyz]);
        curves[1].push([f64::from(error), case.camera_height_change_m]);
    }
    Ok(curves)
}

/// Every statement.
///
/// # Errors
/// A case of S0 to S4 that is missing or could not be adjusted.
pub fn findings(results: &Results) -> Result<Vec<Finding>> {
    let s0 = results.adjusted("s0")?;
    let mut found = vec![finding(
        "S0: the error-free block comes back",
        format!("{} px, {} nm", published::S0_REPROJECTION_PX, published::S0_CHECK_M * 1e9),
        format!("{} px, {} nm", px(s0.tie_rms_px), significant(1e9 * rms(s0), 2)),
        s0.tie_rms_px <= published::S0_REPROJECTION_PX && rms(s0) <= 1e-6,
    )];
    found.extend(s1(results)?);
    found.extend(s2(results)?);
    found.extend(s3_s4(results)?);
    Ok(found)
}

fn rms(case: &Adjusted) -> f64 {
    case.erroneous_marks.check.rms_m.xyz
}

fn s1(results: &Results) -> Result<Vec<Finding>> {
    let (all, nadir) = (s1_curves(results, "all")?, s1_curves(results, "nadir")?);
    let sizes = |curve: &[[f64; 2]]| curve.iter().map(|[x, y]| [x.abs(), *y]).collect::<Vec<_>>();
    let worst = |values: [f64; 2]| values[0].max(values[1]);
    let rms_law = worst([&all, &nadir].map(|curves| proportionality(&sizes(&curves[0])).1));
    let height_law = worst([&all, &nadir].map(|curves| proportionality(&curves[1]).1));
    let symmetry = worst([&all, &nadir].map(|curves| asymmetry(&curves[0])));
    let slope = |curve: &[[f64; 2]]| proportionality(curve).0.abs();
    let rms_ratio = slope(&sizes(&nadir[0])) / slope(&sizes(&all[0]));
    let height_ratio = slope(&nadir[1]) / slope(&all[1]);
    Ok(vec![
        finding(
            "S1: the RMS grows linearly with the error",
            "linear",
            format!("to {}", percent(rms_law)),
            rms_law < LAW,
        ),
        finding(
            "S1: so does the change of camera height",
            "linear",
            format!("to {}", percent(height_law)),
            height_law < LAW,
        ),
        finding(
            "S1: the sign does not matter for the RMS",
            "symmetric",
            format!("to {}", percent(symmetry)),
            symmetry < LAW,
        ),
        finding(
            "S1: the RMS is much smaller with nadir images alone",
            "much smaller",
            format!("{} times that of all flights", fixed(rms_ratio, 2)),
            rms_ratio < 0.5,
        ),
        finding(
            "S1: the change of camera height is greater with nadir images alone",
            "greater",
            format!("{} times that of all flights", fixed(height_ratio, 2)),
            height_ratio > 1.0,
        ),
    ])
}

fn s2(results: &Results) -> Result<Vec<Finding>> {
    let mut found = Vec::new();
    for (centre, published, places) in [("pp", published::S2_ABOUT_PP, [1, 2]), ("dc", published::S2_ABOUT_DC, [3, 4])]
    {
        let case = results.adjusted(&format!("s2-{centre}"))?;
        let moved = places.map(|k| (case.interior[k] - case.true_interior[k]).abs());
        let moved = moved[0].max(moved[1]);
        let name = centre.to_uppercase();
        found.push(finding(
            &format!("S2 about {name}: the focal length takes the error up"),
            format!("{} px", published[0]),
            format!("{} px", fixed(case.interior[F], 3)),
            (case.interior[F] - published[0]).abs() < 0.01,
        ));
        found.push(finding(
            &format!("S2 about {name}: {name} stays where it is"),
            "to 0.01 px",
            format!("to {} px", significant(moved, 1)),
            moved < 0.01,
        ));
        found.push(finding(
            &format!("S2 about {name}: check points"),
            "micrometres",
            format!("{} micrometres RMS", significant(1e6 * rms(case), 2)),
            rms(case) < 1e-5,
        ));
    }
    Ok(found)
}

fn s3_s4(results: &Results) -> Result<Vec<Finding>> {
    let (s2, s3, s4) = (results.adjusted("s2-pp")?, results.adjusted("s3")?, results.adjusted("s4")?);
    let mut found = Vec::new();
    if let Some(pictures) = &s3.pictures {
        let ends = [pictures.focal_by_image.first(), pictures.focal_by_image.last()];
        if let [Some(first), Some(last)] = ends.map(Option::<&f64>::copied) {
            let [published_first, published_last, published_f] = published::S3_FOCAL_PX;
            found.push(finding(
                "S3: the focal length of the last image over that of the first",
                fixed(published_last / published_first, 6),
                fixed(last / first, 6),
                (last / first - published_last / published_first).abs() < 1e-6,
            ));
            found.push(finding(
                "S3: the estimated focal length lies between them",
                format!("{published_f} px"),
                format!("{} px, between {} and {}", fixed(s3.interior[F], 2), fixed(first, 2), fixed(last, 2)),
                (first..last).contains(&s3.interior[F]),
            ));
        }
    }
    if let Some(bowl) = s3.erroneous_marks.bowl {
        found.push(finding(
            "S3: a bowl, the ends of the dike up and its middle down",
            "slight",
            format!("{} mm, p {}", mm(bowl.height_m), p_value(bowl.p_value)),
            bowl.coefficient_per_m > 0.0 && bowl.p_value < BOWL_P,
        ));
    }
    let mean = |case: &Adjusted| case.erroneous_marks.check.mean_m.xyz;
    let published_mm = [published::S3_CHECK_MM, published::S4_CHECK_MM].map(|table| table[2][0]);
    found.push(finding(
        "The local error does more harm than the drift, the homothety least (mean in space)",
        format!("{} > {} > 0 mm", published_mm[1], published_mm[0]),
        format!("{} > {} > {} mm", mm(mean(s4)), mm(mean(s3)), mm(mean(s2))),
        mean(s4) > mean(s3) && mean(s3) > mean(s2),
    ));
    Ok(found)
}
