//! Numbers as people read them: the same in the terminal, in tables and in captions.

/// `digits` decimals; "not finite" for NaN and infinities.
pub fn fixed(v: f64, digits: usize) -> String {
    if v.is_finite() { unsigned_zero(format!("{v:.digits$}")) } else { "not finite".into() }
}

/// `digits` significant digits, with an exponent below 1e-3 and from 1e6 on.
pub fn significant(v: f64, digits: usize) -> String {
    if !v.is_finite() {
        return "not finite".into();
    }
    if v == 0.0 {
        return "0".into();
    }
    let digits = digits.max(1);
    let exponent_form = format!("{v:.*e}", digits - 1);
    let exponent = exponent_form.split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{v:.decimals$}")
    } else {
        exponent_form
    }
}

/// Metres given, millimetres written, three significant digits.
pub fn mm(metres: f64) -> String {
    significant(metres * 1e3, 3)
}

/// Pixels, three significant digits.
pub fn px(pixels: f64) -> String {
    significant(pixels, 3)
}

/// A value with its standard deviation, both to the deviation's second significant digit: `5510.095 ± 0.012`.
pub fn with_sigma(value: f64, sigma: f64) -> String {
    if !value.is_finite() || !sigma.is_finite() || sigma <= 0.0 {
        return format!("{} ± {}", significant(value, 6), significant(sigma, 2));
    }
    let exponent = sigma.log10().floor() as i32;
    let size = value.abs().max(sigma);
    if !(1e-3..1e7).contains(&size) {
        let common = size.log10().floor() as i32;
        let unit = 10f64.powi(common);
        let decimals = (common - exponent + 1).clamp(0, 15) as usize;
        return format!("({:.decimals$} ± {:.decimals$})e{common}", value / unit, sigma / unit);
    }
    let decimals = (1 - exponent).clamp(0, 15) as usize;
    format!("{} ± {sigma:.decimals$}", unsigned_zero(format!("{value:.decimals$}")))
}

/// A unit as it is shown: what has none has no `1`.
pub fn unit_of(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// A fraction as per cent, one decimal.
pub fn percent(fraction: f64) -> String {
    if fraction.is_finite() { format!("{} %", fixed(100.0 * fraction, 1)) } else { "not finite".into() }
}

/// What `format` makes of a value, or a dash where there is none.
pub fn or_dash(value: Option<f64>, format: impl Fn(f64) -> String) -> String {
    value.map_or("-".into(), format)
}

fn unsigned_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.into(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits() {
        assert_eq!(significant(0.0012345, 3), "0.00123");
        assert_eq!(significant(5510.094, 3), "5510");
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(3.1e-9, 2), "3.1e-9");
        assert_eq!(significant(f64::NAN, 3), "not finite");
        assert_eq!(mm(0.00092), "0.920");
    }

    #[test]
    fn values_with_sigma_share_their_last_digit() {
        assert_eq!(with_sigma(5510.0949, 0.0123), "5510.095 ± 0.012");
        assert_eq!(with_sigma(-0.00004, 0.02), "0.000 ± 0.020");
        assert_eq!(with_sigma(1234.5, 120.0), "1234 ± 120");
        assert_eq!(with_sigma(-3.2e-9, 1.1e-10), "(-3.20 ± 0.11)e-9");
        assert_eq!(with_sigma(1.0, 0.0), "1.00000 ± 0");
    }

    #[test]
    fn dashes_shares_and_zeros() {
        assert_eq!(or_dash(None, mm), "-");
        assert_eq!(percent(0.9731), "97.3 %");
        assert_eq!(fixed(-0.0001, 2), "0.00");
    }
}
