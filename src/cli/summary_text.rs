//! A run's summary for people.

use super::exit::Disagreement;
use super::summary::{CameraParameter, Named, Summary};
use super::text::paragraph;
use crate::adjust::agreement::{self, Agreement};
use crate::camera::UNITS;
use crate::evaluate::Statistics;
use crate::report::numbers::{fixed, mm, or_dash, px, significant, with_sigma};
use crate::report::tables::Table;

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
    text += &solvers(summary);
    if let Some(agreement) = &summary.agreement {
        text += &agreement_line(agreement);
    }
    for (camera, parameters) in &summary.cameras.0 {
        text.push('\n');
        text += &camera_table(camera, parameters);
    }
    if !summary.effects.0.is_empty() {
        text.push('\n');
        text += &effects_table(summary);
    }
    let roles = [("control", &summary.control), ("check", &summary.check)];
    if roles.iter().any(|(_, statistics)| statistics.is_some()) {
        text.push('\n');
        text += &residuals_table(&roles);
    }
    if let Some(similarity) = &summary.similarity {
        text += &format!("after a 3D similarity from the control points, scale {}\n", fixed(similarity.scale, 6));
    }
    text
}

fn solvers(summary: &Summary) -> String {
    let mut table = (Table::new("").text("solver", "").text("converged", ""))
        .number("iterations", "")
        .number("time", "s")
        .number("cost", "")
        .number("gradient", "");
    for (name, solver) in &summary.solvers.0 {
        table.row([
            name.clone(),
            if solver.converged { "yes" } else { "no" }.into(),
            solver.iterations.to_string(),
            fixed(solver.seconds, 2),
            significant(solver.cost, 9),
            significant(solver.gradient_max, 2),
        ]);
    }
    table.to_text()
}

/// Difference and limit of everything that is compared.
fn compared(a: &Agreement) -> [(&'static str, f64, f64, &'static str); 5] {
    [
        ("residuals", a.residual_max_px, agreement::RESIDUAL_PX, "px"),
        ("Jacobian", a.jacobian_max_rel, agreement::JACOBIAN_REL, "relative"),
        ("solutions", a.parameter_max_sigma, agreement::PARAMETER_SIGMA, "sigma"),
        ("cost", a.cost_rel, agreement::COST_REL, "relative"),
        ("standard deviations", a.covariance_max_rel, agreement::COVARIANCE_REL, "relative"),
    ]
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

fn value(value: f64, sigma: Option<f64>) -> String {
    match sigma {
        Some(sigma) if sigma > 0.0 => with_sigma(value, sigma),
        // As it was given.
        _ => format!("{value:?}"),
    }
}

fn camera_table(camera: &str, parameters: &Named<CameraParameter>) -> String {
    let mut table =
        Table::new("").text(&format!("camera {camera}"), "").number("value", "").text("unit", "").text("", "");
    for ((name, parameter), unit) in parameters.0.iter().zip(UNITS) {
        let state = match (parameter.free, parameter.sigma) {
            (true, _) => "",
            (false, Some(sigma)) if sigma > 0.0 => "tied",
            (false, _) => "held",
        };
        table.row([name.clone(), value(parameter.value, parameter.sigma), unit.into(), state.into()]);
    }
    table.to_text()
}

fn effects_table(summary: &Summary) -> String {
    let mut table = Table::new("").text("effect", "").text("parameter", "").number("value", "").text("unit", "");
    for (effect, parameters) in &summary.effects.0 {
        for (name, parameter) in &parameters.0 {
            let shown = value(parameter.value, parameter.sigma);
            table.row([effect.clone(), name.clone(), shown, parameter.unit.clone()]);
        }
    }
    table.to_text()
}

/// Below this (m) a table of residuals is one of rounding errors, and has significant digits in place of decimals.
const ROUNDING_M: f64 = 1e-5;

/// A residual (m) in a table whose residuals are of the size `rms` (m).
fn millimetres(value: f64, rms: f64) -> String {
    if rms < ROUNDING_M { mm(value) } else { fixed(1e3 * value, 2) }
}

fn residuals_table(roles: &[(&str, &Option<Statistics>)]) -> String {
    let mut table = (Table::new("").text("points", "").number("n", "").text("", ""))
        .number("x", "mm")
        .number("y", "mm")
        .number("z", "mm")
        .number("horizontal", "mm")
        .number("3D", "mm");
    for (role, statistics) in roles {
        let Some(s) = statistics else { continue };
        let rms = [s.rms_m.x, s.rms_m.y, s.rms_m.z, s.rms_m.xy, s.rms_m.xyz];
        let mean = [s.mean_m.x, s.mean_m.y, s.mean_m.z, s.mean_m.xy, s.mean_m.xyz];
        let std = s.std_m.map(|std| [std.x, std.y, std.z, std.xy, std.xyz]);
        let mut row = |what: &str, values: [f64; 5]| {
            let head = [role.to_string(), s.n.to_string(), what.to_string()];
            table.row(head.into_iter().chain(values.map(|value| millimetres(value, s.rms_m.xyz))));
        };
        row("RMS", rms);
        row("mean", mean);
        if let Some(std) = std {
            row("std", std);
        }
    }
    table.to_text()
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
