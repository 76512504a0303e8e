//! Is the block bent? The quadratic part of the height residuals of surveyed points, and whether it is significant.
//!
//! With `s` along the principal horizontal direction of the points and `t` across it (m, from the middle of their
//! extents):
//!
//! ```text
//! Corridor             dz = c0 + c1 s + a s^2
//! CorridorWithTilt     dz = c0 + c1 s + c2 t + a s^2
//! Dome                 dz = c0 + c1 s + c2 t + a (s^2 + t^2)
//! ```
//!
//! `a > 0`: ends up, middle down (bowl); `a < 0`: dome. The F-test compares with the same model without `a`, one degree
//! of freedom. It takes the residuals as independent; residuals of neighbouring points that share the block's
//! deformation are not, so a small p says "not by chance of the points", not "by this shape alone": look at `explained`
//! too.

use super::checks::CheckRow;
use crate::block::Role;
use crate::math::statistics::{f_ln_sf, f_sf};
use nalgebra::{DVector, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A column of the design whose part outside the others is below this share of its length counts as dependent: the
/// points stand at too few places.
const DEPENDENT: f64 = 1e-9;

/// Terms of the fit: see the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BowlShape {
    /// Quadratic along the principal direction.
    #[default]
    Corridor,
    /// The same with a tilt across.
    CorridorWithTilt,
    /// Plane and paraboloid, for blocks of two dimensions.
    Dome,
}

/// The fitted bowl.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bowl {
    /// Terms of the fit.
    pub shape: BowlShape,
    /// Number of points.
    pub n: usize,
    /// Quadratic coefficient `a`, 1/m.
    pub coefficient_per_m: f64,
    /// Its standard deviation from the scatter about the fit, 1/m.
    pub sigma_per_m: f64,
    /// Height of the bowl over the extent of the points, m: `a` times the square of half the extent (of the largest
    /// distance from the middle for the dome).
    pub height_m: f64,
    /// Extent of the points along the principal direction, m.
    pub extent_m: f64,
    /// Principal direction in the horizontal plane, unit vector.
    pub axis: [f64; 2],
    /// Middle of the extents, m.
    pub middle_m: [f64; 2],
    /// Share of the scatter about the linear model that the quadratic term explains, 0 to 1.
    pub explained: f64,
    /// F statistic with 1 and `n - terms` degrees of freedom.
    pub statistic: f64,
    /// Second degree of freedom.
    pub dof: usize,
    /// p-value.
    pub p_value: f64,
    /// Its natural logarithm, finite where the p-value underflows.
    pub ln_p_value: f64,
}

/// Why no bowl can be fitted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BowlError {
    /// Not more points than terms.
    #[error("{points} points cannot test a fit with {terms} terms")]
    TooFew {
        /// Points given.
        points: usize,
        /// Terms of the fit.
        terms: usize,
    },
    /// As many heights as positions are needed.
    #[error("{positions} positions, {heights} height residuals: the counts must be equal")]
    Counts {
        /// Positions given.
        positions: usize,
        /// Residuals given.
        heights: usize,
    },
    /// A value is not finite.
    #[error("point {0} has a value that is not finite")]
    NotFinite(usize),
    /// The points stand at too few different places for the terms.
    #[error("the points stand at too few different places for the fit")]
    Degenerate,
}

/// Fits the bowl to the rows of one role.
///
/// # Errors
/// [`BowlError`].
pub fn of_rows(rows: &[CheckRow], role: Role, shape: BowlShape) -> Result<Bowl, BowlError> {
    let chosen = || rows.iter().filter(|row| row.role == role);
    let positions: Vec<_> = chosen().map(|row| row.position).collect();
    let heights: Vec<_> = chosen().map(|row| row.d.z).collect();
    fit(&positions, &heights, shape)
}

