//! Measurements that were set aside as outliers, in a sentence.

use super::verdict::Diagnosis;
use crate::block::Block;
use crate::snooping::Outliers;

/// Points that are named; of more nobody reads a list, and outliers.csv has them all.
const NAMED: usize = 5;

/// Points of which measurements were set aside; none where they are many.
pub(super) fn points(outliers: &Outliers, block: &Block) -> Vec<String> {
    let mut names: Vec<String> = outliers.rows(block).into_iter().map(|row| row.point).collect();
    names.sort();
    names.dedup();
    if names.len() > NAMED { Vec::new() } else { names }
}

impl Diagnosis {
    /// What was set aside; `None` where nothing was.
    pub fn set_aside(&self) -> Option<String> {
        let measurements = match self.outliers {
            0 => return None,
            1 => "1 measurement was set aside as an outlier".to_string(),
            n => format!("{n} measurements were set aside as outliers"),
        };
        let at = match &self.outlier_points[..] {
            [] => String::new(),
            [point] => format!(" (point {point})"),
            points => format!(" (points {})", points.join(", ")),
        };
        Some(format!("{measurements}{at}."))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_points_are_named() {
        let of = |outliers: usize, points: &[&str]| {
            let mut diagnosis: Diagnosis = serde_json::from_str(
                r#"{"format": 1, "verdict": "adequate", "significance": 0.001, "candidates": [], "recommended": [],
                    "structure": [], "left": [], "left_shapes": [], "ledger": [], "outliers": 0, "sigma_factors":
                    {"image": 1.0, "control": 1.0, "control_z": 1.0, "gnss": 1.0, "gnss_z": 1.0}}"#,
            )
            .expect("a diagnosis");
            diagnosis.outliers = outliers;
            diagnosis.outlier_points = points.iter().map(|name| name.to_string()).collect();
            diagnosis.set_aside()
        };
        assert_eq!(of(0, &[]), None);
        assert_eq!(of(1, &["t7"]).as_deref(), Some("1 measurement was set aside as an outlier (point t7)."));
        assert_eq!(of(3, &["t7", "t9"]).as_deref(), Some("3 measurements were set aside as outliers (points t7, t9)."));
        assert_eq!(of(30, &[]).as_deref(), Some("30 measurements were set aside as outliers."));
    }
}
