//! How a block that ties alone hold is bent: a quadratic surface of each coordinate over the plan, from the members
//! that agree.
//!
//! A free network of parallel images is a shallow dome: its corners stand out from the similarity, and nobody measured
//! them wrongly. A member is held against the bent network, with the precision that the surface has at its place: far
//! outside the others it has little.

use super::align::{Aligned, majority};
use crate::math::statistics::chi_square_quantile;
use nalgebra::{Matrix6, Matrix6x3, Vector2, Vector3, Vector6};

/// Members that a surface needs beyond its terms.
const REDUNDANT: usize = 3;
/// Terms of a surface, and of a dome for fewer members.
const TERMS: [usize; 2] = [6, 4];
/// Eigenvalue per member below which a term is not there.
const EMPTY: f64 = 1e-9;
const ROUNDS: usize = 10;
/// Share of right members that a round keeps.
const KEPT: f64 = 0.99;

/// Number of terms of the surface that `members` can determine; 0 means that there is a similarity alone.
pub fn surface_terms(members: usize) -> usize {
    TERMS.into_iter().find(|terms| members >= terms + REDUNDANT).unwrap_or(0)
}

/// A group beside the bent network.
#[derive(Debug, Clone)]
pub struct Bend {
    centre: Vector2<f64>,
    extent: Vector2<f64>,
    dome: bool,
    coefficients: Matrix6x3<f64>,
    inverse: Matrix6<f64>,
    /// Standard deviations of a misfit, m.
    pub deviation: [f64; 3],
    /// Degrees of freedom of `deviation`.
    pub dof: f64,
}

impl Bend {
    /// No surface: the similarity alone, as it is for few members.
    fn none(aligned: &Aligned) -> Self {
        let [xy, z] = aligned.deviation();
        Self {
            centre: Vector2::zeros(),
            extent: Vector2::repeat(1.0),
            dome: false,
            coefficients: Matrix6x3::zeros(),
            inverse: Matrix6::zeros(),
            deviation: [xy, xy, z],
            dof: aligned.dof,
        }
    }

    /// Of the members of a group at their `places` in the survey.
    pub fn of(aligned: &Aligned, places: &[Vector3<f64>]) -> Self {
        let fitted = |dome: bool| Self::fitted(aligned, places, dome);
        fitted(false).or_else(|| fitted(true)).unwrap_or_else(|| Self::none(aligned))
    }

    fn fitted(aligned: &Aligned, places: &[Vector3<f64>], dome: bool) -> Option<Self> {
        let (n, count) = (places.len(), TERMS[usize::from(dome)]);
        let mut bend = Self { dome, ..Self::none(aligned) };
        bend.centre = places.iter().map(|p| p.xy()).sum::<Vector2<f64>>() / n as f64;
        bend.extent = places.iter().fold(Vector2::zeros(), |most, p| most.sup(&(p.xy() - bend.centre).abs()));
        if bend.extent.min() <= 0.0 {
            return None;
        }
        let stated = aligned.stated();
        let limit = chi_square_quantile(KEPT, 3.0);
        let mut variance = aligned.variance;
        let mut kept: Vec<usize> = (0..n).filter(|k| aligned.square(*k) <= limit * variance).collect();
        for _ in 0..ROUNDS {
            if kept.len() < (count + REDUNDANT).max(majority(n)) {
                return None;
            }
            let (mut normal, mut right) = (Matrix6::zeros(), Matrix6x3::zeros());
            for &k in &kept {
                let terms = bend.terms(&places[k]);
                normal += terms * terms.transpose();
                right += terms * aligned.misfits[k].transpose();
            }
            bend.inverse = normal.pseudo_inverse(EMPTY * kept.len() as f64).ok()?;
            bend.coefficients = bend.inverse * right;
            let squares: Vec<f64> = (0..n)
                .map(|k| {
                    let rest = aligned.misfits[k] - bend.at(&places[k]);
                    (0..3).map(|axis| (rest[axis] / stated[axis]).powi(2)).sum()
                })
                .collect();
            bend.dof = (3 * (kept.len() - count)) as f64;
            variance = (kept.iter().map(|k| squares[*k]).sum::<f64>() / bend.dof).max(1.0);
            bend.deviation = stated.map(|sigma| sigma * variance.sqrt());
            let fits = |k: &usize| squares[*k] <= limit * variance * bend.factor(&places[*k], kept.contains(k)).powi(2);
            let next: Vec<usize> = (0..n).filter(fits).collect();
            if next == kept {
                break;
            }
            kept = next;
        }
        Some(bend)
    }

    fn terms(&self, place: &Vector3<f64>) -> Vector6<f64> {
        let at = (place.xy() - self.centre).component_div(&self.extent);
        match self.dome {
            true => Vector6::new(1.0, at.x, at.y, at.norm_squared(), 0.0, 0.0),
            false => Vector6::new(1.0, at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y),
        }
    }

    /// The surface at a place, m.
    pub fn at(&self, place: &Vector3<f64>) -> Vector3<f64> {
        (self.terms(place).transpose() * self.coefficients).transpose()
    }

    /// Standard deviation of a misfit there in units of `deviation`: smaller than one for a member that took part in
    /// the surface.
    fn factor(&self, place: &Vector3<f64>, took_part: bool) -> f64 {
        let terms = self.terms(place);
        let leverage = terms.dot(&(self.inverse * terms));
        if took_part { (1.0 - leverage).max(0.0).sqrt() } else { self.outside(place) }
    }

    /// The same of a member that did not take part.
    pub fn outside(&self, place: &Vector3<f64>) -> f64 {
        let terms = self.terms(place);
        (1.0 + terms.dot(&(self.inverse * terms))).sqrt()
    }
}
