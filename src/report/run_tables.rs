//! The tables of a run, alike in the terminal and on its page.

use super::numbers::{fixed, mm, or_dash, significant, unit_of, with_sigma};
use super::tables::Table;
use crate::adjust::agreement::{self, Agreement};
use crate::camera::UNITS;
use crate::run::summary::{CameraParameter, Named, Summary};

/// What each solver did.
pub fn solvers_table(summary: &Summary) -> Table {
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
            known(solver.seconds, |seconds| fixed(seconds, 2)),
            known(solver.cost, |cost| significant(cost, 9)),
            known(solver.gradient_max, |gradient| significant(gradient, 2)),
        ]);
    }
    table
}

/// A dash for what a solver that failed does not tell.
fn known(value: f64, format: impl Fn(f64) -> String) -> String {
    or_dash(Some(value).filter(|value| !value.is_nan()), format)
}

/// What the solvers came to, in a sentence; `None` where one ran alone.
pub fn solvers_verdict(summary: &Summary) -> Option<Conclusion> {
    let failed = summary.solvers.0.iter().find_map(|(name, solver)| Some((name, solver.failure.as_ref()?)));
    if let Some((name, failure)) = failed {
        // The message begins with the name.
        let failure = failure.strip_prefix(&format!("{name}: ")).unwrap_or(failure);
        let text =
            format!("The solver {name} failed, and what the other solver found was compared with nothing: {failure}");
        return Some(Conclusion { sound: false, text });
    }
    let agreement = summary.agreement.as_ref()?;
    let mut text = match (agreement.agree, agreement.polished) {
        (false, _) => "The solvers disagree".to_string(),
        (true, false) => "The solvers agree".to_string(),
        (true, true) => "The solvers agree, once started from each other's solution".to_string(),
    };
    if let Some(remark) = agreement.not_independent() {
        text += &format!("; {remark}");
    }
    Some(Conclusion { sound: agreement.agree, text })
}

/// That one solver ran, and why; `None` where two did.
pub fn one_solver(summary: &Summary) -> Option<String> {
    let [(name, _)] = summary.solvers.0.as_slice() else { return None };
    Some(match summary.solvers_built.as_slice() {
        // Nothing tells why in a folder of before this was noted.
        [] => format!("One solver ran: {name}."),
        [_] => format!("One solver ran: {name} (this build has no Ceres)."),
        _ => format!("One solver ran, by choice: {name}."),
    })
}

/// See [`solvers_verdict`].
pub struct Conclusion {
    /// Two solvers found the same.
    pub sound: bool,
    /// In words, without full stop.
    pub text: String,
}

/// Difference and limit of everything that is compared.
pub fn compared(a: &Agreement) -> [(&'static str, f64, f64, &'static str); 5] {
    [
        ("residuals", a.residual_max_px, agreement::RESIDUAL_PX, "px"),
        ("Jacobian", a.jacobian_max_rel, agreement::JACOBIAN_REL, "relative"),
        ("solutions", a.parameter_max_sigma, agreement::PARAMETER_SIGMA, "sigma"),
        ("cost", a.cost_rel, agreement::COST_REL, "relative"),
        ("standard deviations", a.covariance_max_rel, agreement::COVARIANCE_REL, "relative"),
    ]
}

fn value(value: f64, sigma: Option<f64>) -> String {
    match sigma {
        Some(sigma) if sigma > 0.0 => with_sigma(value, sigma),
        // As it was given.
        _ => format!("{value:?}"),
    }
}

/// Parameters of a camera.
pub fn camera_table(camera: &str, parameters: &Named<CameraParameter>) -> Table {
    let mut table =
        Table::new("").text(&format!("camera {camera}"), "").number("value", "").text("unit", "").text("", "");
    for ((name, parameter), unit) in parameters.0.iter().zip(UNITS) {
        let state = match (parameter.free, parameter.sigma) {
            (true, _) => "",
            (false, Some(sigma)) if sigma > 0.0 => "tied",
            (false, _) => "held",
        };
        table.row([name.clone(), value(parameter.value, parameter.sigma), unit_of(unit).into(), state.into()]);
    }
    table
}

/// Parameters of the effects in the model.
pub fn effects_table(summary: &Summary) -> Table {
    let mut table = Table::new("").text("effect", "").text("parameter", "").number("value", "").text("unit", "");
    for (effect, parameters) in &summary.effects.0 {
        for (name, parameter) in &parameters.0 {
            let shown = value(parameter.value, parameter.sigma);
            table.row([effect.clone(), name.clone(), shown, unit_of(&parameter.unit).into()]);
        }
    }
    table
}

/// Below this (m) a table of residuals is one of rounding errors, and has significant digits in place of decimals.
const ROUNDING_M: f64 = 1e-5;

/// A residual (m) in a table whose residuals are of the size `rms` (m).
fn millimetres(value: f64, rms: f64) -> String {
    if rms < ROUNDING_M { mm(value) } else { fixed(1e3 * value, 2) }
}

/// Residuals at control and check points.
pub fn residuals_table(summary: &Summary) -> Table {
    let mut table = (Table::new("").text("points", "").number("n", "").text("", ""))
        .number("x", "mm")
        .number("y", "mm")
        .number("z", "mm")
        .number("horizontal", "mm")
        .number("3D", "mm");
    for (role, s) in [("control", &summary.control), ("check", &summary.check)] {
        let Some(s) = s else { continue };
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
    table
}
