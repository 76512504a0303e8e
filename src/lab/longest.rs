//! The longest arrows of all steps: a scale that fits them fits every step.

use crate::report::figures::Arrow;
use crate::report::pictures::{self, RunFolder};
use crate::run::folder::{CheckRow, FINAL};
use serde::Serialize;

/// The longest arrows of a figure, in its unit; zero where there are none.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Longest {
    /// By camera, px.
    pub sensor: Vec<f64>,
    /// Errors of points in plan, mm.
    pub plan: f64,
    /// The same in height, mm.
    pub height: f64,
    /// GNSS positions in plan, m.
    pub gnss_plan: f64,
    /// The same in height, m.
    pub gnss_height: f64,
}

impl Longest {
    /// Of the run of a step; `cameras`: ids, in the order of the block.
    pub(super) fn of_run(run: &RunFolder, cameras: &[&str]) -> Self {
        let of_camera = |id: &&str| {
            let field = pictures::sensor(run, id, FINAL, "");
            field.map_or(0.0, |field| field.sets.iter().map(|set| longest_arrow(&set.arrows)).fold(0.0, f64::max))
        };
        // As the figures choose: control points where there are no check points.
        let of_role = |role: &str| run.checks.iter().filter(|row| row.role == role).collect::<Vec<&CheckRow>>();
        let check = of_role("check");
        let points = if check.is_empty() { of_role("control") } else { check };
        let frame = pictures::frame(run);
        Self {
            sensor: cameras.iter().map(of_camera).collect(),
            plan: longest_arrow(&pictures::plan("", frame, points.iter().copied()).arrows),
            height: largest(&pictures::heights("", frame, points.iter().copied()).values),
            gnss_plan: longest_arrow(&pictures::gnss_plan(frame, &run.gnss).arrows),
            gnss_height: largest(&pictures::gnss_heights(frame, &run.gnss).values),
        }
    }

    pub(super) fn or_longer(self, other: &Self) -> Self {
        let sensor = self.sensor.iter().enumerate();
        Self {
            sensor: sensor.map(|(k, own)| own.max(other.sensor.get(k).copied().unwrap_or(0.0))).collect(),
            plan: self.plan.max(other.plan),
            height: self.height.max(other.height),
            gnss_plan: self.gnss_plan.max(other.gnss_plan),
            gnss_height: self.gnss_height.max(other.gnss_height),
        }
    }
}

/// Length of the longest arrow.
pub(super) fn longest_arrow(arrows: &[Arrow]) -> f64 {
    arrows.iter().map(|(_, d)| d[0].hypot(d[1])).filter(|length| length.is_finite()).fold(0.0, f64::max)
}

/// Size of the largest value.
pub(super) fn largest(values: &[([f64; 2], f64)]) -> f64 {
    values.iter().map(|(_, value)| value.abs()).filter(|size| size.is_finite()).fold(0.0, f64::max)
}

/// The scale at which an arrow of the length `wanted` is as long as the longest of a figure is at its own scale
/// `natural`. A figure with longer arrows keeps its own.
pub(super) fn fitting(natural: Option<f64>, own: f64, wanted: Option<f64>) -> Option<f64> {
    natural.map(|natural| natural * own / wanted.unwrap_or(own).max(own))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_fits_the_longest_arrow_of_all() {
        assert_eq!(fitting(Some(10.0), 4.0, Some(8.0)), Some(5.0));
        assert_eq!(fitting(Some(10.0), 4.0, Some(2.0)), Some(10.0));
        assert_eq!(fitting(Some(10.0), 4.0, None), Some(10.0));
        assert_eq!(fitting(None, 0.0, Some(2.0)), None);
        let arrows = [([0.0; 2], [3.0, 4.0]), ([0.0; 2], [f64::NAN, 9.0])];
        assert_eq!(longest_arrow(&arrows), 5.0);
    }
}
