//! A smaller block that says nearly the same: for answers while somebody waits.

use super::Scenario;
use super::strips::image_count;

/// Tie points of a draft at least. With a thousand, the sizes that a plan of the presets gives are 1 to 3 % larger in
/// the middle, of single effects up to a quarter.
const TIE_POINTS: usize = 1000;
/// Tie points of a draft for each image at least: with five images a point, each image measures some thirty-five.
const TIE_POINTS_PER_IMAGE: usize = 7;
/// Check points of a draft: their root mean square is then known to some per cent.
const CHECKS: usize = 100;

impl Scenario {
    /// The scenario with fewer tie points and check points, where it has more than a draft needs. Each tie point stands
    /// for several: its standard deviation is smaller by the square root of their number, so that all of them together
    /// carry the same information on cameras and effects. The precision of a single tie point is not that of the whole.
    pub fn draft(&self) -> Option<Self> {
        let (routes, rings) = (self.routes.iter().map(|own| own.exposures.len()), self.rings.iter().map(|r| r.images));
        let flown: f64 = self.flights.iter().map(|flight| image_count(self, flight)).sum();
        let images = flown as usize + routes.chain(rings).sum::<usize>();
        let (own, count) = (self.tie_count(), TIE_POINTS.max(TIE_POINTS_PER_IMAGE * images));
        if own <= count && self.surveyed.check.count <= CHECKS {
            return None;
        }
        let mut draft = self.clone();
        if own > count {
            draft.ties.per_m2 = None;
            draft.ties.count = Some(count);
            draft.sigma.tie_px *= (count as f64 / own as f64).sqrt();
        }
        draft.surveyed.check.count = self.surveyed.check.count.min(CHECKS);
        Some(draft)
    }
}

#[cfg(test)]
mod tests {
    use crate::scenario::Scenario;

    #[test]
    fn a_draft_carries_the_same_information_with_fewer_points() {
        let whole = Scenario::preset("dike", &[("points".into(), 14_000.0)].into()).unwrap();
        let draft = whole.draft().unwrap();
        let information = |own: &Scenario| own.tie_count() as f64 / own.sigma.tie_px.powi(2);
        assert_eq!((draft.tie_count(), draft.surveyed.check.count), (1000, 100));
        assert!((information(&draft) / information(&whole) - 1.0).abs() < 1e-12);
        assert_eq!(draft.surveyed.control, whole.surveyed.control);
        // A density follows its own rule.
        let long = Scenario::preset("corridor", &[("points_per_m2".into(), 5.0)].into()).unwrap();
        let draft = long.draft().unwrap();
        assert!((information(&draft) / information(&long) - 1.0).abs() < 1e-12 && draft.ties.per_m2.is_none());
        assert_eq!(draft.draft(), None);
    }
}
