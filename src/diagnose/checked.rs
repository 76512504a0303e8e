//! Check points that contradict a block. They decide no effect; but nobody may call a block adequate that they show to
//! be wrong by an order of magnitude more than its own errors allow.

use super::verdict::{Diagnosis, StructureEntry, Verdict};
use crate::mistakes::BEYOND;

impl Diagnosis {
    /// The test of the check points' heights that is furthest beyond what the block allows: ten standard deviations at
    /// least, in the mean over its degrees of freedom.
    pub fn contradicted_by_check_points(&self) -> Option<&StructureEntry> {
        let at_check_points = self.structure.iter().filter(|test| !test.decides);
        let beyond = at_check_points.filter(|test| test.statistic >= BEYOND * BEYOND);
        beyond.max_by(|a, b| a.statistic.total_cmp(&b.statistic))
    }

    /// Is that all that the verdict stands on?
    pub fn check_points_alone_contradict(&self) -> bool {
        self.verdict == Verdict::Unexplained && self.left.len() == 1 && self.contradicted_by_check_points().is_some()
    }

    /// Without a mistake that explains it, such a contradiction is something that is left.
    pub(super) fn judge_check_points(&mut self) {
        let Some(test) = self.contradicted_by_check_points().filter(|_| self.verdict != Verdict::Mistake) else {
            return;
        };
        let times = test.statistic.sqrt();
        let sentence = format!("{}: {times:.0} times what the errors of the block explain", test.description);
        self.left.push(sentence);
        self.verdict = Verdict::Unexplained;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagnosis with tests of the plane and the dome of the check points.
    fn checked(verdict: &str, statistics: [f64; 2]) -> Diagnosis {
        let test = |against: &str, statistic: f64| {
            serde_json::json!({"against": against, "statistic": statistic, "p_value": 0.5, "family_p_value": 0.5,
                "decides": false, "description": against})
        };
        let tests = [test("check-plane", statistics[0]), test("check-dome", statistics[1])];
        let factors = serde_json::json!({"image": 1.0, "control": 1.0, "control_z": 1.0, "gnss": 1.0, "gnss_z": 1.0});
        let diagnosis = serde_json::json!({"format": 1, "verdict": verdict, "significance": 1e-3, "candidates": [],
            "recommended": [], "structure": tests, "left": [], "ledger": [], "outliers": 0, "sigma_factors": factors});
        serde_json::from_value(diagnosis).expect("a diagnosis")
    }

    #[test]
    fn no_block_is_adequate_that_its_check_points_contradict() {
        for verdict in ["adequate", "missing"] {
            let mut diagnosis = checked(verdict, [2.0, 400.0]);
            diagnosis.judge_check_points();
            assert_eq!(diagnosis.verdict, Verdict::Unexplained);
            assert_eq!(diagnosis.left, ["check-dome: 20 times what the errors of the block explain"]);
            assert!(diagnosis.check_points_alone_contradict());
        }
    }

    #[test]
    fn what_stated_precisions_are_off_by_is_no_contradiction() {
        let mut diagnosis = checked("adequate", [99.0, 50.0]);
        diagnosis.judge_check_points();
        assert_eq!((diagnosis.verdict, diagnosis.left.len()), (Verdict::Adequate, 0));
        let mut diagnosis = checked("mistake", [2.0, 400.0]);
        diagnosis.judge_check_points();
        assert_eq!((diagnosis.verdict, diagnosis.left.len()), (Verdict::Mistake, 0));
    }
}
