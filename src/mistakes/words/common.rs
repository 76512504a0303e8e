//! Pieces of sentences.

use super::super::Mistake;
use super::super::shape::FOOT;
use super::super::survey::Subject;

/// Names that a sentence lists; the list `names` has all.
const LISTED: usize = 5;
pub const AXES: [&str; 3] = ["x", "y", "z"];

pub fn mistake(kind: &str, subject: &str, names: Vec<String>, drop: f64, ln_p: f64, text: [String; 2]) -> Mistake {
    let [sentence, remedy] = text;
    Mistake::new(kind, subject, sentence, remedy).of(names).tested(drop, ln_p)
}

pub fn with(mistake: Mistake, value: f64, sigma: Option<f64>, unit: &str) -> Mistake {
    mistake.sized(value, sigma, unit)
}

pub fn list(names: &[String]) -> String {
    let shown = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

pub fn rows(by: isize) -> String {
    let rows = if by.unsigned_abs() == 1 { "row" } else { "rows" };
    format!("{} {rows} further {}", by.unsigned_abs(), if by > 0 { "down" } else { "up" })
}

/// Columns of two groups.
pub fn places(one: Subject, other: Subject) -> String {
    match [one.place(), other.place()] {
        [one, other] if one == other => one.into(),
        [one, other] => format!("{one}; {other}"),
    }
}

pub fn unit(metres: f64) -> String {
    let factor = 1.0 / metres;
    match metres {
        m if m == FOOT => format!("in feet (a factor of {factor:.4})"),
        m if m == 1.0 / FOOT => format!("too small by {factor:.4}, as metres that were taken for feet and converted"),
        1e-3 => "in millimetres".into(),
        1e-2 => "in centimetres".into(),
        _ => format!("in a unit of {metres} m"),
    }
}

pub fn lower(subject: Subject) -> String {
    match subject {
        Subject::Control => "control points".into(),
        Subject::Check => "check points".into(),
        Subject::Gnss => "GNSS positions".into(),
    }
}
