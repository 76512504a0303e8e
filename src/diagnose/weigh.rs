//! How much what is left matters: with tens of thousands of measurements everything is significant, and little of it
//! moves a point.

use super::impact::Impact;
use super::verdict::{Diagnosis, Verdict, Weight};

/// Coordinates of a block with a mistake may be wrong by any amount, and so are the millimetres that they give.
const WITH_A_MISTAKE: &str = "Beside the mistakes, residual patterns remain. Their effect on the points cannot be \
                              stated in mm before the mistakes are corrected.";

impl Diagnosis {
    /// Do lengths on the ground mean anything? They do where the block is `scaled`, and no mistake may have moved it.
    pub fn has_lengths(&self, scaled: bool) -> bool {
        scaled && self.verdict != Verdict::Mistake
    }

    /// Weighs what is left against the precision of the points (typical standard deviation in space, m), or against
    /// what the user tolerates.
    pub fn weigh(&mut self, precision_m: f64, tolerance_m: Option<f64>) {
        let sentence = sentence(self, precision_m, tolerance_m);
        self.weight = Some(Weight { precision_m, tolerance_m, sentence });
    }
}

fn sentence(diagnosis: &Diagnosis, precision_m: f64, tolerance_m: Option<f64>) -> String {
    // In large blocks the covariance of the points is left out of a run.
    let known = precision_m.is_finite();
    let left = diagnosis.verdict == Verdict::Mistake && !diagnosis.left.is_empty();
    if diagnosis.verdict != Verdict::Unexplained && !left {
        let nothing = match diagnosis.verdict {
            Verdict::Mistake => "Beside the mistakes, no significant misfit remains",
            _ => "No significant misfit remains",
        };
        // A standard deviation means nothing in a system that a mistake may have moved.
        return if known && diagnosis.verdict != Verdict::Mistake {
            format!("{nothing}. Typical point: ± {} mm (1 sigma, 3D).", millimetres(precision_m))
        } else {
            format!("{nothing}.")
        };
    }
    if diagnosis.verdict == Verdict::Mistake {
        return WITH_A_MISTAKE.into();
    }
    if diagnosis.check_points_alone_contradict() {
        return "No significant misfit remains in the images, and yet block and check points contradict each other."
            .into();
    }
    let largest = diagnosis
        .left_shapes
        .iter()
        .filter_map(|shape| Some((shape, shape.impact.as_ref()?)))
        .max_by(|(_, a), (_, b)| a.rms_m.total_cmp(&b.rms_m));
    let Some((shape, Impact { rms_m, height_m, .. })) = largest else {
        return "The remaining misfit is no smooth pattern on the sensor, so its effect on the points cannot be \
                computed."
            .into();
    };
    let beside = match known {
        true => {
            format!(", {:.2} times their standard deviation ({} mm)", rms_m / precision_m, millimetres(precision_m))
        }
        false => String::new(),
    };
    let what = format!(
        "Unexplained: a pattern on the sensor of {:.3} px (described by {}). It moves points by {} mm ({} mm in \
         height){beside}",
        shape.size_px,
        shape.field,
        millimetres(*rms_m),
        millimetres(*height_m),
    );
    match tolerance_m {
        Some(tolerance) if *rms_m <= tolerance => {
            format!("{what}; within your tolerance of {} mm.", millimetres(tolerance))
        }
        Some(tolerance) => format!("{what}; above your tolerance of {} mm.", millimetres(tolerance)),
        None if !known => format!("{what}."),
        None if *rms_m <= precision_m => format!("{what}: less than the noise of the measurements."),
        None => format!("{what}: more than the noise of the measurements."),
    }
}

/// Two significant digits.
fn millimetres(metres: f64) -> String {
    let mm = 1e3 * metres;
    if !mm.is_finite() || mm == 0.0 {
        return format!("{mm}");
    }
    let digits = (1 - mm.abs().log10().floor() as i32).max(0) as usize;
    format!("{mm:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unexplained(shapes: &str) -> Diagnosis {
        let text = format!(
            r#"{{"format": 1, "verdict": "unexplained", "significance": 0.001, "candidates": [],
                "recommended": [], "structure": [], "left": ["sensor"], "left_shapes": {shapes}, "ledger": [],
                "outliers": 0,
                "sigma_factors": {{"image": 1.0, "control": 1.0, "control_z": 1.0, "gnss": 1.0, "gnss_z": 1.0}}}}"#
        );
        serde_json::from_str(&text).expect("a diagnosis")
    }

    fn diagnosis_with(verdict: Verdict) -> Diagnosis {
        Diagnosis { verdict, ..unexplained("[]") }
    }

    #[test]
    fn an_unknown_precision_is_not_told() {
        let mut diagnosis = unexplained("[]");
        diagnosis.verdict = Verdict::Adequate;
        diagnosis.weigh(f64::NAN, None);
        assert_eq!(diagnosis.weight.unwrap().sentence, "No significant misfit remains.");
    }

    #[test]
    fn what_is_left_is_weighed_against_the_precision_or_what_is_tolerated() {
        let impact = r#"[{"field": "image-grid", "size_px": 0.05,
            "impact": {"rms_m": 0.0003, "height_m": 0.0002, "surveyed": true}}]"#;
        let mut diagnosis = unexplained(impact);
        let mut sentence = |precision_m: f64, tolerance_m: Option<f64>| {
            diagnosis.weigh(precision_m, tolerance_m);
            diagnosis.weight.as_ref().expect("a weight").sentence.clone()
        };
        let small = sentence(0.003, None);
        assert!(
            small.contains("0.30 mm (0.20 mm in height), 0.10 times") && small.contains("less than the noise"),
            "{small}"
        );
        assert!(sentence(0.0001, None).contains("more than the noise"));
        assert!(sentence(0.003, Some(0.0001)).contains("above your tolerance of 0.10 mm"));
        assert!(sentence(0.0001, Some(0.001)).contains("within your tolerance of 1.0 mm"));
    }

    #[test]
    fn beside_a_mistake_nothing_is_weighed_in_millimetres() {
        let mut diagnosis = unexplained(
            r#"[{"field": "image-grid", "size_px": 0.05,
                "impact": {"rms_m": 11.672, "height_m": 11.0, "surveyed": true}}]"#,
        );
        diagnosis.weigh(0.003, None);
        assert!(diagnosis.weight.as_ref().expect("a weight").sentence.contains("11672 mm"));
        diagnosis.verdict = Verdict::Mistake;
        diagnosis.weigh(0.003, Some(0.01));
        let sentence = diagnosis.weight.expect("a weight").sentence;
        assert!(sentence.contains("before the mistakes are corrected"), "{sentence}");
        assert!(!sentence.contains(|c: char| c.is_ascii_digit()), "{sentence}");
        assert!(!diagnosis_with(Verdict::Mistake).has_lengths(true));
        let sound = diagnosis_with(Verdict::Missing);
        assert!(sound.has_lengths(true) && !sound.has_lengths(false));
    }

    #[test]
    fn what_has_no_shape_is_not_weighed() {
        let mut diagnosis = unexplained("[]");
        diagnosis.weigh(0.003, None);
        assert!(diagnosis.weight.expect("a weight").sentence.contains("no smooth pattern"));
    }
}
