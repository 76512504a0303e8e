//! Splits values of images into two groups, and tests the split.

use super::{BEYOND, KINDS};
use crate::math::statistics::{f_ln_sf, median};
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::LN_2;

/// Rounds in which images change sides: most divisions are found in two.
const ROUNDS: usize = 10;

/// Which values belong to the smaller of two parts that lie further apart than `least` and ten times further than they
/// spread; `None` where they are one.
pub fn divided(values: &[[f64; 2]], least: f64) -> Option<Vec<bool>> {
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let middle = of_part(values, |_| true);
    let farthest =
        |from: [f64; 2]| values.iter().copied().max_by(|a, b| distance(*a, from).total_cmp(&distance(*b, from)));
    let first = farthest(middle)?;
    let mut centres = [first, farthest(first)?];
    let mut second: Vec<bool> = Vec::new();
    for _ in 0..ROUNDS {
        second = values.iter().map(|value| distance(*value, centres[1]) < distance(*value, centres[0])).collect();
        centres = [false, true].map(|part| of_part(values, |k| second[k] == part));
    }
    let spread = |part: bool| {
        let own = values.iter().zip(&second).filter(|(_, own)| **own == part);
        median(&own.map(|(value, _)| distance(*value, centres[usize::from(part)])).collect::<Vec<_>>())
    };
    let between = distance(centres[0], centres[1]);
    let is_apart = between > least && between > BEYOND * spread(false).max(spread(true));
    if 2 * second.iter().filter(|second| **second).count() > second.len() {
        second.iter_mut().for_each(|second| *second = !*second);
    }
    is_apart.then_some(second)
}

/// Median of a part by coordinate.
fn of_part(values: &[[f64; 2]], is_in: impl Fn(usize) -> bool) -> [f64; 2] {
    let axis = |axis: usize| {
        let own = values.iter().enumerate().filter(|(k, _)| is_in(*k));
        median(&own.map(|(_, value)| value[axis]).collect::<Vec<_>>())
    };
    [axis(0), axis(1)]
}

/// From the middle of the larger part to that of the smaller one.
pub fn apart(values: &[[f64; 2]], second: &[bool]) -> [f64; 2] {
    let [a, b] = [false, true].map(|part| of_part(values, |k| second[k] == part));
    [b[0] - a[0], b[1] - a[1]]
}

/// What a division says against none.
pub struct Test {
    /// Fall of the sum of squares, in units of the residual variance.
    pub drop: f64,
    /// `ln p` of that, every way to divide the images counted as an alternative.
    pub ln_p: f64,
    /// Standard deviation of the distance between the two parts.
    pub sigma: f64,
}

/// Tests two means against one (F test). The best of all divisions lowers the sum of squares of a single cloud by a
/// third, so that the test pays for all `2^(n - 1)` of them. `dimensions`: one where the second coordinate is always
/// zero.
pub fn tested(values: &[[f64; 2]], covariances: &[Matrix2<f64>], second: &[bool], dimensions: usize) -> Option<Test> {
    let weights: Vec<Matrix2<f64>> = covariances.iter().map(|own| own.try_inverse()).collect::<Option<_>>()?;
    // Weighted mean of some images, its cofactors, and the sum of squares about it.
    let about_mean = |is_in: &dyn Fn(usize) -> bool| {
        let own: Vec<usize> = (0..values.len()).filter(|k| is_in(*k)).collect();
        let normal: Matrix2<f64> = own.iter().map(|k| weights[*k]).sum();
        let cofactors = normal.try_inverse()?;
        let mean = cofactors * own.iter().map(|k| weights[*k] * Vector2::from(values[*k])).sum::<Vector2<f64>>();
        let off = |k: &usize| Vector2::from(values[*k]) - mean;
        let squares = own.iter().map(|k| off(k).dot(&(weights[*k] * off(k)))).sum::<f64>();
        Some((mean, cofactors, squares))
    };
    let (_, _, of_one) = about_mean(&|_| true)?;
    let (first_mean, first, in_first) = about_mean(&|k| !second[k])?;
    let (second_mean, other, in_second) = about_mean(&|k| second[k])?;
    let redundancy = dimensions * values.len().checked_sub(2).filter(|own| *own > 0)?;
    let variance = (in_first + in_second) / redundancy as f64;
    let drop = (of_one - in_first - in_second) / variance;
    let of_mean = dimensions as f64;
    let divisions = (values.len() - 1) as f64 * LN_2;
    let ln_p = f_ln_sf(drop / of_mean, of_mean, redundancy as f64) + divisions + KINDS.ln();
    let between = (second_mean - first_mean).try_normalize(0.0)?;
    let sigma = (variance * between.dot(&((first + other) * between))).sqrt();
    Some(Test { drop, ln_p: ln_p.min(0.0), sigma })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> [f64; 2] {
        let k = k as f64;
        [0.8 * (3.1 * k).sin(), 0.8 * (5.3 * k).cos()]
    }

    #[test]
    fn two_parts_are_told_from_one() {
        let two: Vec<[f64; 2]> = (0..30)
            .map(|k| {
                let [x, y] = noise(k);
                if k % 3 == 0 { [x + 25.0, y - 12.0] } else { [x, y] }
            })
            .collect();
        let second = divided(&two, 10.0).expect("two parts");
        assert!((0..30).all(|k| second[k] == (k % 3 == 0)), "{second:?}");
        let [dx, dy] = apart(&two, &second);
        assert!((dx - 25.0).abs() < 1.0 && (dy + 12.0).abs() < 1.0);

        let one: Vec<[f64; 2]> = (0..30).map(noise).collect();
        assert_eq!(divided(&one, 10.0), None);
        let wide: Vec<[f64; 2]> = (0..30).map(|k| noise(k).map(|n| 30.0 * n)).collect();
        assert_eq!(divided(&wide, 10.0), None, "shifts that nothing determines spread as they lie apart");
        assert_eq!(divided(&[], 10.0), None);
    }

    #[test]
    fn a_division_pays_for_every_way_to_divide() {
        // Normal to the eye: three sines together.
        let noise = |k: usize| {
            let wave = |f: f64| (f * (k * k + 3 * k) as f64).sin();
            [8.0 * (wave(1.7) + wave(2.9) + wave(4.3)), 8.0 * (wave(1.1) + wave(3.7) + wave(5.9))]
        };
        let one: Vec<[f64; 2]> = (0..60).map(noise).collect();
        let covariances = vec![Matrix2::identity() * 4.0; 60];
        let by_place: Vec<bool> = one.iter().map(|[x, _]| *x > 0.0).collect();
        let test = tested(&one, &covariances, &by_place, 2).expect("a test");
        assert!(test.drop > 50.0 && test.ln_p == 0.0, "no cloud is two: {} {}", test.drop, test.ln_p);

        let second: Vec<bool> = (0..60).map(|k| k % 3 == 0).collect();
        let two: Vec<[f64; 2]> =
            one.iter().zip(&second).map(|([x, y], second)| if *second { [x + 300.0, *y] } else { [*x, *y] }).collect();
        let test = tested(&two, &covariances, &second, 2).expect("a test");
        assert!(test.ln_p < (1e-3_f64).ln() && test.sigma < 20.0, "{} {}", test.ln_p, test.sigma);
    }
}
