//! How far COLMAP says that the points of a model are missed by their measurements.

/// Errors of points, as they are read.
#[derive(Debug, Default)]
pub(super) struct Reported {
    squares: f64,
    measurements: usize,
    /// Least and greatest error, px.
    range: Option<[f64; 2]>,
}

impl Reported {
    /// A point: `error` is the mean distance of its measurements, px. COLMAP writes -1 where it computed none.
    pub(super) fn add(&mut self, error: f64, measurements: usize) {
        if !(error.is_finite() && error >= 0.0) {
            return;
        }
        self.squares += error * error * measurements as f64;
        self.measurements += measurements;
        let [least, greatest] = self.range.unwrap_or([error; 2]);
        self.range = Some([least.min(error), greatest.max(error)]);
    }

    /// RMS over all measurements, px; `None` where none is reported, or the same for every point: programs that write
    /// such files without an adjustment put 0 or 1 there.
    pub(super) fn rms_px(&self) -> Option<f64> {
        let [least, greatest] = self.range?;
        (least < greatest && self.measurements > 0).then(|| (self.squares / self.measurements as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: &[(f64, usize)]) -> Option<f64> {
        let mut reported = Reported::default();
        points.iter().for_each(|(error, measurements)| reported.add(*error, *measurements));
        reported.rms_px()
    }

    #[test]
    fn every_measurement_counts_alike() {
        let found = of(&[(0.5, 9), (2.0, 1)]).expect("a value");
        assert!((found - (0.625_f64).sqrt()).abs() < 1e-12, "{found}");
        assert_eq!(of(&[(0.5, 2), (-1.0, 8), (f64::NAN, 3), (0.7, 2)]), of(&[(0.5, 2), (0.7, 2)]));
    }

    #[test]
    fn what_stands_for_no_value_is_none() {
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[(-1.0, 3), (-1.0, 4)]), None);
        assert_eq!(of(&[(0.0, 3), (0.0, 4)]), None);
        assert_eq!(of(&[(1.0, 3), (1.0, 4)]), None);
        assert_eq!(of(&[(0.5, 0), (0.7, 0)]), None);
    }
}
