//! The check points in one sentence.

use super::patterns::DOME;
use super::{Heights, PatternTest};
use crate::math::probability::p_is;
use crate::problem::Problem;

/// Of tested heights of a fit at a level of significance.
pub(super) fn sentence(heights: &Heights, problem: &Problem, significance: f64) -> String {
    let allows = allows(problem);
    let Heights { dome, plane, dome_allowed_m, coefficients_m: [mean, east, north, height], .. } = heights;
    let (shape, allowed) = (if height.is_sign_negative() { "dome" } else { "bowl" }, millimetres(*dome_allowed_m));
    let size = millimetres(heights.coefficients_m[DOME].abs());
    let p = |test: &PatternTest| p_is(test.p_value);
    if dome.p_value < significance {
        // The plane is fitted by itself: beside such a dome it is a part of it.
        let p = p(dome);
        return format!(
            "Check points show a {shape} of {size} mm; {allows} do not allow it (at most {allowed} mm), {p}."
        );
    }
    let mut text = format!("Check points show a {shape} of {size} mm; {allows} allow {allowed} mm.");
    if plane.p_value < significance {
        let (mean, tilt) = (millimetres(*mean), millimetres(east.hypot(*north)));
        text +=
            &format!(" They do not allow the mean height error of {mean} mm and the tilt of {tilt} mm, {}.", p(plane));
    }
    text
}

/// The observations that fix the block in the survey's system.
fn allows(problem: &Problem) -> &'static str {
    match (problem.control.is_empty(), problem.gnss.is_empty()) {
        (false, false) => "this block's control and GNSS",
        (false, true) => "this block's control points",
        (true, false) => "this block's GNSS positions",
        (true, true) => "this free block and the similarity from its control points",
    }
}

fn millimetres(metres: f64) -> String {
    format!("{:.1}", 1e3 * metres)
}
