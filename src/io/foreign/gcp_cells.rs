//! Cells of a table of ground control: what separates them, what a decimal comma is, and what a header may say.
//!
//! The first row decides. A semicolon in it separates, and a comma in a number is then a decimal comma; else the comma
//! separates. A header may stand first: its words have to name the columns in the order in which they are read.

use super::super::error::shown;

/// How the table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cells {
    separator: char,
}

/// Words for the columns of points and of marks, in their order.
const POINTS: [&[&str]; 4] = [
    &["name", "point", "id", "label", "marker", "gcp"],
    &["x", "e", "east", "easting", "lon", "longitude"],
    &["y", "n", "north", "northing", "lat", "latitude"],
    &["z", "h", "height", "alt", "altitude", "elevation"],
];
/// See [`POINTS`].
const MARKS: [&[&str]; 4] =
    [&["image", "photo", "file", "filename"], POINTS[0], &["column", "col", "x", "u"], &["row", "y", "v"]];

impl Cells {
    /// Of the first row.
    pub(super) fn of(row: &str) -> Self {
        Self { separator: if row.contains(';') { ';' } else { ',' } }
    }

    /// The cells of a row.
    pub(super) fn split<'a>(&self, row: &'a str) -> Vec<&'a str> {
        row.split(self.separator).map(|cell| cell.trim().trim_matches('"')).collect()
    }

    /// A finite number.
    ///
    /// # Errors
    /// What was found instead.
    pub(super) fn number(&self, cell: &str) -> Result<f64, String> {
        let pointed = match cell.split_once(',').filter(|_| self.separator == ';') {
            Some((whole, part)) if !whole.contains('.') && !part.contains(['.', ',']) => format!("{whole}.{part}"),
            _ => cell.to_owned(),
        };
        let value = pointed.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| format!("expected a number, found {}", shown(cell.as_bytes())))
    }

    /// Is a row a header? Where none of its cells but the first is a number.
    ///
    /// # Errors
    /// Columns in another order than they are read in.
    pub(super) fn is_header(&self, cells: &[&str]) -> Result<bool, String> {
        let [_, rest @ ..] = cells else { return Ok(false) };
        if rest.len() < 3 || rest.iter().any(|cell| cell.is_empty() || self.number(cell).is_ok()) {
            return Ok(false);
        }
        let says = |columns: &[&[&str]; 4]| {
            // A unit may stand behind the name: `x [m]`, `x (m)`, `x_m`.
            let word = |cell: &str| cell.to_lowercase().split([' ', '[', '(', '_', '/']).next().map(str::to_owned);
            cells.iter().zip(columns).all(|(cell, words)| word(cell).is_some_and(|word| words.contains(&word.as_str())))
        };
        if says(&POINTS) || says(&MARKS) {
            return Ok(true);
        }
        let found = shown(cells.join(",").as_bytes());
        Err(format!("expected numbers or the header name,x,y,z or image,name,column,row, in this order, found {found}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_comma_stands_between_semicolons_alone() {
        let german = Cells::of("G1;1234,5;-2,25;0");
        let numbers: Vec<f64> =
            german.split("G1;1234,5;-2,25; 0")[1..].iter().map(|c| german.number(c).unwrap()).collect();
        assert_eq!(numbers, [1234.5, -2.25, 0.0]);
        assert!(german.number("1.234,5").is_err() && german.number("1,234,5").is_err() && german.number("").is_err());
        let plain = Cells::of("G1,1234.5,2,3");
        assert_eq!(plain.split("\"G1\", 1.5"), ["G1", "1.5"]);
        assert!(plain.number("1,5").is_err());
    }

    #[test]
    fn a_header_is_one_by_its_words_and_their_order() {
        let cells = Cells { separator: ',' };
        let header = |row: &str| cells.is_header(&cells.split(row));
        for row in ["name,x,y,z", "Point,Easting [m],Northing [m],Height (m),accuracy", "image,name,column,row"] {
            assert_eq!(header(row), Ok(true), "{row}");
        }
        for row in ["G1,1,2,3", "x,1,2,3", "G1,x,2,3", "G1,a"] {
            assert_eq!(header(row), Ok(false), "{row}");
        }
        for row in ["name,y,x,z", "a,b,c,d"] {
            assert!(header(row).unwrap_err().contains("in this order"), "{row}");
        }
    }
}
