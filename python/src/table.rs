//! Rows as the bytes of a numpy structured array: packed, little-endian, texts in UTF-32. Python views them without
//! another copy.

use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// How a value of a column is found by its row.
pub enum Column<'a> {
    /// A number; NaN where there is none.
    Number(Box<dyn Fn(usize) -> f64 + 'a>),
    /// A position in another table, or a count.
    Index(Box<dyn Fn(usize) -> u32 + 'a>),
    /// A text.
    Text(Box<dyn Fn(usize) -> &'a str + 'a>),
}

/// A table.
pub struct Table<'a> {
    rows: usize,
    columns: Vec<(String, Column<'a>)>,
}

/// Names and numpy formats of the columns, and the rows.
pub type Packed<'py> = (Vec<(String, String)>, Bound<'py, PyBytes>);

/// A value that may be unknown, for a column.
pub fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

impl<'a> Table<'a> {
    /// Without columns yet.
    pub fn new(rows: usize) -> Self {
        Self { rows, columns: Vec::new() }
    }

    /// With a column of numbers.
    pub fn number(mut self, name: impl Into<String>, value: impl Fn(usize) -> f64 + 'a) -> Self {
        self.columns.push((name.into(), Column::Number(Box::new(value))));
        self
    }

    /// With three columns of numbers, the coordinates of a place.
    pub fn place(self, names: [&str; 3], value: impl Fn(usize) -> [f64; 3] + Clone + 'a) -> Self {
        (0..3).fold(self, |table, k| {
            let value = value.clone();
            table.number(names[k], move |row| value(row)[k])
        })
    }

    /// With a column of positions.
    pub fn index(mut self, name: &str, value: impl Fn(usize) -> u32 + 'a) -> Self {
        self.columns.push((name.into(), Column::Index(Box::new(value))));
        self
    }

    /// With a column of texts.
    pub fn text(mut self, name: &str, value: impl Fn(usize) -> &'a str + 'a) -> Self {
        self.columns.push((name.into(), Column::Text(Box::new(value))));
        self
    }

    /// The bytes.
    pub fn packed<'py>(&self, py: Python<'py>) -> PyResult<Packed<'py>> {
        let widths: Vec<usize> = self.columns.iter().map(|(_, column)| self.width(column)).collect();
        let format = |column: &Column<'_>, width: usize| match column {
            Column::Number(_) => "<f8".to_owned(),
            Column::Index(_) => "<u4".to_owned(),
            Column::Text(_) => format!("<U{}", width / 4),
        };
        let kinds = self.columns.iter().zip(&widths).map(|((name, own), width)| (name.clone(), format(own, *width)));
        let kinds = kinds.collect();
        let row_bytes: usize = widths.iter().sum();
        let bytes = PyBytes::new_with(py, row_bytes * self.rows, |bytes| {
            for (row, bytes) in bytes.chunks_exact_mut(row_bytes.max(1)).enumerate() {
                let mut rest = bytes;
                for ((_, column), width) in self.columns.iter().zip(&widths) {
                    let (cell, behind) = rest.split_at_mut(*width);
                    put(column, row, cell);
                    rest = behind;
                }
            }
            Ok(())
        })?;
        Ok((kinds, bytes))
    }

    /// Bytes of a cell of the column.
    fn width(&self, column: &Column<'a>) -> usize {
        match column {
            Column::Number(_) => 8,
            Column::Index(_) => 4,
            Column::Text(text) => 4 * (0..self.rows).map(|row| text(row).chars().count()).max().unwrap_or(1).max(1),
        }
    }
}

fn put(column: &Column<'_>, row: usize, cell: &mut [u8]) {
    match column {
        Column::Number(value) => cell.copy_from_slice(&value(row).to_le_bytes()),
        Column::Index(value) => cell.copy_from_slice(&value(row).to_le_bytes()),
        Column::Text(text) => {
            for (cell, c) in cell.chunks_exact_mut(4).zip(text(row).chars()) {
                cell.copy_from_slice(&u32::from(c).to_le_bytes());
            }
        }
    }
}
