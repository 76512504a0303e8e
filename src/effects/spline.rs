//! Uniform cubic B-splines over `[0, 1]`, shared by the empirical effects.
//!
//! `n` coefficients span `n - 3` equal intervals; the knots are uniform and not clamped, so that every coefficient but
//! the outer three has the same bump. Over interval `j` with `t` from 0 to 1, coefficients `j .. j + 3` have the
//! weights
//!
//! ```text
//! (1 - t)^3 / 6,   (3 t^3 - 6 t^2 + 4) / 6,   (-3 t^3 + 3 t^2 + 3 t + 1) / 6,   t^3 / 6
//! ```
//!
//! which sum to one. Outside `[0, 1]` the outer intervals' cubics go on.
//!
//! Source: de Boor (1978), A Practical Guide to Splines.

/// First of the four coefficients that `s` sees, of `coefficients` (at least 4), their weights, and the derivatives of
/// the weights by `s`.
pub(super) fn weights(s: f64, coefficients: usize) -> (usize, [f64; 4], [f64; 4]) {
    let intervals = (coefficients - 3) as f64;
    let first = (s * intervals).floor().clamp(0.0, intervals - 1.0);
    let (weights, slopes) = piece(s * intervals - first);
    (first as usize, weights, slopes.map(|slope| slope * intervals))
}

/// The four weights over an interval, `t` from 0 to 1, and their derivatives by `t`.
pub(super) fn piece(t: f64) -> ([f64; 4], [f64; 4]) {
    let u = 1.0 - t;
    let weights = [
        u * u * u / 6.0,
        ((3.0 * t - 6.0) * t * t + 4.0) / 6.0,
        (((3.0 - 3.0 * t) * t + 3.0) * t + 1.0) / 6.0,
        t * t * t / 6.0,
    ];
    (weights, [-0.5 * u * u, (1.5 * t - 2.0) * t, (1.0 - 1.5 * t) * t + 0.5, 0.5 * t * t])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn weights_reproduce_a_straight_line() {
        // With coefficients at their Greville abscissae, the spline is the identity.
        for n in [4, 6, 8] {
            for s in [-0.1, 0.0, 0.2, 1.0 / 3.0, 0.77, 1.0, 1.15] {
                let (first, weights, slopes) = weights(s, n);
                let place = |k: usize| ((first + k) as f64 - 1.0) / (n - 3) as f64;
                let line = |values: [f64; 4]| (0..4).map(|k| values[k] * place(k)).sum::<f64>();
                assert_relative_eq!(line(weights), s, epsilon = 1e-14);
                assert_relative_eq!(line(slopes), 1.0, epsilon = 1e-13);
            }
        }
    }

    #[test]
    fn second_derivative_is_continuous_at_a_knot() {
        // One coefficient's bump around the inner knot of five coefficients.
        let bump = |s: f64| {
            let (first, weights, _) = weights(s, 5);
            2_usize.checked_sub(first).filter(|k| *k < 4).map_or(0.0, |k| weights[k])
        };
        let h = 1e-3;
        let second = |s: f64| (bump(s + h) - 2.0 * bump(s) + bump(s - h)) / (h * h);
        // Third derivatives are of the order of 3 (intervals)^3 = 24: the two sides differ by 2 h of that.
        assert_relative_eq!(second(0.5 - h), second(0.5 + h), epsilon = 4.0 * h * 24.0);
    }
}
