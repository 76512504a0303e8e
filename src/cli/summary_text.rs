//! A run's summary for people.

use super::diagnosis_text::mistakes_text;
use super::exit::Disagreement;
use super::text::paragraph;
use crate::adjust::agreement::Agreement;
use crate::report::numbers::{fixed, or_dash, px, significant};
use crate::report::run_tables::{
    camera_table, compared, effects_table, one_solver, residuals_table, solvers_table, solvers_verdict,
};
use crate::run::Run;
use crate::run::summary::Summary;

/// What nobody may overlook, to stand before everything else: that the solvers disagree, or that one of them failed.
/// Empty where all is well.
pub fn warning(summary: &Summary) -> String {
    let Some(verdict) = solvers_verdict(summary).filter(|verdict| !verdict.sound) else { return String::new() };
    let beyond = summary.agreement.as_ref().map_or_else(String::new, |agreement| format!(": {}", beyond(agreement)));
    paragraph("", 0, &format!("WARNING: {}{beyond}", verdict.text)) + "\n"
}

/// Everything that `summary.json` has.
pub fn text(summary: &Summary) -> String {
    let mut text = warning(summary);
    if !summary.mistakes.is_empty() {
        text += &format!("MISTAKES\n{}\n", mistakes_text(&summary.mistakes));
    }
    text += &format!(
        "Block `{}`: {} observations, {} unknowns, datum defect {}, redundancy {}\nsigma0 {}, tie points {} px RMS per \
         coordinate\n",
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
        text += &agreement_line(summary, agreement);
    }
    text += &one_solver_line(summary);
    for plugin in &summary.plugins {
        text += &format!("plug-in {plugin}\n");
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

/// A line where one solver ran; empty where two did.
pub fn one_solver_line(summary: &Summary) -> String {
    one_solver(summary).map_or_else(String::new, |text| text + "\n")
}

fn agreement_line(summary: &Summary, a: &Agreement) -> String {
    let list = compared(a).map(|(what, difference, _, unit)| format!("{what} {} {unit}", significant(difference, 2)));
    let verdict = solvers_verdict(summary).map_or_else(String::new, |verdict| verdict.text);
    paragraph("", 0, &format!("{verdict}; largest differences: {}", list.join(", ")))
}

/// The failure of a run whose folder was written all the same: one solver failed, or the two do not agree.
pub fn failure(run: &Run) -> Option<anyhow::Error> {
    if let Some((name, error)) = run.failures.first() {
        let text = format!("{name} failed; the run folder holds what {} found", run.solutions[0].0);
        return Some(anyhow::Error::from(error.clone()).context(text));
    }
    let agreement = run.agreement.as_ref().filter(|agreement| !agreement.agree)?;
    Some(Disagreement(beyond(agreement)).into())
}

/// Every difference that is not below its limit.
fn beyond(a: &Agreement) -> String {
    let beyond = compared(a).into_iter().filter(|(_, difference, limit, _)| difference >= limit || difference.is_nan());
    let list: Vec<String> = beyond
        .map(|(what, difference, limit, unit)| {
            let place = match what {
                "solutions" => format!(" at {}", a.worst_unknown),
                "Jacobian" if a.worst_place.is_empty() => format!(" at {}", a.worst_column),
                "Jacobian" => format!(" at {} ({})", a.worst_column, a.worst_place),
                _ => String::new(),
            };
            format!("{what}: difference {}{place} (allowed: {limit:e} {unit})", significant(difference, 2))
        })
        .collect();
    let advice = match a.one_derivation.is_empty() || a.same_problem() {
        true => "",
        false => "; a derivative that is not that of its values? misclosure effects check FILE.so tells of a plug-in",
    };
    list.join("; ") + advice
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
            worst_place: String::new(),
            compared_measurements: 10,
            polished: false,
            one_derivation: Vec::new(),
        };
        let message = Disagreement(beyond(&found)).to_string();
        let expected = "the two solvers disagree: solutions: difference 0.020 at k1 (allowed: 1e-3 sigma); \
                        cost: difference not finite (allowed: 1e-6 relative)";
        assert_eq!(message, expected);
        found.jacobian_max_rel = f64::INFINITY;
        assert!(Disagreement(beyond(&found)).to_string().contains("Jacobian: difference not finite at f"));
    }

    fn summary(agree: bool, failure: Option<&str>) -> Summary {
        let solver = |failure: Option<&str>| {
            serde_json::json!({ "converged": failure.is_none(), "cost": 1.0, "iterations": 3,
            "seconds": 0.1, "gradient_max": 0.1, "failure": failure })
        };
        let agreement = serde_json::json!({ "agree": agree, "residual_max_px": 0.0, "jacobian_max_rel": 0.0,
            "parameter_max_sigma": if agree { 0.0 } else { 0.5 }, "cost_rel": 0.0, "covariance_max_rel": 0.0,
            "worst_unknown": "k1", "worst_column": "f", "compared_measurements": 10, "one_derivation": ["mine"] });
        let agreement = if failure.is_some() { serde_json::Value::Null } else { agreement };
        serde_json::from_value(serde_json::json!({ "format": 1, "block": "b", "observations": 1, "unknowns": 1,
            "datum_defect": 0, "redundancy": 0, "sigma0": null, "tie_rms_px": null,
            "solvers": { "ceres": solver(failure), "native": solver(None) }, "agreement": agreement, "cameras": {},
            "effects": {}, "similarity": null, "control": null, "check": null }))
        .expect("a summary")
    }

    #[test]
    fn a_run_of_one_solver_says_so_and_why() {
        let mut alone = summary(true, None);
        let both = text(&alone);
        assert!(!both.contains("One solver"), "{both}");
        alone.agreement = None;
        alone.solvers.0.remove(0);
        let mut line = |built: &[&str]| {
            alone.solvers_built = built.iter().map(|name| name.to_string()).collect();
            let text = text(&alone);
            text.lines().find(|line| line.starts_with("One solver")).expect("the line").to_owned()
        };
        assert_eq!(line(&["native"]), "One solver ran: native (this build has no Ceres).");
        assert_eq!(line(&["native", "ceres"]), "One solver ran, by choice: native.");
        assert_eq!(line(&[]), "One solver ran: native.");
    }

    #[test]
    fn what_went_wrong_between_the_solvers_comes_first() {
        let text = |agree, failure| super::text(&summary(agree, failure)).replace('\n', " ");
        assert!(text(false, None).starts_with(
            "WARNING: The solvers disagree; one derivation: solvers not independent here (mine): solutions: difference \
             0.50 at k1"
        ));
        assert!(text(true, Some("ceres: not converged")).starts_with(
            "WARNING: The solver ceres failed, and what the other solver found was compared with nothing: not converged"
        ));
        assert!(text(true, None).starts_with("Block `b`"));
    }

    #[test]
    fn agreement_says_where_it_proves_nothing_and_how_it_came_about() {
        let mut found = summary(true, None);
        let sentence = "one derivation: solvers not independent here (mine)";
        assert!(text(&found).replace('\n', " ").contains(&format!("The solvers agree; {sentence}; largest")));
        let agreement = found.agreement.as_mut().expect("an agreement");
        agreement.one_derivation.clear();
        agreement.polished = true;
        let text = text(&found).replace('\n', " ");
        assert!(
            text.contains("The solvers agree, once started from each other's solution; largest")
                && !text.contains(sentence)
        );
    }
}
