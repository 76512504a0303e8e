//! Sparse columns: what one unit of each would move every measurement by, px.

/// Entry of a column in one measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Which column.
    pub column: u32,
    /// Displacement per unit, px.
    pub x: f64,
    /// Displacement per unit, px.
    pub y: f64,
}

/// Columns over the image measurements, in their order in the problem, and over single other residuals.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    /// Number of columns.
    pub count: usize,
    /// Residual (position in the problem's order) and its entries: column and standardised value.
    pub other_rows: Vec<(usize, Vec<(usize, f64)>)>,
    starts: Vec<usize>,
    entries: Vec<Entry>,
}

impl Columns {
    /// Columns whose entries in measurement `k` are what `fill` pushes for it.
    pub fn new(count: usize, measurements: usize, mut fill: impl FnMut(usize, &mut Vec<Entry>)) -> Self {
        let mut columns = Self { count, starts: vec![0], ..Self::default() };
        for k in 0..measurements {
            fill(k, &mut columns.entries);
            columns.starts.push(columns.entries.len());
        }
        columns
    }

    /// Columns over other residuals alone.
    pub fn on_rows(count: usize, measurements: usize, rows: Vec<(usize, Vec<(usize, f64)>)>) -> Self {
        Self { count, other_rows: rows, starts: vec![0; measurements + 1], entries: Vec::new() }
    }

    /// Entries in a measurement.
    pub fn of(&self, measurement: usize) -> &[Entry] {
        &self.entries[self.starts[measurement]..self.starts[measurement + 1]]
    }
}
