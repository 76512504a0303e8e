//! Probabilities in words.

/// `p = 0.012`, `p = 1e-400`: the second cannot be written as a number of its own.
pub fn probability(ln_p: f64) -> String {
    let exponent = ln_p / std::f64::consts::LN_10;
    if exponent > -3.0 { format!("p = {:.3}", ln_p.exp()) } else { format!("p = 1e{exponent:.0}") }
}

#[cfg(test)]
mod tests {
    use super::probability;

    #[test]
    fn a_number_where_it_can_be_read_and_its_power_of_ten_elsewhere() {
        assert_eq!(probability(0.0), "p = 1.000");
        assert_eq!(probability(0.0124f64.ln()), "p = 0.012");
        assert_eq!(probability(3e-8f64.ln()), "p = 1e-8");
        assert_eq!(probability(-921.0), "p = 1e-400");
    }
}
