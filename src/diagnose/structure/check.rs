//! Height errors of the check points: plane and dome. Descriptive: check points decide nothing.
//!
//! The p-values say whether there is a plane or a dome beyond the scatter of the single points, not whether the model is wrong: a right model
//! without control in the adjustment leaves both, since its own errors bend and tilt the block as a whole.

use super::StructureTest;
use super::asked::Tested;
use super::found::Found;
use crate::block::Role;
use crate::evaluate::Comparison;
use crate::math::statistics::f_ln_sf;
use nalgebra::{DMatrix, DVector};

/// Check points that a dome needs: twice its terms.
const LEAST: usize = 8;

pub(super) fn test(comparison: Option<&Comparison>, found: &mut Found) {
    let rows = comparison.iter().flat_map(|comparison| &comparison.rows);
    let points: Vec<_> = rows.filter(|row| row.role == Role::Check).collect();
    let n = points.len();
    if n < LEAST {
        found.skip("check-plane", "too few check points");
        return found.skip("check-dome", "too few check points");
    }
    let mean = |k: usize| points.iter().map(|row| row.position[k]).sum::<f64>() / n as f64;
    let centre = [mean(0), mean(1)];
    let radius = |k: usize| ((points[k].position.x - centre[0]).powi(2), (points[k].position.y - centre[1]).powi(2));
    let reach = (0..n).map(|k| radius(k).0 + radius(k).1).fold(0.0, f64::max).sqrt().max(f64::MIN_POSITIVE);
    let design = DMatrix::from_fn(n, 4, |k, term| match term {
        0 => 1.0,
        1 => (points[k].position.x - centre[0]) / reach,
        2 => (points[k].position.y - centre[1]) / reach,
        _ => (radius(k).0 + radius(k).1) / (reach * reach),
    });
    let height = DVector::from_fn(n, |k, _| points[k].d.z);
    let fit = |terms: usize| {
        let a = design.columns(0, terms).into_owned();
        let x = (a.transpose() * &a).cholesky()?.solve(&(a.transpose() * &height));
        Some(((&height - a * &x).norm_squared(), x))
    };
    let (Some((plane_rest, plane)), Some((dome_rest, dome))) = (fit(3), fit(4)) else {
        found.skip("check-plane", "the check points lie on a line");
        return found.skip("check-dome", "the check points lie on a line");
    };
    let tested = |drop: f64, rest: f64, dof: usize, terms: usize| {
        let left = (n - terms) as f64;
        let statistic = drop / dof as f64 / (rest / left).max(f64::MIN_POSITIVE);
        let ln_p_value = f_ln_sf(statistic, dof as f64, left).min(0.0);
        Tested { statistic, dof, p_value: ln_p_value.exp(), ln_p_value }
    };
    let mm = 1e3;
    let tests = [
        (
            "check-plane",
            tested(height.norm_squared() - plane_rest, plane_rest, 3, 3),
            format!(
                "height errors of {n} check points: mean {:.1} mm, tilt {:.1} mm to the east and {:.1} mm to the north over {reach:.0} m",
                mm * plane[0],
                mm * plane[1],
                mm * plane[2]
            ),
        ),
        (
            "check-dome",
            tested(plane_rest - dome_rest, dome_rest, 1, 4),
            format!(
                "height errors of {n} check points: dome of {:.1} mm from the middle to {reach:.0} m",
                mm * dome[3]
            ),
        ),
    ];
    for (against, tested, description) in tests {
        found.tests.push(StructureTest {
            against,
            statistic: tested.statistic,
            dof: tested.dof,
            p_value: tested.p_value,
            ln_p_value: tested.ln_p_value,
            family_p_value: tested.p_value,
            decides: false,
            description,
        });
    }
}
