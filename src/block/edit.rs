//! How a mistake is undone: edits of a block's tables, as a person would make them in a spreadsheet.

use crate::camera::Interior;
use serde::{Deserialize, Serialize};

/// One edit of one file of a block.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Edit {
    /// `control.csv`, `images.csv`, `marks.csv`, `ties.csv`, `points.csv`, or `block.toml`, whose rows are its cameras.
    pub file: String,
    /// Rows that are edited; none: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<Rows>,
    /// What is done to them.
    #[serde(flatten)]
    pub change: Change,
}

/// Rows that have one of these values in a column. Several conditions must all hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rows {
    /// Column.
    pub column: String,
    /// Values.
    pub values: Vec<String>,
}

/// What is done to rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// A number becomes `factor * number + offset`; an empty cell stays empty.
    Affine {
        /// Column.
        column: String,
        /// Factor.
        factor: f64,
        /// Offset.
        offset: f64,
    },
    /// Two columns are exchanged.
    ExchangeColumns {
        /// Columns.
        columns: [String; 2],
    },
    /// Cells are emptied.
    Clear {
        /// Columns.
        columns: Vec<String>,
    },
    /// Rows take the cells of the row so many places before them, of the same value in a column; those that have none
    /// are emptied.
    Shift {
        /// Columns whose cells move.
        columns: Vec<String>,
        /// Places.
        by: i64,
        /// Rows of different values here are lists of their own; empty: one list.
        within: String,
    },
    /// Two values of a column are exchanged: each row with the one gets the other.
    ExchangeValues {
        /// Column.
        column: String,
        /// Values.
        values: [String; 2],
    },
    /// A cell is set.
    Set {
        /// Column.
        column: String,
        /// Value.
        value: String,
    },
    /// The quaternion in `qw, qx, qy, qz` is replaced: `after` (w, x, y, z) times it or its inverse, times `before`.
    Turn {
        /// Is the inverse taken first?
        inverse: bool,
        /// See above.
        after: [f64; 4],
        /// See above.
        before: [f64; 4],
    },
    /// Ideal image points in `x, y` become the points that the lens of a camera shows.
    Distort {
        /// Numbers of the camera, in the order of [`PARAMETERS`](crate::camera::PARAMETERS).
        interior: Interior,
    },
    /// A camera is listed once more under another id.
    Copy {
        /// Id of the copy.
        id: String,
    },
    /// Rows are left out.
    Remove,
}

impl Edit {
    /// An edit of all rows of a file.
    pub fn all(file: &str, change: Change) -> Self {
        Self { file: file.into(), rows: Vec::new(), change }
    }

    /// The same of the rows alone that have one of some values in a column.
    pub fn of(mut self, column: &str, values: &[String]) -> Self {
        self.rows.push(Rows { column: column.into(), values: values.to_vec() });
        self
    }

    /// Is a row edited? `cell`: what it has in a column; none where a row has no such column.
    pub fn concerns(&self, cell: impl Fn(&str) -> Option<String>) -> bool {
        self.rows.iter().all(|rows| cell(&rows.column).is_some_and(|own| rows.values.contains(&own)))
    }
}

impl Change {
    /// A column times a factor.
    pub fn times(column: &str, factor: f64) -> Self {
        Self::Affine { column: column.into(), factor, offset: 0.0 }
    }

    /// A column plus an offset.
    pub fn plus(column: &str, offset: f64) -> Self {
        Self::Affine { column: column.into(), factor: 1.0, offset }
    }
}
