//! What two groups of surveyed positions may differ by.

use super::shape::FOOT;
use crate::math::statistics::median;
use nalgebra::{SMatrix, SVector, Vector3};

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
    /// It is tilted, and off.
    Tilt,
}

/// Positions that a tilt needs to be told from a wrong one among them.
const FEWEST_OF_TILT: usize = 4;
/// Rounds of the robust fit of a tilt: the weights of twenty have settled.
const ROUNDS: usize = 20;
/// Misfit below which a position weighs no more, m: nobody surveys better.
const LEAST_M: f64 = 1e-3;

/// In the order in which they are preferred: what is known exactly before what is estimated, little before much.
pub fn relations() -> Vec<Relation> {
    let units = [FOOT, 1e-3, 1e-2, 1.0 / FOOT, 1e3, 1e2];
    let mut all = vec![Relation::Same];
    all.extend(units.map(Relation::Unit));
    all.extend(units.map(Relation::HeightUnit));
    all.extend([Relation::Exchanged(0, 1), Relation::Exchanged(0, 2), Relation::Exchanged(1, 2)]);
    all.extend([0, 1, 2].map(Relation::Reversed));
    all.extend([Relation::Height, Relation::Plan, Relation::Shift, Relation::Tilt]);
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
            Self::Tilt => (1, 5),
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
        if self == Self::Tilt
            && let Some(tilt) = Tilt::of(&misfits, expected)
        {
            misfits.iter_mut().zip(expected).for_each(|(misfit, place)| *misfit -= tilt.at(place));
        }
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

    /// Misfits of `recorded` against `expected` with heights of zero, m.
    pub fn flattened(recorded: &[Vector3<f64>], expected: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let flat = |p: &Vector3<f64>| Vector3::new(p.x, p.y, 0.0);
        recorded.iter().zip(expected).map(|(r, e)| flat(r) - e).collect()
    }
}

/// A turn about a horizontal axis, and a shift.
pub struct Tilt {
    middle: Vector3<f64>,
    shift: Vector3<f64>,
    /// Angles about x and y, rad.
    angles: [f64; 2],
}

impl Tilt {
    /// The one that most misfits at some places agree with: of least absolute sum, by weights that follow the misfits.
    /// `None` of too few.
    pub fn of(misfits: &[Vector3<f64>], places: &[Vector3<f64>]) -> Option<Self> {
        if places.len() < FEWEST_OF_TILT {
            return None;
        }
        let middle = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
        let rows = |place: &Vector3<f64>| {
            let p = place - middle;
            let turned = [Vector3::x().cross(&p), Vector3::y().cross(&p)];
            SMatrix::<f64, 3, 5>::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z(), turned[0], turned[1]])
        };
        let mut weights = vec![1.0; places.len()];
        let mut found = SVector::<f64, 5>::zeros();
        for _ in 0..ROUNDS {
            let (mut normal, mut right) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
            for ((misfit, place), weight) in misfits.iter().zip(places).zip(&weights) {
                let rows = rows(place);
                normal += rows.transpose() * rows * *weight;
                right += rows.transpose() * misfit * *weight;
            }
            found = normal.cholesky()?.solve(&right);
            for ((misfit, place), weight) in misfits.iter().zip(places).zip(&mut weights) {
                *weight = 1.0 / (misfit - rows(place) * found).norm().max(LEAST_M);
            }
        }
        Some(Self { middle, shift: found.fixed_rows::<3>(0).into(), angles: [found[3], found[4]] })
    }

    /// What it does at a place, m.
    fn at(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.shift + Vector3::new(self.angles[0], self.angles[1], 0.0).cross(&(place - self.middle))
    }

    /// Its angle, rad.
    pub fn angle(&self) -> f64 {
        self.angles[0].hypot(self.angles[1])
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
    /// By how much the one is tilted against the other, rad.
    pub tilt: f64,
    /// Fall of the sum of squares without it.
    pub drop: f64,
    /// `ln p` of that.
    pub ln_p: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilt_is_found_beside_a_wrong_position() {
        let expected: Vec<Vector3<f64>> =
            (0..12).map(|k| Vector3::new(90.0 * f64::from(k % 4), 80.0 * f64::from(k / 4), f64::from(k % 5))).collect();
        let turn = nalgebra::Rotation3::new(Vector3::new(0.01, -0.004, 0.0));
        let mut recorded: Vec<Vector3<f64>> = expected.iter().map(|p| turn * p + Vector3::new(0.3, 0.0, 1.0)).collect();
        recorded[5].z += 7.0;
        let misfits: Vec<Vector3<f64>> = recorded.iter().zip(&expected).map(|(r, e)| r - e).collect();
        let tilt = Tilt::of(&misfits, &expected).expect("a tilt");
        assert!((tilt.angle() - 0.01f64.hypot(0.004)).abs() < 1e-4, "{}", tilt.angle());
        let left = Relation::Tilt.misfits(&recorded, &expected);
        let off: Vec<usize> = (0..12).filter(|k| left[*k].norm() > 0.05).collect();
        assert_eq!(off, [5], "second order in the angle is less: {left:?}");
        assert!(Tilt::of(&misfits[..3], &expected[..3]).is_none());
    }
}
