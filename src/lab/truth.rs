//! A node of a simulated block beside the truth.

use super::change::Change;
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
    let errors = match &root.change {
        Change::Simulate { errors, .. } => errors.clone(),
        _ => Vec::new(),
    };
    let mut rows = Vec::new();
    for (camera, parameters) in &view.run.summary.cameras.0 {
        let Some(truth) = simulated.truth.cameras.iter().find(|own| own.id == *camera) else { continue };
        for (k, name) in PARAMETERS.iter().enumerate() {
            let Some((_, found)) = parameters.0.iter().find(|(other, _)| other == name) else { continue };
            rows.push(json!({
                "what": format!("{name} ({camera})"), "truth": truth.interior[k], "estimate": found.value, "sigma": found.sigma,
                "unit": UNITS[k],
            }));
        }
    }
    let effects = view.run.summary.effects.0.iter().flat_map(|(id, parameters)| {
        parameters.0.iter().map(move |(name, found)| {
            json!({ "what": format!("{id} {name}"), "truth": null, "estimate": found.value, "sigma": found.sigma, "unit": found.unit })
        })
    });
    rows.extend(effects);
    let checks = view.run.checks.iter().filter(|row| row.role == "check");
    let squares: Vec<f64> = checks.map(|row| row.dx * row.dx + row.dy * row.dy + row.dz * row.dz).collect();
    let rms = (!squares.is_empty()).then(|| 1e3 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt());
    let check = simulated.truth.count(Role::Check);
    let mistakes = &simulated.mistakes;
    Ok(json!({ "rows": rows, "errors": errors, "mistakes": mistakes, "point_rms_mm": rms, "check_points": check }))
}
