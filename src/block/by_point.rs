//! The measurements of each point.

use super::{Measurement, PointId};

/// Numbers of the measurements of each point, in the order of the table they stand in.
pub struct ByPoint {
    /// Measurements of point `p`: `rows[starts[p]..starts[p + 1]]`.
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl ByPoint {
    /// Of a table of measurements of a number of points.
    pub fn new(measurements: &[Measurement], points: usize) -> Self {
        let mut starts = vec![0; points + 1];
        measurements.iter().for_each(|row| starts[row.point.index() + 1] += 1);
        (0..points).for_each(|p| starts[p + 1] += starts[p]);
        let mut next = starts.clone();
        let mut rows = vec![0; measurements.len()];
        for (m, row) in measurements.iter().enumerate() {
            let place = &mut next[row.point.index()];
            rows[*place as usize] = m as u32;
            *place += 1;
        }
        Self { starts, rows }
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of measurements of a point.
    pub fn count(&self, point: PointId) -> usize {
        (self.starts[point.index() + 1] - self.starts[point.index()]) as usize
    }

    /// Numbers of the measurements of a point, ascending.
    pub fn of(&self, point: PointId) -> impl ExactSizeIterator<Item = usize> + use<'_> {
        let range = self.starts[point.index()] as usize..self.starts[point.index() + 1] as usize;
        self.rows[range].iter().map(|row| *row as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::super::ImageId;
    use super::*;

    #[test]
    fn measurements_stand_at_their_point_in_the_order_of_the_table() {
        let row = |point| Measurement { image: ImageId(0), point: PointId(point), x: 0.0, y: 0.0, sigma: None };
        let by_point = ByPoint::new(&[row(3), row(0), row(3), row(1), row(3)], 5);
        let of = |p: usize| by_point.of(PointId::from(p)).collect::<Vec<_>>();
        assert_eq!(
            (0..by_point.points()).map(of).collect::<Vec<_>>(),
            [vec![1], vec![3], vec![], vec![0, 2, 4], vec![]]
        );
        assert_eq!(by_point.count(PointId(3)), 3);
    }
}
