//! The variance of random values from their score and information, by restricted maximum likelihood.
//!
//! With `M` the information of the values (everything else eliminated), `l_i` its eigenvalues and `phi` the variance
//! factor, the score has in the eigenbasis independent entries `s_i ~ N(0, phi l_i + t^2 l_i^2)`, `t^2` the variance of
//! a value. Their likelihood is a function of one number: no further adjustment per round.
//!
//! Source: Searle, Casella, McCulloch (1992), Variance Components, ch. 6; Fisher scoring.

use faer::{Mat, Side};

/// Steps of the estimation; each makes the error smaller by a factor of its own, four do for three digits.
const STEPS: usize = 60;
/// Relative change of the variance at which it is known: far below its own uncertainty, sqrt(2 / n).
const KNOWN: f64 = 1e-4;
/// Eigenvalues below this share of the largest are rounding.
const KEPT_SHARE: f64 = 1e-5;

/// Smallest and largest information of a typical value, as multiples of its prior's, that a variance is searched
/// between.
const RATIOS: [f64; 2] = [1e-5, 1e9];
/// Places at which a variance is tried before the best is refined: the likelihood may have two maxima.
const PLACES: usize = 60;
/// Steps of the golden section, each of which leaves 62 %: of the distance of two places a thousandth.
const SECTIONS: usize = 16;

/// Where a function of one variable is least: the best of evenly spaced places, refined by golden section.
fn minimum(function: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let step = (high - low) / PLACES as f64;
    let place = |k: usize| low + k as f64 * step;
    let best = (0..=PLACES).min_by(|a, b| function(place(*a)).total_cmp(&function(place(*b)))).unwrap_or(0);
    let (mut low, mut high) = (place(best.saturating_sub(1)), place((best + 1).min(PLACES)));
    let share = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..SECTIONS {
        let (left, right) = (high - share * (high - low), low + share * (high - low));
        if function(left) < function(right) { high = right } else { low = left }
    }
    0.5 * (low + high)
}

/// Scores and information of random values in the basis in which they are independent.
#[derive(Debug, Clone)]
pub struct RandomValues {
    /// Eigenvalues of the information.
    pub eigenvalues: Vec<f64>,
    /// Scores in the eigenbasis.
    pub scores: Vec<f64>,
    /// Eigenvectors, column by column.
    pub basis: Mat<f64>,
}

impl RandomValues {
    /// Of `n` values: `information(i, j)` and `score(i)`. `None` where there is no eigenbasis (values that are not
    /// finite).
    pub fn new(n: usize, information: impl Fn(usize, usize) -> f64, score: impl Fn(usize) -> f64) -> Option<Self> {
        let information = Mat::from_fn(n, n, &information);
        let eigen = information.self_adjoint_eigen(Side::Lower).ok()?;
        let basis = eigen.U().to_owned();
        let eigenvalues = (0..n).map(|k| eigen.S()[k].max(0.0)).collect();
        let scores = (0..n).map(|k| (0..n).map(|i| basis[(i, k)] * score(i)).sum()).collect();
        Some(Self { eigenvalues, scores, basis })
    }

    /// Directions that the rest leaves.
    pub fn left(&self) -> Vec<usize> {
        let largest = self.eigenvalues.iter().copied().fold(0.0, f64::max);
        (0..self.eigenvalues.len()).filter(|k| self.eigenvalues[*k] > KEPT_SHARE * largest).collect()
    }

    /// Variance `t^2` of largest likelihood, at least `least` (zero; below zero for a precision that was stated too
    /// low), under the variance factor `phi`.
    pub fn variance(&self, phi: f64, least: f64) -> f64 {
        let kept = self.left();
        let mut size: f64 = 0.0;
        for _ in 0..STEPS {
            let (mut sum, mut weights) = (0.0, 0.0);
            for k in &kept {
                let (l, value) = (self.eigenvalues[*k], self.scores[*k] / self.eigenvalues[*k]);
                let own = phi / l;
                let weight = (own + size).max(KNOWN * own).powi(-2);
                sum += weight * (value * value - own);
                weights += weight;
            }
            let next = if weights > 0.0 { (sum / weights).max(least) } else { 0.0 };
            let change = (next - size).abs();
            size = next;
            if change <= KNOWN * size.abs() {
                break;
            }
        }
        size
    }

    /// Variance of a value as a multiple `rho` of the variance factor `phi`: the minimum of `chi(rho) / phi + sum ln(1
    /// + rho l)`. `None` where zero is likeliest.
    pub fn likeliest_ratio(&self, phi: f64) -> Option<f64> {
        let kept = self.left();
        let mean = kept.iter().map(|k| self.eigenvalues[*k]).sum::<f64>() / kept.len().max(1) as f64;
        let lack = |ln_ratio: f64| {
            let ratio = ln_ratio.exp();
            let mut lack = 0.0;
            for k in &kept {
                let (l, s) = (self.eigenvalues[*k], self.scores[*k]);
                lack += (ratio * l).ln_1p() - s * s * ratio / (1.0 + ratio * l) / phi;
            }
            lack
        };
        let (low, high) = RATIOS.map(|ratio| ratio.ln() - mean.ln()).into();
        let ln_ratio = minimum(lack, low, high);
        (mean > 0.0 && lack(ln_ratio) < 0.0).then(|| ln_ratio.exp())
    }

    /// Twice the logarithm of the likelihood ratio of the variance `size` against zero.
    pub fn likelihood_ratio(&self, phi: f64, size: f64) -> f64 {
        let of = |k: usize| {
            let (l, s) = (self.eigenvalues[k], self.scores[k]);
            let (without, with) = (phi * l, phi * l + size * l * l);
            s * s * (1.0 / without - 1.0 / with) - (with / without).ln()
        };
        self.left().into_iter().map(of).sum()
    }
}
