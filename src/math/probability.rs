//! Probabilities as people read them: the one form for terminal, report and sentences.

/// Below this a tail is not known.
const LEAST: f64 = 1e-300;

/// A probability. Anything below 1e-300, zero included, is "< 1e-300": the tail is not known better than that.
pub fn p_value(p: f64) -> String {
    if !(0.0..=1.0).contains(&p) {
        "not a probability".into()
    } else if p < LEAST {
        format!("< {LEAST:e}")
    } else if p < 1e-3 {
        format!("{p:.0e}")
    } else {
        format!("{p:.3}")
    }
}

/// A probability in a sentence: `p = 0.012`, `p < 1e-300`.
pub fn p_is(p: f64) -> String {
    match p_value(p) {
        bound if bound.starts_with('<') => format!("p {bound}"),
        value => format!("p = {value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_where_it_can_be_read_and_a_bound_below() {
        assert_eq!([0.0, 2.6e-7, 0.0321, 1.0].map(p_value), ["< 1e-300", "3e-7", "0.032", "1.000"]);
        assert_eq!(p_value(f64::NAN), "not a probability");
        assert_eq!([0.0124, 3e-8, 1e-299].map(p_is), ["p = 0.012", "p = 3e-8", "p = 1e-299"]);
        // From logarithms, of which some are of no double.
        assert_eq!(
            [-22606.0_f64, -921.0, -250.0].map(|ln_p| p_is(ln_p.exp())),
            ["p < 1e-300", "p < 1e-300", "p = 3e-109"]
        );
    }
}
