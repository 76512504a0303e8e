//! Which columns of the border a row touches. Of a wide border (many effects at once) a row touches some, mostly
//! neighbours: sums over runs of neighbours are as fast as dense ones and skip the rest.

/// Ascending columns of the border, with their runs of neighbours. Values that belong to them are stored compactly, in
/// this order.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    index: Vec<u32>,
    runs: Vec<Run>,
}

/// Neighbouring columns.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    /// First column.
    pub column: usize,
    /// Its position in the compact values.
    pub position: usize,
    /// Number of columns.
    pub length: usize,
}

impl Columns {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.index.clear();
        self.runs.clear();
    }

    /// Appends a column, larger than all before.
    #[inline]
    pub fn push(&mut self, column: u32) {
        let position = self.index.len();
        self.index.push(column);
        let column = column as usize;
        match self.runs.last_mut() {
            Some(run) if run.column + run.length == column => run.length += 1,
            _ => self.runs.push(Run { column, position, length: 1 }),
        }
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// The columns.
    pub fn index(&self) -> &[u32] {
        &self.index
    }

    /// Their runs.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// `target[column] += a x + b y`; `x`, `y` compact.
    #[inline(always)]
    pub fn add_two(&self, target: &mut [f64], [a, b]: [f64; 2], x: &[f64], y: &[f64]) {
        for run in &self.runs {
            run.add_two(target, [a, b], x, y);
        }
    }

    /// `target[column] -= a . w`; `w` compact.
    #[inline(always)]
    pub fn take_three(&self, target: &mut [f64], a: [f64; 3], w: &[Vec<f64>; 3]) {
        for run in &self.runs {
            run.take_three(target, a, w);
        }
    }

    /// Upper triangle of `matrix += x x' + y y'`, `matrix` of `width` columns, row by row.
    #[inline(always)]
    pub fn add_outer(&self, matrix: &mut [f64], width: usize, x: &[f64], y: &[f64]) {
        for (r, run) in self.runs.iter().enumerate() {
            for k in 0..run.length {
                let line = &mut matrix[(run.column + k) * width..][..width];
                let own = [x[run.position + k], y[run.position + k]];
                run.from(k).add_two(line, own, x, y);
                for other in &self.runs[r + 1..] {
                    other.add_two(line, own, x, y);
                }
            }
        }
    }

    /// Upper triangle of `matrix -= a' w`, `matrix` of `width` columns, row by row; `a`, `w` compact.
    #[inline(always)]
    pub fn take_outer(&self, matrix: &mut [f64], width: usize, a: &[[f64; 3]], w: &[Vec<f64>; 3]) {
        for (r, run) in self.runs.iter().enumerate() {
            for k in 0..run.length {
                let line = &mut matrix[(run.column + k) * width..][..width];
                let own = a[run.position + k];
                run.from(k).take_three(line, own, w);
                for other in &self.runs[r + 1..] {
                    other.take_three(line, own, w);
                }
            }
        }
    }
}

impl Run {
    /// The run without its first `skipped` columns.
    #[inline(always)]
    fn from(self, skipped: usize) -> Self {
        Self { column: self.column + skipped, position: self.position + skipped, length: self.length - skipped }
    }

    #[inline(always)]
    fn add_two(self, target: &mut [f64], [a, b]: [f64; 2], x: &[f64], y: &[f64]) {
        let target = &mut target[self.column..][..self.length];
        let (x, y) = (&x[self.position..][..self.length], &y[self.position..][..self.length]);
        for ((t, x), y) in target.iter_mut().zip(x).zip(y) {
            *t += a * x + b * y;
        }
    }

    #[inline(always)]
    fn take_three(self, target: &mut [f64], a: [f64; 3], w: &[Vec<f64>; 3]) {
        let target = &mut target[self.column..][..self.length];
        let [w0, w1, w2] = w.each_ref().map(|w| &w[self.position..][..self.length]);
        for (((t, w0), w1), w2) in target.iter_mut().zip(w0).zip(w1).zip(w2) {
            *t -= a[0] * w0 + a[1] * w1 + a[2] * w2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_go_to_their_columns() {
        let mut columns = Columns::default();
        for column in [1, 2, 3, 6, 8, 9] {
            columns.push(column);
        }
        assert_eq!((columns.len(), columns.runs().len()), (6, 3));
        let x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let mut target = [0.0; 10];
        columns.add_two(&mut target, [10.0, 1.0], &x, &x);
        assert_eq!(target, [0.0, 11.0, 22.0, 33.0, 0.0, 0.0, 44.0, 0.0, 55.0, 66.0]);
        let w = [x.to_vec(), x.to_vec(), x.to_vec()];
        columns.take_three(&mut target, [1.0, 2.0, 8.0], &w);
        assert_eq!(target, [0.0; 10]);
    }

    #[test]
    fn outer_products_fill_the_upper_triangle() {
        let mut columns = Columns::default();
        for column in [0, 2, 3] {
            columns.push(column);
        }
        let (x, y) = ([1.0, 2.0, 3.0], [0.0, 1.0, 1.0]);
        let mut matrix = [0.0; 16];
        columns.add_outer(&mut matrix, 4, &x, &y);
        assert_eq!(matrix, [1.0, 0.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 7.0, 0.0, 0.0, 0.0, 10.0]);
        let own: Vec<[f64; 3]> = x.iter().zip(&y).map(|(x, y)| [*x, *y, 0.0]).collect();
        columns.take_outer(&mut matrix, 4, &own, &[x.to_vec(), y.to_vec(), vec![5.0; 3]]);
        assert_eq!(matrix, [0.0; 16]);
    }
}
