//! A table in columns: written as CSV, and with the feature `parquet` as Parquet.

use crate::io::table::TableWriter;
use anyhow::Result;
use std::path::Path;

/// Cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Text; empty where there is none.
    Text(Vec<String>),
    /// Numbers; none where it is not known.
    Numbers(Vec<Option<f64>>),
    /// Yes or no.
    Flags(Vec<Option<bool>>),
}

/// Named columns of one length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Left to right.
    pub columns: Vec<(String, Cells)>,
}

impl Frame {
    /// With a column of text.
    pub fn text(mut self, name: &str, cells: impl Iterator<Item = String>) -> Self {
        self.columns.push((name.into(), Cells::Text(cells.collect())));
        self
    }

    /// With a column of numbers.
    pub fn numbers(mut self, name: &str, cells: impl Iterator<Item = Option<f64>>) -> Self {
        self.columns.push((name.into(), Cells::Numbers(cells.collect())));
        self
    }

    /// With a column of yes and no.
    pub fn flags(mut self, name: &str, cells: impl Iterator<Item = Option<bool>>) -> Self {
        self.columns.push((name.into(), Cells::Flags(cells.collect())));
        self
    }

    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, cells)| match cells {
            Cells::Text(cells) => cells.len(),
            Cells::Numbers(cells) => cells.len(),
            Cells::Flags(cells) => cells.len(),
        })
    }

    /// Writes it as CSV.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let header: Vec<&str> = self.columns.iter().map(|(name, _)| name.as_str()).collect();
        let mut table = TableWriter::create(path, &header)?;
        for row in 0..self.rows() {
            for (_, cells) in &self.columns {
                match cells {
                    Cells::Text(cells) => table.text(&cells[row]),
                    Cells::Numbers(cells) => table.optional(cells[row]),
                    Cells::Flags(cells) => table.text(cells[row].map_or("", |own| if own { "true" } else { "false" })),
                };
            }
            table.end_row()?;
        }
        Ok(table.finish()?)
    }

    /// Writes it as Parquet: text as UTF-8, numbers as doubles that may be null.
    ///
    /// # Errors
    /// A file that cannot be written.
    #[cfg(feature = "parquet")]
    pub fn write_parquet(&self, path: &Path) -> Result<()> {
        use parquet::basic::{LogicalType, Repetition, Type as Physical};
        use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType};
        use parquet::file::properties::WriterProperties;
        use parquet::file::writer::SerializedFileWriter;
        use parquet::schema::types::Type;
        use std::sync::Arc;

        let field = |(name, cells): &(String, Cells)| {
            let builder = |physical| Type::primitive_type_builder(name, physical);
            let built = match cells {
                Cells::Text(_) => builder(Physical::BYTE_ARRAY)
                    .with_repetition(Repetition::REQUIRED)
                    .with_logical_type(Some(LogicalType::String)),
                Cells::Numbers(_) => builder(Physical::DOUBLE).with_repetition(Repetition::OPTIONAL),
                Cells::Flags(_) => builder(Physical::BOOLEAN).with_repetition(Repetition::OPTIONAL),
            };
            built.build().map(Arc::new)
        };
        let fields = self.columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
        let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
        let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(WriterProperties::new()))?;
        let mut rows = writer.next_row_group()?;
        // 1 where there is a value.
        fn levels<T>(cells: &[Option<T>]) -> Vec<i16> {
            cells.iter().map(|cell| i16::from(cell.is_some())).collect()
        }
        for (_, cells) in &self.columns {
            let Some(mut column) = rows.next_column()? else { anyhow::bail!("a column has no place in the file") };
            match cells {
                Cells::Text(cells) => {
                    let cells: Vec<ByteArray> = cells.iter().map(|text| ByteArray::from(text.as_str())).collect();
                    column.typed::<ByteArrayType>().write_batch(&cells, None, None)?;
                }
                Cells::Numbers(cells) => {
                    let known: Vec<f64> = cells.iter().copied().flatten().collect();
                    column.typed::<DoubleType>().write_batch(&known, Some(&levels(cells)), None)?;
                }
                Cells::Flags(cells) => {
                    let known: Vec<bool> = cells.iter().copied().flatten().collect();
                    column.typed::<BoolType>().write_batch(&known, Some(&levels(cells)), None)?;
                }
            }
            column.close()?;
        }
        rows.close()?;
        Ok(crate::io::write_atomically(path, &writer.into_inner()?)?)
    }

    /// Refused: this build has no Parquet.
    ///
    /// # Errors
    /// Always.
    #[cfg(not(feature = "parquet"))]
    pub fn write_parquet(&self, _: &Path) -> Result<()> {
        anyhow::bail!("this build writes no Parquet; build it with Cargo's feature parquet")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame {
        Frame::default()
            .text("id", ["a", "b, c"].map(String::from).into_iter())
            .numbers("rms m", [Some(0.1), None].into_iter())
            .flags("right", [None, Some(true)].into_iter())
    }

    #[test]
    fn csv_has_every_cell() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("t.csv");
        frame().write_csv(&path).expect("a table");
        let text = std::fs::read_to_string(&path).expect("a table");
        assert_eq!(text, "id,rms m,right\na,0.1,\n\"b, c\",,true\n");
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn parquet_has_every_cell() {
        use parquet::file::reader::{FileReader, SerializedFileReader};
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("t.parquet");
        frame().write_parquet(&path).expect("a table");
        let file = std::fs::File::open(&path).expect("a table");
        let reader = SerializedFileReader::new(file).expect("Parquet");
        let rows: Vec<String> =
            reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row").to_string()).collect();
        assert_eq!(rows, ["{id: \"a\", rms m: 0.1, right: null}", "{id: \"b, c\", rms m: null, right: true}"]);
    }
}
