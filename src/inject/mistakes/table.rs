//! A table of a block as text, as a spreadsheet shows it.

use anyhow::{Context, Result, bail, ensure};
use std::path::Path;

/// Lines before the first row, and lines are counted from one.
const FIRST_LINE: usize = 2;

/// A CSV file: header and rows of cells.
pub(super) struct Table {
    file: &'static str,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Cells that were changed, added or removed.
    changes: usize,
}

impl Table {
    /// Reads the file at `path`; `file` is its name in messages.
    pub(super) fn read(path: &Path, file: &'static str) -> Result<Self> {
        let open = crate::files::open(path).with_context(|| format!("{file}: cannot read"))?;
        let mut reader = csv::Reader::from_reader(open);
        let cells = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
        let header = cells(reader.headers().with_context(|| file.to_owned())?);
        let rows: csv::Result<Vec<Vec<String>>> =
            reader.records().map(|record| record.map(|record| cells(&record))).collect();
        Ok(Self { file, header, rows: rows.with_context(|| file.to_owned())?, changes: 0 })
    }

    /// Writes the table to `path`.
    pub(super) fn write(&self, path: &Path) -> Result<()> {
        let written = || -> csv::Result<()> {
            let mut writer = csv::Writer::from_path(path)?;
            writer.write_record(&self.header)?;
            self.rows.iter().try_for_each(|row| writer.write_record(row))?;
            Ok(writer.flush()?)
        };
        written().with_context(|| format!("{}: cannot write", self.file))
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Cells that were changed, added or removed since the table was read.
    pub(super) fn changes(&self) -> usize {
        self.changes
    }

    /// Place of a column, where there is one.
    pub(super) fn find_column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|own| own == name)
    }

    /// Place of a column.
    pub(super) fn column(&self, name: &str) -> Result<usize> {
        self.find_column(name).with_context(|| format!("{} has no column {name}", self.file))
    }

    /// Places of columns.
    pub(super) fn columns<const N: usize>(&self, names: [&str; N]) -> Result<[usize; N]> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = self.column(name)?;
        }
        Ok(places)
    }

    /// A cell.
    pub(super) fn cell(&self, row: usize, column: usize) -> &str {
        &self.rows[row][column]
    }

    /// Cells of a column, from top to bottom.
    pub(super) fn cells(&self, column: usize) -> impl Iterator<Item = &str> {
        self.rows.iter().map(move |row| row[column].as_str())
    }

    /// Rows that have this text in a column.
    pub(super) fn rows_with(&self, column: usize, text: &str) -> Vec<usize> {
        (0..self.rows.len()).filter(|row| self.rows[*row][column] == text).collect()
    }

    /// The row that has this text in a column.
    pub(super) fn row_with(&self, column: usize, text: &str) -> Result<usize> {
        let row = self.rows.iter().position(|row| row[column] == text);
        row.with_context(|| format!("{} has no {} `{text}`", self.file, self.header[column]))
    }

    /// Writes text into a cell.
    pub(super) fn set(&mut self, row: usize, column: usize, text: &str) {
        let cell = &mut self.rows[row][column];
        if cell != text {
            text.clone_into(cell);
            self.changes += 1;
        }
    }

    /// A number; `None` in an empty cell.
    pub(super) fn number(&self, row: usize, column: usize) -> Result<Option<f64>> {
        let text = self.rows[row][column].trim();
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse() {
            Ok(number) => Ok(Some(number)),
            Err(_) => bail!("{}: `{text}` is not a number", self.place(row, column)),
        }
    }

    /// Numbers; `None` where one of the cells is empty.
    pub(super) fn numbers<const N: usize>(&self, row: usize, columns: [usize; N]) -> Result<Option<[f64; N]>> {
        let mut numbers = [0.0; N];
        for (number, column) in numbers.iter_mut().zip(columns) {
            let Some(found) = self.number(row, column)? else { return Ok(None) };
            *number = found;
        }
        Ok(Some(numbers))
    }

    /// Writes numbers into cells, with the fewest digits that read back as the same number.
    pub(super) fn put<const N: usize>(&mut self, row: usize, columns: [usize; N], numbers: [f64; N]) -> Result<()> {
        for (column, number) in columns.into_iter().zip(numbers) {
            ensure!(number.is_finite(), "{}: the new number would be {number}", self.place(row, column));
            // 12 and 12.0 are the same number.
            if self.number(row, column)? != Some(number) {
                self.set(row, column, &format!("{number:?}"));
            }
        }
        Ok(())
    }

    /// Multiplies all numbers of a column.
    pub(super) fn multiply(&mut self, column: usize, factor: f64) -> Result<()> {
        for row in 0..self.rows.len() {
            if let Some(number) = self.number(row, column)? {
                self.put(row, [column], [factor * number])?;
            }
        }
        Ok(())
    }

    /// Appends copies of rows; `rename` makes the new text of a column from the old one.
    pub(super) fn append_copies(&mut self, rows: &[usize], column: usize, rename: impl Fn(&str) -> String) {
        for row in rows {
            let mut copy = self.rows[*row].clone();
            copy[column] = rename(&copy[column]);
            self.changes += copy.len();
            self.rows.push(copy);
        }
    }

    /// Removes rows.
    pub(super) fn remove(&mut self, is_removed: impl Fn(&Self, usize) -> bool) {
        let removed: Vec<bool> = (0..self.rows.len()).map(|row| is_removed(self, row)).collect();
        self.changes += self.header.len() * removed.iter().filter(|own| **own).count();
        let mut removed = removed.into_iter();
        self.rows.retain(|_| removed.next() != Some(true));
    }

    /// File, line and column, for messages.
    fn place(&self, row: usize, column: usize) -> String {
        format!("{}:{}: column {}", self.file, row + FIRST_LINE, self.header[column])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("control.csv");
        std::fs::write(&path, text).expect("a file");
        Table::read(&path, "control.csv").expect("a table")
    }

    #[test]
    fn only_new_numbers_count_as_changes() {
        let mut table = table("point,x\na,12\nb,\n");
        let x = table.column("x").expect("a column");
        table.put(0, [x], [12.0]).expect("a number");
        assert_eq!((table.cell(0, x), table.changes()), ("12", 0));
        table.multiply(x, 2.0).expect("numbers");
        assert_eq!((table.cell(0, x), table.cell(1, x), table.changes()), ("24.0", "", 1));
        table.append_copies(&[1], 0, |own| format!("{own}-copy"));
        table.remove(|table, row| table.cell(row, 0) == "a");
        assert_eq!(table.cells(0).collect::<Vec<_>>(), ["b", "b-copy"]);
        assert_eq!(table.changes(), 5);
    }

    #[test]
    fn messages_name_the_place() {
        let mut table = table("point,x\na,left\nb,1\n");
        let message = |result: Result<()>| result.expect_err("refused").to_string();
        assert_eq!(message(table.column("y").map(|_| ())), "control.csv has no column y");
        assert_eq!(message(table.number(0, 1).map(|_| ())), "control.csv:2: column x: `left` is not a number");
        assert_eq!(message(table.row_with(0, "c").map(|_| ())), "control.csv has no point `c`");
        let infinite = message(table.put(1, [1], [f64::INFINITY]));
        assert_eq!(infinite, "control.csv:3: column x: the new number would be inf");
    }
}
