//! A CSV table that is being read, row by row, as bytes: cells become numbers and names without a text of their own.

use super::error::{Error, Place, listed, shown};
use super::names::Names;
use nalgebra::Vector3;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Buffer of the reader: large files are read in few system calls.
const BUFFER_BYTES: usize = 1 << 18;

/// Largest coordinate, m, or component of a velocity, m/s: far beyond any survey, and squares and sums of it are still
/// finite.
const LARGEST: f64 = 1e12;

/// An open table, standing on a row.
pub(super) struct Table {
    file: &'static str,
    path: PathBuf,
    bytes: u64,
    reader: csv::Reader<File>,
    header: Vec<String>,
    record: csv::ByteRecord,
    /// Rows read, the header not counted.
    rows: usize,
}

impl Table {
    /// Opens a table of the folder and reads its header; `None` when there is no such file.
    pub(super) fn open(folder: &Path, file: &'static str) -> Result<Option<Self>, Error> {
        let path = folder.join(file);
        let refuse = |problem: String| Error::content(file, Place::Line(1), problem);
        let opened = match super::open(&path) {
            Ok(opened) => opened,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(Error::Read { path, source }),
        };
        let bytes = opened.metadata().map_or(0, |metadata| metadata.len());
        let mut reader = reader(opened);
        let mut record = csv::ByteRecord::new();
        reader.read_byte_record(&mut record).map_err(|error| read_error(&path, error))?;
        let mut header: Vec<String> = Vec::with_capacity(record.len());
        let mut distinct = Names::default();
        for cell in &record {
            let name = std::str::from_utf8(cell)
                .map_err(|_| refuse(format!("column name {} is not UTF-8; save the file as UTF-8", shown(cell))))?;
            if !distinct.insert(cell).1 {
                return Err(refuse(format!("column {} stands twice; keep one", shown(cell))));
            }
            header.push(name.to_owned());
        }
        Ok(Some(Self { file, path, bytes, reader, header, record, rows: 0 }))
    }

    /// Names of the columns, in the file's order.
    pub(super) fn header(&self) -> &[String] {
        &self.header
    }

