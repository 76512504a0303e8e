//! Means of residuals: over cells of the sensor and over images.

use std::collections::BTreeMap;

/// Cells along the longer side of a sensor: fine enough to show a field, coarse enough that most cells hold
/// measurements.
pub const CELLS: f64 = 20.0;

/// Mean residual of a cell of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellMean {
    /// Middle of the cell, px.
    pub centre: [f64; 2],
    /// Number of measurements.
    pub n: usize,
    /// Mean residual, px.
    pub mean: [f64; 2],
}

/// Means over square cells of a sensor of the size `sensor` (px), of pairs of place and residual (px). Cells without
/// measurements are left out; measurements beyond the sensor count for the cell at its edge.
pub fn cell_means(sensor: [f64; 2], residuals: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> Vec<CellMean> {
    let side = sensor[0].max(sensor[1]) / CELLS;
    let shape = sensor.map(|length| (length / side).round().max(1.0));
    let cell = [sensor[0] / shape[0], sensor[1] / shape[1]];
    let place = |k: usize, at: f64| (at / cell[k]).floor().clamp(0.0, shape[k] - 1.0) as usize;
    let mut sums: BTreeMap<[usize; 2], (usize, [f64; 2])> = BTreeMap::new();
    for (at, residual) in residuals {
        let (n, sum) = sums.entry([place(1, at[1]), place(0, at[0])]).or_default();
        *n += 1;
        *sum = [sum[0] + residual[0], sum[1] + residual[1]];
    }
    let mean = |([row, column], (n, sum)): ([usize; 2], (usize, [f64; 2]))| CellMean {
        centre: [(column as f64 + 0.5) * cell[0], (row as f64 + 0.5) * cell[1]],
        n,
        mean: sum.map(|sum| sum / n as f64),
    };
    sums.into_iter().map(mean).collect()
}

/// RMS per coordinate of the residuals of each key (an image's position, say); `None` for keys below `count` without
/// residuals.
pub fn rms_by(count: usize, residuals: impl Iterator<Item = (usize, [f64; 2])>) -> Vec<Option<f64>> {
    let mut squares = MeanSquares::new(count);
    residuals.for_each(|(key, residual)| squares.add(key, residual));
    squares.rms()
}

/// [`rms_by`] of residuals that come one by one.
pub struct MeanSquares(Vec<(usize, f64)>);

impl MeanSquares {
    /// Of a number of keys.
    pub fn new(count: usize) -> Self {
        Self(vec![(0, 0.0); count])
    }

    /// Takes a residual in; a key that is none counts for nothing.
    pub fn add(&mut self, key: usize, [rx, ry]: [f64; 2]) {
        if let Some((n, sum)) = self.0.get_mut(key) {
            *n += 2;
            *sum += rx * rx + ry * ry;
        }
    }

    /// RMS per coordinate of each key; `None` without residuals.
    pub fn rms(self) -> Vec<Option<f64>> {
        self.0.into_iter().map(|(n, sum)| (n > 0).then(|| (sum / n as f64).sqrt())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_average_what_lies_in_them() {
        let residuals = [([10.0, 10.0], [1.0, 2.0]), ([20.0, 40.0], [3.0, 4.0]), ([1999.0, 1000.0], [5.0, -1.0])];
        let cells = cell_means([2000.0, 1000.0], residuals.into_iter());
        assert_eq!(cells.len(), 2);
        assert_eq!(cells[0], CellMean { centre: [50.0, 50.0], n: 2, mean: [2.0, 3.0] });
        assert_eq!(cells[1], CellMean { centre: [1950.0, 950.0], n: 1, mean: [5.0, -1.0] });
    }

    #[test]
    fn rms_is_per_coordinate_and_none_without_residuals() {
        let rms = rms_by(3, [(0, [3.0, 4.0]), (2, [1.0, 1.0]), (2, [1.0, -1.0])].into_iter());
        assert_eq!(rms, [Some(12.5f64.sqrt()), None, Some(1.0)]);
    }
}
