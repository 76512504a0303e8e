//! Why a plan does not reach a goal, in words.

use super::{Limits, Plan, Size};

/// Why points are no more precise than `wanted`, m.
pub(super) fn imprecise(limits: Option<&Limits>, wanted: f64) -> String {
    let Some(Limits { rays_m, cameras_known_m, parameter, parameter_known_m }) = limits else {
        return "the block is too large for the covariance of each point".into();
    };
    let rays = format!("with every pose and camera known, the rays of the points alone leave {}", mm(*rays_m));
    if *rays_m > wanted {
        return format!("{rays}; more rays, longer bases or a lower height reach less, control and GNSS do not");
    }
    let cameras = format!("with every camera known, {} are left", mm(*cameras_known_m));
    if *cameras_known_m > wanted {
        return format!("{cameras}, and {} with every pose known, too: poses and datum are too weak", mm(*rays_m));
    }
    let most = match (parameter, parameter_known_m) {
        (Some(parameter), Some(left)) => format!(", {parameter} most ({} with it known)", mm(*left)),
        _ => String::new(),
    };
    format!("{cameras}: parameters of cameras are too weak{most}")
}

/// Why an effect of the size `wanted` is not seen.
pub(super) fn too_small(size: &Size, wanted: f64) -> String {
    let parameter = &size.parameter;
    let Some(alone) = size.size_alone else {
        return format!("{parameter} is that of values by image: more images show it, or more points in each");
    };
    let smaller = size.size / alone;
    let known =
        format!("with everything else known, {parameter} would be seen from a size {smaller:.1} times smaller on");
    if alone > wanted {
        return format!("{known}, not from the goal on: the measurements are too few or too imprecise");
    }
    format!("{known}; other unknowns of the block take up {:.1} % of what it does", 1e2 * (1.0 - smaller.powi(-2)))
}

/// Millimetres; of a fraction of one more digits.
fn mm(metres: f64) -> String {
    let mm = 1e3 * metres;
    if mm < 1.0 { format!("{mm:.3} mm") } else { format!("{mm:.1} mm") }
}

/// Why a plan has no size of an effect in a unit.
pub(super) fn unseen(plan: &Plan, id: &str, unit: &str) -> String {
    if let Some(hidden) = plan.hidden.iter().find(|own| own.effect == id) {
        return format!("{id} stays hidden; needed: {}", hidden.needs.join("; "));
    }
    match plan.visible(id) {
        Some(own) => {
            let units: Vec<&str> = own.sizes.iter().map(|size| size.unit.as_str()).collect();
            format!("{id} has no size in {unit} but in {}", units.join(", "))
        }
        None => format!("{id} is known from the coordinate system, or a part of the model"),
    }
}
