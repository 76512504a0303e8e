//! The section of a page that maps the mean residuals over each sensor.

use super::figures::vector_field;
use super::html::Page;
use super::pictures::{self, MARKED_P, RunFolder};
use std::collections::BTreeSet;

/// The mean residuals over the sensor, camera by camera; before and after side by side where the folder has both.
pub(super) fn sensor_figures(page: &mut Page, run: &RunFolder) {
    let cameras: BTreeSet<&str> = run.sensor.iter().map(|row| row.camera.as_str()).collect();
    if cameras.is_empty() {
        page.paragraph("There are no tie points.");
    }
    for (c, camera) in cameras.into_iter().enumerate() {
        let field =
            |stage: &str, title: &str| pictures::sensor(run, camera, stage, &format!("{title}, camera {camera}"));
        let marks = format!(
            "Mean residual of the measurements of tie points and control points in cells; cells marked as significant \
             have p below {MARKED_P:e} each."
        );
        let id = |stage: &str| format!("sensor-{stage}-{}", c + 1);
        match (field("base", "Before"), field("final", "After")) {
            (Some(mut base), Some(mut last)) => {
                base.scale = [base.natural_scale(), last.natural_scale()].into_iter().flatten().reduce(f64::min);
                last.scale = base.scale;
                page.pair(
                    (&id("base"), vector_field(&base), &marks),
                    (&id("final"), vector_field(&last), "The same after the effects were added, at the same scale."),
                );
            }
            (_, Some(mut only)) => {
                only.title = format!("Mean residual, camera {camera}");
                let tested = only.sets.iter().any(|set| !set.significant.is_empty());
                let caption = if tested { marks.as_str() } else { "Mean residual of the tie points in cells." };
                page.figure(&id("final"), vector_field(&only), caption);
            }
            _ => {}
        }
    }
}
