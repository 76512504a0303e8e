//! A batch of points as rows, and in the orders in which they are summed.

use crate::adjust::native::for_null_model::{MAX_DIM, NONE};
use std::ops::Range;

/// What rows are grouped by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum By {
    /// Their image.
    Image,
    /// The cell of the sensor that they were measured in.
    Cell,
}

/// One row.
pub(super) struct Row {
    /// Rank of its image; [`NONE`] for surveyed coordinates.
    pub rank: u32,
    /// Cell of the sensor ([`super::cells::SensorCells`]); [`NONE`] where cells are not asked for, and for rows of
    /// coordinates.
    pub cell: u32,
    /// By the image's unknowns.
    pub image: [f64; MAX_DIM],
    /// By the point.
    pub point: [f64; 3],
    /// Misclosure, the point taken out.
    pub v: f64,
    /// Its entries of local columns, as they are.
    pub locals: Range<usize>,
    /// Point of the batch that it belongs to.
    pub group: u32,
}

/// Share of a local column that a point takes.
pub(super) struct Share {
    pub column: u32,
    /// `J' L`.
    pub moved: [f64; 3],
    /// `V^-1 J' L`.
    pub taken: [f64; 3],
    /// `L'v`, the point taken out.
    pub score: f64,
}

/// Rows of some points.
#[derive(Default)]
pub(super) struct Batch {
    pub rows: Vec<Row>,
    /// Dense columns, row by row, the points taken out: the base's border first.
    pub panel: Vec<f64>,
    /// Local columns: number and entry.
    pub locals: Vec<(u32, f64)>,
    /// Per point: its local columns.
    pub shares: Vec<Share>,
    /// Per point, or antenna: its shares.
    pub groups: Vec<Range<usize>>,
    /// Sum of squares of each dense column before anything is taken out.
    pub length: Vec<f64>,
    /// `D'v`, the points taken out.
    pub score: Vec<f64>,
    /// Sum over the points of the squared part that each has of it.
    pub squares: Vec<f64>,
    /// Numbers of the rows, those of an image side by side; those of none at the end.
    by_image: Vec<u32>,
    /// The same of a cell of the sensor.
    by_cell: Vec<u32>,
    /// Row and value of the entries of local columns, those of a column side by side.
    by_local: Vec<(u32, f64)>,
    /// Where each of these columns begins.
    local_start: Vec<u32>,
}

impl Batch {
    /// Empties it, to be filled with `rows` rows of `dense` columns.
    pub fn begin(&mut self, rows: usize, dense: usize) {
        let Self { rows: own, panel, locals, shares, groups, length, score, squares, .. } = self;
        own.clear();
        own.reserve(rows);
        panel.clear();
        panel.resize(rows * dense, 0.0);
        locals.clear();
        shares.clear();
        groups.clear();
        for sums in [length, score, squares] {
            sums.clear();
            sums.resize(dense, 0.0);
        }
    }

    /// Puts finished rows in order: by image, and by the `local` local columns.
    pub fn put_in_order(&mut self, local: usize) {
        let Self { rows, by_image, by_cell, by_local, local_start, locals, .. } = self;
        for order in [&mut *by_image, by_cell] {
            order.clear();
            order.extend(0..rows.len() as u32);
        }
        by_image.sort_by_key(|row| rows[*row as usize].rank);
        by_cell.sort_by_key(|row| rows[*row as usize].cell);
        // Counted first: where a column begins is where those before it end.
        local_start.clear();
        local_start.resize(local + 1, 0);
        for (column, _) in &*locals {
            local_start[*column as usize + 1] += 1;
        }
        for column in 0..local {
            local_start[column + 1] += local_start[column];
        }
        let mut next = local_start.clone();
        by_local.clear();
        by_local.resize(locals.len(), (0, 0.0));
        for (number, row) in rows.iter().enumerate() {
            for (column, value) in &locals[row.locals.clone()] {
                let place = &mut next[*column as usize];
                by_local[*place as usize] = (number as u32, *value);
                *place += 1;
            }
        }
    }

    /// Numbers of the rows of each image whose rank lies in a range.
    pub fn of_images(&self, ranks: Range<usize>) -> impl Iterator<Item = &[u32]> {
        self.of(By::Image, ranks)
    }

    /// Numbers of the rows of each image or cell whose number lies in a range.
    pub fn of(&self, by: By, numbers: Range<usize>) -> impl Iterator<Item = &[u32]> {
        let (order, number) = self.order(by);
        let first = order.partition_point(|row| (number(&self.rows[*row as usize]) as usize) < numbers.start);
        let end = order.partition_point(|row| (number(&self.rows[*row as usize]) as usize) < numbers.end);
        order[first..end].chunk_by(move |a, b| number(&self.rows[*a as usize]) == number(&self.rows[*b as usize]))
    }

    /// Image or cell of a row.
    pub fn group(&self, by: By, row: u32) -> u32 {
        self.order(by).1(&self.rows[row as usize])
    }

    /// Numbers of the rows of no image, or of no cell.
    pub fn of_none(&self, by: By) -> &[u32] {
        let (order, number) = self.order(by);
        &order[order.partition_point(|row| number(&self.rows[*row as usize]) != NONE)..]
    }

    fn order(&self, by: By) -> (&[u32], fn(&Row) -> u32) {
        match by {
            By::Image => (&self.by_image, |row| row.rank),
            By::Cell => (&self.by_cell, |row| row.cell),
        }
    }

    /// Row and value of the entries of a local column.
    pub fn of_local(&self, column: usize) -> &[(u32, f64)] {
        &self.by_local[self.local_start[column] as usize..self.local_start[column + 1] as usize]
    }
}