/// Fits the bowl to height residuals (m) at positions (m; only x and y are used).
///
/// # Errors
/// [`BowlError`].
pub fn fit(positions: &[Vector3<f64>], heights: &[f64], shape: BowlShape) -> Result<Bowl, BowlError> {
    let n = positions.len();
    if heights.len() != n {
        return Err(BowlError::Counts { positions: n, heights: heights.len() });
    }
    let terms = if shape == BowlShape::Corridor { 3 } else { 4 };
    if n <= terms {
        return Err(BowlError::TooFew { points: n, terms });
    }
    let finite = |i: &usize| positions[*i].iter().all(|x| x.is_finite()) && heights[*i].is_finite();
    if let Some(bad) = (0..n).find(|i| !finite(i)) {
        return Err(BowlError::NotFinite(bad));
    }
    let frame = BowlAxes::of(positions);
    let half = 0.5 * frame.extent;
    if half <= 0.0 {
        return Err(BowlError::Degenerate);
    }
    // Columns in units of half the extent: well scaled whatever the size of the block.
    let coordinate = |i: usize| frame.along_across(&positions[i]) / half;
    let column = |f: &dyn Fn(Vector2<f64>) -> f64| DVector::from_fn(n, |i, _| f(coordinate(i)));
    let mut columns = vec![column(&|_| 1.0), column(&|p| p.x)];
    if shape != BowlShape::Corridor {
        columns.push(column(&|p| p.y));
    }
    columns.push(if shape == BowlShape::Dome { column(&|p| p.norm_squared()) } else { column(&|p| p.x * p.x) });

    // Gram-Schmidt with the quadratic column last: its share of the heights is what the F-test tests, free of the
    // cancellation that a difference of two sums of squares has.
    let mut rest = DVector::from_column_slice(heights);
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let (mut length, mut share) = (0.0, 0.0);
    for column in columns {
        let mut direction = column.clone();
        for _ in 0..2 {
            for known in &basis {
                let part = known.dot(&direction);
                direction.axpy(-part, known, 1.0);
            }
        }
        length = direction.norm();
        if length <= DEPENDENT * column.norm() {
            return Err(BowlError::Degenerate);
        }
        direction /= length;
        share = direction.dot(&rest);
        rest.axpy(-share, &direction, 1.0);
        basis.push(direction);
    }
    let dof = n - terms;
    let scatter = rest.norm_squared();
    let variance = scatter / dof as f64;
    // Residuals that are zero throughout have no bowl.
    let statistic = if share == 0.0 { 0.0 } else { share * share / variance };
    let coefficient = share / length / (half * half);
    let reach = if shape == BowlShape::Dome {
        positions.iter().map(|p| frame.along_across(p).norm()).fold(0.0, f64::max)
    } else {
        half
    };
    Ok(Bowl {
        shape,
        n,
        coefficient_per_m: coefficient,
        sigma_per_m: variance.sqrt() / length / (half * half),
        height_m: coefficient * reach * reach,
        extent_m: frame.extent,
        axis: frame.axis.into(),
        middle_m: frame.middle.into(),
        explained: if share == 0.0 { 0.0 } else { share * share / (share * share + scatter) },
        statistic,
        dof,
        p_value: f_sf(statistic, 1.0, dof as f64),
        ln_p_value: f_ln_sf(statistic, 1.0, dof as f64),
    })
}

/// Horizontal axes of a set of points.
struct BowlAxes {
    axis: Vector2<f64>,
    middle: Vector2<f64>,
    extent: f64,
}

impl BowlAxes {
    fn of(positions: &[Vector3<f64>]) -> Self {
        let centre = positions.iter().map(|p| p.xy()).sum::<Vector2<f64>>() / positions.len() as f64;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for p in positions {
            let d = p.xy() - centre;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let mut axis = Vector2::new(angle.cos(), angle.sin());
        // One sign for one direction: the larger component positive.
        if axis[axis.iamax()] < 0.0 {
            axis = -axis;
        }
        let mut frame = BowlAxes { axis, middle: centre, extent: 0.0 };
        let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for p in positions {
            let q = frame.along_across(p);
            (low, high) = (low.inf(&q), high.sup(&q));
        }
        let middle = (low + high) * 0.5;
        frame.middle += axis * middle.x + Vector2::new(-axis.y, axis.x) * middle.y;
        frame.extent = high.x - low.x;
        frame
    }

    /// `(s, t)` of a point, m from the middle.
    fn along_across(&self, point: &Vector3<f64>) -> Vector2<f64> {
        let d = point.xy() - self.middle;
        Vector2::new(self.axis.dot(&d), self.axis.x * d.y - self.axis.y * d.x)
    }
}

#[cfg(test)]
#[path = "bowl_tests.rs"]
mod tests;
