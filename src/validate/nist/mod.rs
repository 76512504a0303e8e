//! The nonlinear regression sets of NIST (Statistical Reference Datasets), for the loop of the native
//! Levenberg-Marquardt itself: the very same loop, with dense rows in the place of a reduced system.
//!
//! NIST's files are not part of the program: `misclosure validate --nist DIR` names their folder.
//! Source: <https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml>.

mod dense;
pub mod models;
pub mod set;

use crate::adjust::native::lm::{self, Iterated};
use crate::adjust::{CovarianceOf, Options};
use dense::Regression;
use set::{Difficulty, NistError, Set};
use std::ops::ControlFlow;
use std::path::Path;

/// Digits that are asked for.
pub const DIGITS: f64 = 8.0;
/// Digits that NIST certifies.
const CERTIFIED_DIGITS: f64 = 11.0;
/// A sum of squares so many times the certified one is that of another minimum.
const OTHER_MINIMUM: f64 = 1.01;
/// Steps at most: far starts of the harder sets lead through long valleys.
const MOST_STEPS: usize = 2000;

/// What the loop made of a set.
#[derive(Debug, Clone)]
pub struct NistOutcome {
    /// The set.
    pub set: String,
    /// How hard NIST says that it is.
    pub difficulty: Difficulty,
    /// From the near start?
    pub near: bool,
    /// Steps tried; `None` where it failed.
    pub iterations: Option<usize>,
    /// Digits of the worst parameter, at most the eleven that are certified; zero where it failed.
    pub digits: f64,
    /// Digits of the worst standard deviation.
    pub deviation_digits: f64,
    /// Why it failed.
    pub failure: Option<String>,
    /// The loop ended in another minimum: its sum of squares, and the certified one.
    pub other_minimum: Option<(f64, f64)>,
    /// The file's own sum of squares is not that of its certified values: `(stated, at these values)`. One of its
    /// numbers is wrong, and it can certify nothing.
    pub contradiction: Option<(f64, f64)>,
}

impl NistOutcome {
    /// Are so many digits asked for here? From the near start always, from the far one where NIST does not call the set
    /// hard; not where the file contradicts itself.
    pub fn counts(&self) -> bool {
        self.contradiction.is_none() && (self.near || self.difficulty != Difficulty::Higher)
    }

    /// Is it as good as is asked for?
    pub fn passes(&self) -> bool {
        self.digits >= DIGITS
    }
}

/// Runs every set of a folder from both starting points.
///
/// # Errors
/// A file that is missing or none of NIST's.
pub fn run_all(folder: &Path) -> Result<Vec<NistOutcome>, NistError> {
    let mut outcomes = Vec::new();
    for name in models::NAMES {
        let set = set::read(folder, name)?;
        outcomes.extend([false, true].map(|near| run(&set, near)));
    }
    Ok(outcomes)
}

/// Runs a set from one of its starting points.
pub fn run(set: &Set, near: bool) -> NistOutcome {
    let options = Options {
        max_iterations: MOST_STEPS,
        // Relative to chi-square, whatever its size: Lanczos1 has 1e-25.
        chi_square_change: 0.0,
        covariance: CovarianceOf::Nothing,
        ..Options::default()
    };
    let regression = Regression(set);
    let start = set.starts[usize::from(near)].clone();
    let found = lm::minimise(&regression, start, &options, &mut |_| ControlFlow::Continue(()));
    let nothing = NistOutcome {
        set: set.name.clone(),
        difficulty: set.difficulty,
        near,
        iterations: None,
        digits: 0.0,
        deviation_digits: 0.0,
        failure: None,
        other_minimum: None,
        contradiction: regression.contradiction(),
    };
    match found {
        Err(error) => NistOutcome { failure: Some(error.to_string()), ..nothing },
        Ok(found) => {
            let deviations = regression.deviations(&found.system).unwrap_or_default();
            // Terms of one form may have found each other's place.
            let as_certified = |order: &Vec<usize>| {
                let of = |values: &[f64]| order.iter().filter_map(|k| values.get(*k).copied()).collect::<Vec<f64>>();
                (digits(&of(&found.state), &set.certified), digits(&of(&deviations), &set.deviations))
            };
            let orders = orders(set.certified.len(), models::exchangeable(&set.name));
            let best = orders.iter().map(as_certified).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
            let sum = regression.chi_square(&found.system);
            NistOutcome {
                iterations: Some(found.iterations),
                digits: best.0,
                deviation_digits: best.1,
                other_minimum: (sum > OTHER_MINIMUM * set.sum_of_squares).then_some((sum, set.sum_of_squares)),
                ..nothing
            }
        }
    }
}

/// Digits of the worst of some values, from 0 to the eleven certified.
fn digits(found: &[f64], certified: &[f64]) -> f64 {
    if found.len() != certified.len() {
        return 0.0;
    }
    let worst = found.iter().zip(certified).map(|(a, b)| ((a - b) / b).abs());
    let worst = worst.fold(0.0, |most: f64, error| if error.is_nan() { f64::INFINITY } else { most.max(error) });
    (-worst.log10()).clamp(0.0, CERTIFIED_DIGITS)
}

/// The orders of `count` parameters in which some groups stand in each other's places.
fn orders(count: usize, groups: &[&[usize]]) -> Vec<Vec<usize>> {
    let mut places: Vec<Vec<usize>> = vec![Vec::new()];
    for _ in groups {
        let longer = |places: &Vec<usize>| {
            let rest = (0..groups.len()).filter(|group| !places.contains(group));
            rest.map(|group| [places.as_slice(), &[group]].concat()).collect::<Vec<_>>()
        };
        places = places.iter().flat_map(longer).collect();
    }
    let order = |places: &Vec<usize>| {
        let mut order: Vec<usize> = (0..count).collect();
        for (group, from) in groups.iter().zip(places) {
            group.iter().zip(groups[*from]).for_each(|(to, from)| order[*to] = *from);
        }
        order
    };
    places.iter().map(order).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_of_the_worst() {
        assert!((digits(&[1.0, 2.0002], &[1.0, 2.0]) - 4.0).abs() < 1e-9);
        assert_eq!(digits(&[1.0], &[1.0]), CERTIFIED_DIGITS);
        assert_eq!(digits(&[f64::NAN], &[1.0]), 0.0);
        assert_eq!(digits(&[3.0], &[1.0]), 0.0);
        assert_eq!(digits(&[], &[1.0]), 0.0);
    }

    #[test]
    fn groups_take_each_others_places() {
        assert_eq!(orders(3, &[]), [[0, 1, 2]]);
        assert_eq!(orders(5, &[&[1, 3], &[2, 4]]), [[0, 1, 2, 3, 4], [0, 2, 1, 4, 3]]);
        assert_eq!(orders(6, &[&[0, 1], &[2, 3], &[4, 5]]).len(), 6);
    }
}
