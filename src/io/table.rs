//! CSV tables and JSON files as a program writes them: exact numbers, whole files.

use super::Error;
use super::atomic::AtomicFile;
use super::error::Place;
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;

/// A CSV table that is being written; it appears with [`TableWriter::finish`].
///
/// ```no_run
/// # use misclosure::io::{Error, table::TableWriter};
/// let mut table = TableWriter::create("points.csv".as_ref(), &["point", "x"])?;
/// table.text("p1").number(0.1).end_row()?;
/// table.finish()?;
/// # Ok::<(), Error>(())
/// ```
pub struct TableWriter {
    csv: csv::Writer<AtomicFile>,
    header: Vec<String>,
    cells: csv::ByteRecord,
    /// Text of one number.
    digits: Vec<u8>,
    /// Column of the current row that got a number that is not finite.
    not_finite: Option<usize>,
    rows: u64,
}

impl TableWriter {
    /// Starts the file `path` with the column names.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn create<S: AsRef<str>>(path: &Path, header: &[S]) -> Result<Self, Error> {
        let csv = csv::WriterBuilder::new().buffer_capacity(1 << 16).from_writer(AtomicFile::create(path)?);
        let header: Vec<String> = header.iter().map(|name| name.as_ref().to_owned()).collect();
        let cells = csv::ByteRecord::from(header.clone());
        let mut table = Self { csv, header, cells, digits: Vec::new(), not_finite: None, rows: 0 };
        table.write()?;
        Ok(table)
    }

    /// Adds a cell of text to the row.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.cells.push_field(text.as_bytes());
        self
    }

    /// Adds a number to the row: the shortest text that reads back as the same number.
    pub fn number(&mut self, number: f64) -> &mut Self {
        if !number.is_finite() {
            self.not_finite = self.not_finite.or(Some(self.cells.len()));
        }
        self.digits.clear();
        // Writing into memory does not fail.
        let _ = write!(self.digits, "{number:?}");
        self.cells.push_field(&self.digits);
        self
    }

    /// Adds a number, or an empty cell for what is not known.
    pub fn optional(&mut self, number: Option<f64>) -> &mut Self {
        match number {
            Some(number) => self.number(number),
            None => self.text(""),
        }
    }

    /// Ends the row.
    ///
    /// # Errors
    /// [`Error::Write`]; [`Error::Content`] when the row does not have as many cells as the header, or has NaN or
    /// infinity.
    pub fn end_row(&mut self) -> Result<(), Error> {
        self.rows += 1;
        let file = || self.csv.get_ref().path().display().to_string();
        if let Some(column) = self.not_finite {
            let name = self.header.get(column).cloned().unwrap_or_default();
            let found = String::from_utf8_lossy(self.cells.get(column).unwrap_or_default()).into_owned();
            let place = Place::Cell(self.rows + 1, name);
            return Err(Error::content(
                file(),
                place,
                format!("{found} cannot be written; it is not a number to read"),
            ));
        }
        if self.cells.len() != self.header.len() {
            let problem = format!("the row has {} cells, the header {}", self.cells.len(), self.header.len());
            return Err(Error::content(file(), Place::Line(self.rows + 1), problem));
        }
        self.write()
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn finish(self) -> Result<(), Error> {
        let path = self.csv.get_ref().path().to_owned();
        let file = self.csv.into_inner().map_err(|error| {
            let kind = error.error().kind();
            Error::Write { path, source: io::Error::new(kind, error.error().to_string()) }
        })?;
        file.commit()
    }

    fn write(&mut self) -> Result<(), Error> {
        let written = self.csv.write_byte_record(&self.cells);
        self.cells.clear();
        written.map_err(|error| Error::Write { path: self.csv.get_ref().path().to_owned(), source: error.into() })
    }
}

/// Writes `value` as an indented JSON file.
///
/// # Errors
/// [`Error::Write`], also for a value that JSON cannot hold.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Error::Write { path: path.to_owned(), source: io::Error::other(error) })?;
    text.push('\n');
    super::write_atomically(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(fill: impl FnOnce(&mut TableWriter) -> Result<(), Error>) -> Result<String, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = TableWriter::create(&path, &["name", "a", "b"]).unwrap();
        fill(&mut table).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))?;
        assert!(!path.exists());
        table.finish().unwrap();
        Ok(std::fs::read_to_string(path).unwrap())
    }

    #[test]
    fn numbers_are_short_and_exact_and_text_is_quoted() {
        let text = written(|table| table.text("a,\"b\"").number(0.1 + 0.2).optional(None).end_row()).unwrap();
        assert_eq!(text, "name,a,b\n\"a,\"\"b\"\"\",0.30000000000000004,\n");
    }

    #[test]
    fn what_could_not_be_read_again_is_not_written() {
        let nan = written(|table| table.text("p").number(1.0).number(f64::NAN).end_row());
        assert_eq!(nan.unwrap_err(), "t.csv:2: column b: NaN cannot be written; it is not a number to read");
        let short = written(|table| table.text("p").end_row());
        assert_eq!(short.unwrap_err(), "t.csv:2: the row has 1 cells, the header 3");
    }
}
