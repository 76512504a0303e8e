//! What the search for outliers set aside, as a finding: a control point without its marks, an image without most of
//! its measurements.

use super::live::Changed;
use super::setup::Source;
use super::step::Step;
use crate::block::Measurement;
use crate::mistakes::Mistake;
use crate::problem::MeasurementKind;
use crate::run::set_aside::{MARK, TIE};
use crate::screening::of_outliers;
use crate::snooping::{Outliers, Rejected};
use std::collections::HashSet;

impl Step<'_> {
    /// What the search for outliers set aside, as a finding. It is one where nothing enters the model any more: before
    /// that, what the model lacks may be the reason. A person has to look: nothing of it is undone.
    pub(super) fn lost(&self, source: &Source, changed: &Changed, significance: f64) -> Vec<Mistake> {
        let outliers = self.outliers(source, changed);
        let fit = &changed.improvement.fit;
        let found = of_outliers(&source.block, &outliers, fit, &source.mistakes, significance);
        found.into_iter().map(|mistake| mistake.undone_by(Vec::new())).collect()
    }

    /// What the search set aside, and nobody by hand or before.
    fn outliers(&self, source: &Source, changed: &Changed) -> Outliers {
        let block = &source.block;
        let found = changed.set_aside.iter().filter(|row| !self.is_fixed(row));
        let found: HashSet<(&str, &str, &str)> =
            found.map(|row| (row.kind.as_str(), row.image.as_str(), row.point.as_str())).collect();
        if found.is_empty() {
            return Outliers::default();
        }
        let of = |kind: MeasurementKind, rows: &[Measurement]| -> Vec<Rejected> {
            let is_found = |row: &Measurement| {
                let image = block.images[row.image.index()].name.as_str();
                let (name, point) = match kind {
                    MeasurementKind::Tie => (TIE, block.tie_points[row.point.index()].name.as_str()),
                    MeasurementKind::Mark => (MARK, block.surveyed[row.point.index()].name.as_str()),
                };
                found.contains(&(name, image, point))
            };
            let rejected = |(measurement, row): (usize, &Measurement)| Rejected {
                kind,
                measurement,
                image: row.image,
                point: row.point,
                normalised: f64::INFINITY,
                round: 1,
            };
            rows.iter().enumerate().filter(|(_, row)| is_found(row)).map(rejected).collect()
        };
        let mut rejected = of(MeasurementKind::Tie, &block.ties);
        rejected.extend(of(MeasurementKind::Mark, &block.marks));
        Outliers { rejected, ..Outliers::default() }
    }
}
