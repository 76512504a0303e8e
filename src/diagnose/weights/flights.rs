//! Image measurements by flight: what each flight has of `v'Pv`, and of whose variances that is made.
//!
//! A point is measured in several flights, so that residuals of one have errors of the others in them: with the
//! redundancy matrix `R`, `E(v_f'P v_f) = sum_g S_fg s_g^2` with `S_fg = sum |R_ab|^2` over the measurements `a` of `f`
//! and `b` of `g`. `R` is never formed: with columns `z` of random signs on the measurements of one flight each,
//! `E(z_f'R z_f)` is its redundancy `sum_g S_fg`, and `E(z_f'R z_g)^2 = S_fg` for two that are independent.
//!
//! Sources: Helmert's estimator of variance components in Koch, Parameter Estimation and Hypothesis Testing (1999),
//! sec. 3.6; random signs for a trace in Hutchinson (1989), Communications in Statistics 18.

use super::super::linearised::Linearised;
use crate::null_model::{Entries, Measured};
use crate::problem::Problem;
use crate::run::RunError;
use crate::run::fit::Fit;
use crate::run::squares;
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Columns of random signs per flight: their pairs leave a tenth of what a flight shares with another, a hundredth of
/// its own redundancy.
const DRAWS: usize = 16;

/// What a group of image measurements has of `v'Pv` and of the redundancy.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Share {
    pub(super) chi_square: f64,
    pub(super) redundancy: f64,
}

/// The flights of the images.
pub(super) struct Flights {
    flight_of_image: Vec<usize>,
    count: usize,
}

impl Flights {
    pub(super) fn new(problem: &Problem, count: usize) -> Self {
        Self { flight_of_image: problem.image_contexts.iter().map(|image| image.flight as usize).collect(), count }
    }

    pub(super) fn of_image(&self, image: u32) -> usize {
        self.flight_of_image[image as usize]
    }

    /// Number of columns.
    pub(super) fn columns(&self) -> usize {
        DRAWS * self.count
    }

    /// Entries of an image measurement.
    pub(super) fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        let flight = self.of_image(measured.observation.image);
        let bits = ChaCha8Rng::seed_from_u64(measured.number as u64).next_u64();
        let sign = |bit: usize| if bits >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let unit = 1.0 / measured.observation.inverse_sigma;
        for draw in 0..DRAWS {
            x.dense(DRAWS * flight + draw, unit * sign(2 * draw));
            y.dense(DRAWS * flight + draw, unit * sign(2 * draw + 1));
        }
    }

    /// The share of each flight, freed of what the errors of the others leave in its residuals. A flight without
    /// redundancy has none.
    ///
    /// # Errors
    /// A state that cannot be predicted.
    pub(super) fn shares(&self, linearised: &Linearised, fit: &Fit) -> Result<Vec<Share>, RunError> {
        let mixing = self.mixing(linearised);
        let chi_square = self.chi_square(fit)?;
        let measured: Vec<usize> = (0..self.count).filter(|flight| mixing[(*flight, *flight)] >= 1.0).collect();
        let mut shares = vec![Share::default(); self.count];
        if let Some(inverse) = mixing.select_rows(&measured).select_columns(&measured).try_inverse() {
            let variances = &inverse * chi_square.select_rows(&measured);
            for (position, flight) in measured.into_iter().enumerate() {
                // The variance of a variance factor is twice this inverse, as it is 2 / r of one with the redundancy r.
                let redundancy = 1.0 / inverse[(position, position)];
                shares[flight] = Share { chi_square: variances[position].max(0.0) * redundancy, redundancy };
            }
        }
        Ok(shares)
    }

    /// `S`, count x count.
    fn mixing(&self, linearised: &Linearised) -> DMatrix<f64> {
        let first = linearised.extra_columns.start;
        let form = |f: usize, k: usize, g: usize, l: usize| {
            linearised.system.information[(first + DRAWS * f + k, first + DRAWS * g + l)]
        };
        let pairs = || (0..DRAWS).flat_map(|k| (0..DRAWS).map(move |l| (k, l)));
        let mut mixing = DMatrix::from_fn(self.count, self.count, |f, g| {
            let squares = pairs().map(|(k, l)| form(f, k, g, l).powi(2));
            squares.sum::<f64>() / (DRAWS * DRAWS) as f64
        });
        for f in 0..self.count {
            let redundancy = (0..DRAWS).map(|k| form(f, k, f, k)).sum::<f64>() / DRAWS as f64;
            let of_others: f64 = (0..self.count).filter(|g| *g != f).map(|g| mixing[(f, g)]).sum();
            mixing[(f, f)] = redundancy - of_others;
        }
        mixing
    }

    /// `v'Pv` of each flight.
    fn chi_square(&self, fit: &Fit) -> Result<DVector<f64>, RunError> {
        let mut sums = DVector::zeros(self.count);
        squares::each(fit, |_, image, square| sums[self.flight_of_image[image]] += square)?;
        Ok(sums)
    }
}
