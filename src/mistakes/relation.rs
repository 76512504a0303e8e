//! What two groups of surveyed positions may differ by.

use super::shape::FOOT;
use crate::math::statistics::median;
use nalgebra::Vector3;

/// Heights of the geoid above or below the ellipsoid, m: what two height systems differ by.
pub const GEOID_M: [f64; 2] = [10.0, 110.0];
/// What the tested group differs by from the place that the other group gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Relation {
    /// Nothing.
    Same,
    /// It is in another unit: metres of one.
    Unit(f64),
    /// Its heights are in another unit.
    HeightUnit(f64),
    /// Two of its axes are exchanged.
    Exchanged(usize, usize),
    /// One of its axes is reversed.
    Reversed(usize),
    /// Its heights are off.
    Height,
    /// It is off horizontally.
    Plan,
    /// It is off.
    Shift,
}

/// In the order in which they are preferred: what is known exactly before what is estimated, little before much.
pub fn relations() -> Vec<Relation> {
    let units = [FOOT, 1e-3, 1e-2, 1.0 / FOOT, 1e3, 1e2];
    let mut all = vec![Relation::Same];
    all.extend(units.map(Relation::Unit));
    all.extend(units.map(Relation::HeightUnit));
    all.extend([Relation::Exchanged(0, 1), Relation::Exchanged(0, 2), Relation::Exchanged(1, 2)]);
    all.extend([0, 1, 2].map(Relation::Reversed));
    all.extend([Relation::Height, Relation::Plan, Relation::Shift]);
    all
}

impl Relation {
    /// Number of alternatives of the same kind, and of numbers that it estimates.
    pub fn freedom(self) -> (usize, usize) {
        match self {
            Self::Same => (1, 0),
            Self::Unit(_) | Self::HeightUnit(_) => (6, 0),
            Self::Exchanged(..) | Self::Reversed(_) => (3, 0),
            Self::Height => (1, 1),
            Self::Plan => (1, 2),
            Self::Shift => (1, 3),
        }
    }

    /// Misfits (m) of `recorded` against `expected` once it is undone.
    pub fn misfits(self, recorded: &[Vector3<f64>], expected: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let undo = |p: &Vector3<f64>| {
            let mut p = *p;
            match self {
                Self::Unit(metres) => p *= metres,
                Self::HeightUnit(metres) => p.z *= metres,
                Self::Exchanged(a, b) => p.swap_rows(a, b),
                Self::Reversed(axis) => p[axis] = -p[axis],
                _ => {}
            }
            p
        };
        let mut misfits: Vec<Vector3<f64>> = recorded.iter().zip(expected).map(|(r, e)| undo(r) - e).collect();
        let axes: &[usize] = match self {
            Self::Height => &[2],
            Self::Plan => &[0, 1],
            Self::Shift => &[0, 1, 2],
            _ => &[],
        };
        for &axis in axes {
            let middle = median(&misfits.iter().map(|misfit| misfit[axis]).collect::<Vec<_>>());
            misfits.iter_mut().for_each(|misfit| misfit[axis] -= middle);
        }
        misfits
    }
}

/// What two groups differ by.
pub struct Difference {
    /// In which way.
    pub relation: Relation,
    /// Tested less reference, m.
    pub shift: Vector3<f64>,
    /// Its standard deviations, m.
    pub sigma: Vector3<f64>,
    /// Fall of the sum of squares without it.
    pub drop: f64,
    /// `ln p` of that.
    pub ln_p: f64,
}