    /// A column that the table may have.
    pub(super) fn optional_column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|other| other == name)
    }

    /// A column that the table must have.
    pub(super) fn column(&self, name: &str) -> Result<usize, Error> {
        self.optional_column(name).ok_or_else(|| {
            let header = if self.header.is_empty() {
                "the file is empty".to_owned()
            } else {
                format!("the header has {}", listed(&self.header))
            };
            Error::content(self.file, Place::Line(1), format!("column {name} is missing; {header}"))
        })
    }

    /// Columns that the table must have.
    pub(super) fn columns<const N: usize>(&self, names: [&str; N]) -> Result<[usize; N], Error> {
        let mut columns = [0; N];
        for (column, name) in columns.iter_mut().zip(names) {
            *column = self.column(name)?;
        }
        Ok(columns)
    }

    /// Three columns that the table has together or not at all.
    pub(super) fn optional_columns(&self, names: [&str; 3]) -> Result<Option<[usize; 3]>, Error> {
        if names.iter().all(|name| self.optional_column(name).is_none()) {
            return Ok(None);
        }
        for name in names {
            if self.optional_column(name).is_none() {
                let problem = format!("column {name} is missing; {} come together or not at all", names.join(", "));
                return Err(Error::content(self.file, Place::Line(1), problem));
            }
        }
        self.columns(names).map(Some)
    }

    /// Goes to the next row; false at the end.
    pub(super) fn next(&mut self) -> Result<bool, Error> {
        if !self.reader.read_byte_record(&mut self.record).map_err(|error| read_error(&self.path, error))? {
            return Ok(false);
        }
        self.rows += 1;
        if self.record.len() != self.header.len() {
            let (found, expected) = (self.record.len(), self.header.len());
            let has_line_end = self.record.iter().any(|cell| cell.contains(&b'\n'));
            let hint = if has_line_end { "; is a quote not closed?" } else { "" };
            return Err(self.refuse_row(format!("number of cells {found}, expected {expected} as in the header{hint}")));
        }
        Ok(true)
    }

    /// Position of the current row, from 0.
    pub(super) fn row(&self) -> usize {
        self.rows.saturating_sub(1)
    }

    /// Rows that are likely still to come, from the length of the rows so far.
    pub(super) fn expected_rows(&self) -> usize {
        let read = self.reader.position().byte().max(1);
        let left = self.bytes.saturating_sub(read);
        (self.rows as f64 * left as f64 / read as f64) as usize
    }

    /// The bytes of a cell.
    pub(super) fn cell(&self, column: usize) -> &[u8] {
        &self.record[column]
    }

    /// A name: not empty.
    pub(super) fn name(&self, column: usize) -> Result<&[u8], Error> {
        let cell = self.cell(column);
        if cell.is_empty() { Err(self.refuse(column, "expected a name, found an empty cell")) } else { Ok(cell) }
    }

    /// The text of a cell.
    pub(super) fn text(&self, column: usize) -> Result<&str, Error> {
        let cell = self.cell(column);
        std::str::from_utf8(cell)
            .map_err(|_| self.refuse(column, format!("{} is not UTF-8; save the file as UTF-8", shown(cell))))
    }

    /// A finite number.
    pub(super) fn number(&self, column: usize) -> Result<f64, Error> {
        let parsed = std::str::from_utf8(self.cell(column)).ok().and_then(|text| text.parse::<f64>().ok());
        match parsed {
            Some(number) if number.is_finite() => Ok(number),
            _ => Err(self.refuse(column, format!("expected a finite number, found {}", self.found(column)))),
        }
    }

    /// A finite number, or `None` for an empty cell or an absent column.
    pub(super) fn optional_number(&self, column: Option<usize>) -> Result<Option<f64>, Error> {
        match column {
            Some(column) if !self.cell(column).is_empty() => self.number(column).map(Some),
            _ => Ok(None),
        }
    }

    /// A number above zero, or `None` for an empty cell or an absent column.
    pub(super) fn optional_positive(&self, column: Option<usize>) -> Result<Option<f64>, Error> {
        let number = self.optional_number(column)?;
        match (number, column) {
            (Some(number), Some(column)) if number <= 0.0 => {
                Err(self.refuse(column, format!("expected a number above zero, found {}", self.found(column))))
            }
            _ => Ok(number),
        }
    }

    /// Three finite numbers of a size that there is in object space.
    pub(super) fn vector(&self, columns: [usize; 3]) -> Result<Vector3<f64>, Error> {
        let component = |column: usize| match self.number(column)? {
            value if value.abs() > LARGEST => {
                let problem = format!("{} is no coordinate; expected at most {LARGEST:e} m", self.found(column));
                Err(self.refuse(column, problem))
            }
            value => Ok(value),
        };
        Ok(Vector3::new(component(columns[0])?, component(columns[1])?, component(columns[2])?))
    }

    /// Three finite numbers, or `None` when all three cells are empty.
    pub(super) fn optional_vector(&self, columns: Option<[usize; 3]>) -> Result<Option<Vector3<f64>>, Error> {
        let Some(columns) = columns else { return Ok(None) };
        if columns.iter().all(|column| self.cell(*column).is_empty()) {
            return Ok(None);
        }
        for column in columns {
            if self.cell(column).is_empty() {
                let names = columns.map(|column| self.header[column].as_str()).join(", ");
                return Err(self.refuse(column, format!("the cell is empty; {names} are given together or not at all")));
            }
        }
        self.vector(columns).map(Some)
    }

    /// The cell's content for a message.
    pub(super) fn found(&self, column: usize) -> String {
        let cell = self.cell(column);
        if cell.is_empty() { "an empty cell".to_owned() } else { shown(cell) }
    }

    /// The current row is wrong in a column.
    pub(super) fn refuse(&self, column: usize, problem: impl Into<String>) -> Error {
        Error::content(self.file, Place::Cell(self.line(self.row()), self.header[column].clone()), problem)
    }

    /// The current row is wrong.
    pub(super) fn refuse_row(&self, problem: impl Into<String>) -> Error {
        self.refuse_row_at(self.row(), problem)
    }

    /// A row that was read before is wrong.
    pub(super) fn refuse_row_at(&self, row: usize, problem: impl Into<String>) -> Error {
        Error::content(self.file, Place::Line(self.line(row)), problem)
    }

    /// Line of a row. Counted again from the file, and only for a message: quoted cells may hold line ends, blank lines
    /// are skipped, and line ends may be LF or CRLF, so keeping lines would cost memory and time in files without a
    /// fault.
    pub(super) fn line(&self, row: usize) -> u64 {
        line_of(&self.path, row).unwrap_or(row as u64 + 2)
    }
}

fn reader<R: Read>(source: R) -> csv::Reader<R> {
    // Cells are counted here, for a message that says what to do.
    csv::ReaderBuilder::new().has_headers(false).flexible(true).buffer_capacity(BUFFER_BYTES).from_reader(source)
}

fn read_error(path: &Path, error: csv::Error) -> Error {
    let source = match error.into_kind() {
        csv::ErrorKind::Io(source) => source,
        other => std::io::Error::other(format!("{other:?}")),
    };
    Error::Read { path: path.to_owned(), source }
}

/// Line of a row of a file; `None` when the file cannot be read any more.
fn line_of(path: &Path, row: usize) -> Option<u64> {
    let mut reader = reader(super::open(path).ok()?);
    let mut record = csv::ByteRecord::new();
    // The header is a record too.
    for _ in 0..row + 2 {
        reader.read_byte_record(&mut record).ok()?;
    }
    let start = record.position()?.byte();
    let mut before = BufReader::new(super::open(path).ok()?);
    let mut line = 1;
    let mut position = 0;
    loop {
        let chunk = before.fill_buf().ok()?;
        if chunk.is_empty() {
            return Some(line);
        }
        for byte in chunk {
            // A record starts at the line end of the one before and at the blank lines in between.
            if position >= start && *byte != b'\n' && *byte != b'\r' {
                return Some(line);
            }
            line += u64::from(*byte == b'\n');
            position += 1;
        }
        let length = chunk.len();
        before.consume(length);
    }
}
