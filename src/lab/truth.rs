//! A node of a simulated block beside the truth: every estimate with its true value, or the reason why there is none.

use super::change::Change;
use super::known::{Causes, Wanted};
use super::state::Lab;
use crate::block::Role;
use crate::camera::{PARAMETERS, UNITS};
use anyhow::{Result, bail};
use serde_json::{Value, json};

/// A node beside the truth.
///
/// # Errors
/// A node that is not done, or a laboratory without a truth.
pub fn truth(lab: &Lab, id: u32) -> Result<Value> {
    let Some(simulated) = &lab.setup.simulated else {
        bail!("this block was not simulated here: its truth is not known")
    };
    let view = lab.view(id)?;
    let root = lab.saved(lab.root(id)?)?;
    let (errors, seed) = match &root.change {
        Change::Simulate { errors, seed } => (errors.clone(), *seed),
        _ => (Vec::new(), simulated.seed),
    };
    let mut rows = Vec::new();
    for (camera, parameters) in &view.run.summary.cameras.0 {
        let Some(truth) = simulated.truth.cameras.iter().find(|own| own.id == *camera) else { continue };
        for (k, name) in PARAMETERS.iter().enumerate() {
            let Some((_, found)) = parameters.0.iter().find(|(other, _)| other == name) else { continue };
            rows.push(json!({
                "what": format!("{name} ({camera})"), "truth": truth.interior[k], "reason": null,
                "estimate": found.value,
                "sigma": found.sigma, "unit": UNITS[k],
            }));
        }
    }
    let causes = Causes::new(&simulated.truth, &errors, seed)?;
    for (effect, parameters) in &view.run.summary.effects.0 {
        let model = |name: &str| parameters.0.iter().find(|(own, _)| own == name).map(|(_, found)| found.value);
        for (parameter, found) in &parameters.0 {
            let known = causes.value(&Wanted { effect, parameter, model: &model });
            rows.push(json!({
                "what": format!("{effect} {parameter}"), "truth": known.as_ref().ok(), "reason": known.as_ref().err(),
                "estimate": found.value, "sigma": found.sigma, "unit": found.unit,
            }));
        }
    }
    let checks = view.run.checks.iter().filter(|row| row.role == "check");
    let squares: Vec<f64> = checks.map(|row| row.dx * row.dx + row.dy * row.dy + row.dz * row.dz).collect();
    let rms = (!squares.is_empty()).then(|| 1e3 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt());
    let check = simulated.truth.count(Role::Check);
    let mistakes = &simulated.mistakes;
    Ok(json!({ "rows": rows, "errors": errors, "mistakes": mistakes, "point_rms_mm": rms, "check_points": check }))
}
