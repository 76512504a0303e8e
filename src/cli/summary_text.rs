//! A run's summary for people.

use super::exit::Disagreement;
use super::text::paragraph;
use crate::adjust::agreement::Agreement;
use crate::report::numbers::{fixed, or_dash, px, significant};
use crate::report::run_tables::{camera_table, compared, effects_table, residuals_table, solvers_table};
use crate::run::summary::Summary;

/// Everything that `summary.json` has.
pub fn text(summary: &Summary) -> String {
    let mut text = format!(
        "Block `{}`: {} observations, {} unknowns, datum defect {}, redundancy {}\nsigma0 {}, tie points {} px RMS per coordinate\n",
        summary.block,
        summary.observations,
        summary.unknowns,
        summary.datum_defect,
        summary.redundancy,
        or_dash(summary.sigma0, |sigma0| significant(sigma0, 5)),
        or_dash(summary.tie_rms_px, px),
    );
    text.push('\n');
    text += &solvers_table(summary).to_text();
    if let Some(agreement) = &summary.agreement {
        text += &agreement_line(agreement);
    }
    for (camera, parameters) in &summary.cameras.0 {
        text.push('\n');
        text += &camera_table(camera, parameters).to_text();
    }
    if !summary.effects.0.is_empty() {
        text.push('\n');
        text += &effects_table(summary).to_text();
    }
    if summary.control.is_some() || summary.check.is_some() {
        text.push('\n');
        text += &residuals_table(summary).to_text();
    }
    if let Some(similarity) = &summary.similarity {
        text += &format!("after a 3D similarity from the control points, scale {}\n", fixed(similarity.scale, 6));
    }
    text
}

fn agreement_line(a: &Agreement) -> String {
    let list = compared(a).map(|(what, difference, _, unit)| format!("{what} {} {unit}", significant(difference, 2)));
    let verdict = if a.agree { "The solvers agree" } else { "THE SOLVERS DISAGREE" };
    paragraph("", 0, &format!("{verdict}; largest differences: {}", list.join(", ")))
}

/// The failure of solvers that do not agree: every difference that is not below its limit.
pub fn disagreement(a: &Agreement) -> Disagreement {
    let beyond = compared(a).into_iter().filter(|(_, difference, limit, _)| difference >= limit || difference.is_nan());
    let list: Vec<String> = beyond
        .map(|(what, difference, limit, unit)| {
            let place = match what {
                "solutions" => format!(" at {}", a.worst_unknown),
                "Jacobian" => format!(" at {}", a.worst_column),
                _ => String::new(),
            };
            format!("{what}: difference {}{place} (allowed: {limit:e} {unit})", significant(difference, 2))
        })
        .collect();
    Disagreement(list.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disagreement_names_what_is_beyond_its_limit() {
        let mut found = Agreement {
            agree: false,
            residual_max_px: 1e-12,
            jacobian_max_rel: 1e-15,
            parameter_max_sigma: 0.02,
            cost_rel: f64::NAN,
            covariance_max_rel: 1e-9,
            worst_unknown: "k1".into(),
            worst_column: "f".into(),
            compared_measurements: 10,
        };
        let message = disagreement(&found).to_string();
        let expected = "the two solvers disagree: solutions: difference 0.020 at k1 (allowed: 1e-3 sigma); \
                        cost: difference not finite (allowed: 1e-6 relative)";
        assert_eq!(message, expected);
        found.jacobian_max_rel = f64::INFINITY;
        assert!(disagreement(&found).to_string().contains("Jacobian: difference not finite at f"));
    }
}
