//! Edits of a block's files: a copy of the block with cells changed, everything else as it stands.

use super::error::{Error, Place};
use crate::block::edit::{Change, Edit, Rows};
use crate::camera::fraser;
use crate::files::OF_BLOCK;
use crate::files::toml_text::rewritten;
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];

/// Writes the block in `from` with some edits, in their order, into the folder `to`.
///
/// # Errors
/// A file that cannot be read or written; an edit of a column that is not there or of a cell that is no number.
pub fn edited(from: &Path, to: &Path, edits: &[Edit]) -> Result<(), Error> {
    for file in OF_BLOCK {
        let (source, target) = (from.join(file), to.join(file));
        if !source.is_file() {
            continue;
        }
        let own: Vec<&Edit> = edits.iter().filter(|edit| edit.file == file).collect();
        match file {
            _ if own.is_empty() => {
                fs::copy(&source, &target).map_err(|error| Error::Write { path: target, source: error })?;
            }
            "block.toml" => edit_cameras(&source, &target, &own)?,
            _ => {
                let mut table = Cells::read(&source, file)?;
                own.iter().try_for_each(|edit| table.apply(edit))?;
                table.write(&target)?;
            }
        }
    }
    Ok(())
}

/// A table as text.
struct Cells {
    file: String,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Cells {
    fn read(path: &Path, file: &str) -> Result<Self, Error> {
        let refuse = |error: csv::Error| {
            let line = error.position().map_or(1, csv::Position::line);
            Error::content(file, Place::Line(line), error.to_string())
        };
        let mut reader = csv::ReaderBuilder::new().from_path(path).map_err(refuse)?;
        let header = reader.headers().map_err(refuse)?.iter().map(str::to_owned).collect();
        let row =
            |record: csv::Result<csv::StringRecord>| Ok(record.map_err(refuse)?.iter().map(str::to_owned).collect());
        let rows = reader.into_records().map(row).collect::<Result<_, Error>>()?;
        Ok(Self { file: file.into(), header, rows })
    }

    fn write(&self, path: &Path) -> Result<(), Error> {
        let failed = |error: csv::Error| Error::Write { path: path.to_owned(), source: error.into() };
        let mut writer = csv::Writer::from_path(path).map_err(failed)?;
        writer.write_record(&self.header).map_err(failed)?;
        self.rows.iter().try_for_each(|row| writer.write_record(row)).map_err(failed)?;
        writer.flush().map_err(|source| Error::Write { path: path.to_owned(), source })
    }

    fn column(&self, name: &str) -> Result<usize, Error> {
        let missing = || Error::content(&*self.file, Place::Line(1), format!("column {name} is missing"));
        self.header.iter().position(|own| own == name).ok_or_else(missing)
    }

    fn columns(&self, names: &[String]) -> Result<Vec<usize>, Error> {
        names.iter().map(|name| self.column(name)).collect()
    }

    /// Rows that have the values asked for.
    fn chosen(&self, conditions: &[Rows]) -> Result<Vec<usize>, Error> {
        let mut chosen: Vec<usize> = (0..self.rows.len()).collect();
        for Rows { column, values } in conditions {
            let column = self.column(column)?;
            let wanted: std::collections::HashSet<&str> = values.iter().map(String::as_str).collect();
            chosen.retain(|row| wanted.contains(self.rows[*row][column].as_str()));
        }
        Ok(chosen)
    }

    /// A number; none in an empty cell.
    fn number(&self, row: usize, column: usize) -> Result<Option<f64>, Error> {
        let text = self.rows[row][column].trim();
        if text.is_empty() {
            return Ok(None);
        }
        let refuse = |_| {
            let problem = format!("column {}: {text:?} is no number", self.header[column]);
            // Behind the header, counted from one.
            Error::content(&*self.file, Place::Line(row as u64 + 2), problem)
        };
        text.parse().map(Some).map_err(refuse)
    }

    fn apply(&mut self, edit: &Edit) -> Result<(), Error> {
        let chosen = self.chosen(&edit.rows)?;
        match &edit.change {
            Change::Affine { column, factor, offset } => {
                let column = self.column(column)?;
                for row in chosen {
                    if let Some(number) = self.number(row, column)? {
                        self.rows[row][column] = format!("{:?}", factor * number + offset);
                    }
                }
            }
            Change::ExchangeColumns { columns: [a, b] } => {
                let (a, b) = (self.column(a)?, self.column(b)?);
                chosen.into_iter().for_each(|row| self.rows[row].swap(a, b));
            }
            Change::Clear { columns } => {
                let columns = self.columns(columns)?;
                for row in chosen {
                    columns.iter().for_each(|column| self.rows[row][*column].clear());
                }
            }
            Change::Shift { columns, by, within } => self.shift(&chosen, columns, *by, within)?,
            Change::ExchangeValues { column, values: [a, b] } => {
                let column = self.column(column)?;
                for row in chosen {
                    let cell = &mut self.rows[row][column];
                    let other = if cell == a { Some(b) } else { (cell == b).then_some(a) };
                    if let Some(other) = other {
                        cell.clone_from(other);
                    }
                }
            }
            Change::Set { column, value } => {
                let column = self.column(column)?;
                chosen.into_iter().for_each(|row| self.rows[row][column].clone_from(value));
            }
            Change::Turn { inverse, after, before } => {
                let columns = self.columns(&QUATERNION.map(String::from))?;
                let [after, before] = [after, before].map(|q| Quaternion::new(q[0], q[1], q[2], q[3]));
                for row in chosen {
                    let mut own = [0.0; 4];
                    for (value, column) in own.iter_mut().zip(&columns) {
                        *value = self.number(row, *column)?.unwrap_or(f64::NAN);
                    }
                    let own = UnitQuaternion::from_quaternion(Quaternion::new(own[0], own[1], own[2], own[3]));
                    let turned = after * if *inverse { own.inverse() } else { own }.into_inner() * before;
                    let turned = UnitQuaternion::from_quaternion(turned);
                    for (value, column) in [turned.w, turned.i, turned.j, turned.k].iter().zip(&columns) {
                        self.rows[row][*column] = format!("{value:?}");
                    }
                }
            }
            Change::Distort { interior } => {
                let (x, y) = (self.column("x")?, self.column("y")?);
                for row in chosen {
                    if let (Some(u), Some(v)) = (self.number(row, x)?, self.number(row, y)?) {
                        let [du, dv] = fraser::distort(interior, u, v);
                        self.rows[row][x] = format!("{du:?}");
                        self.rows[row][y] = format!("{dv:?}");
                    }
                }
            }
            Change::Copy { .. } => {
                return Err(Error::content(&*self.file, Place::File, "a camera is copied in block.toml".to_string()));
            }
            Change::Remove => {
                let mut keep = vec![true; self.rows.len()];
                chosen.into_iter().for_each(|row| keep[row] = false);
                let mut keep = keep.into_iter();
                self.rows.retain(|_| keep.next().unwrap_or(true));
            }
        }
        Ok(())
    }

    fn shift(&mut self, chosen: &[usize], columns: &[String], by: i64, within: &str) -> Result<(), Error> {
        let columns = self.columns(columns)?;
        let key = if within.is_empty() { None } else { Some(self.column(within)?) };
        let mut lists: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for row in chosen {
            lists.entry(key.map_or_else(String::new, |key| self.rows[*row][key].clone())).or_default().push(*row);
        }
        let before = self.rows.clone();
        for list in lists.values() {
            for (k, row) in list.iter().enumerate() {
                let from = usize::try_from(k as i64 - by).ok().and_then(|k| list.get(k));
                for column in &columns {
                    self.rows[*row][*column] = from.map_or_else(String::new, |from| before[*from][*column].clone());
                }
            }
        }
        Ok(())
    }
}

/// Edits of cameras.
fn edit_cameras(from: &Path, to: &Path, edits: &[&Edit]) -> Result<(), Error> {
    const FILE: &str = "block.toml";
    let refuse = |problem: String| Error::content(FILE, Place::File, problem);
    let text = super::read_text(from).map_err(|source| Error::Read { path: from.to_owned(), source })?;
    let mut block: toml::Table = text.parse().map_err(|error: toml::de::Error| refuse(error.to_string()))?;
    let cameras = block.get_mut("camera").and_then(toml::Value::as_array_mut);
    let mut copies = Vec::new();
    let cameras = cameras.into_iter().flatten().filter_map(toml::Value::as_table_mut);
    for camera in cameras {
        for edit in edits {
            let text = |column: &str| camera.get(column).map(|value| value.as_str().unwrap_or_default().to_owned());
            let is_chosen = |rows: &Rows| text(&rows.column).is_some_and(|own| rows.values.contains(&own));
            if edit.rows.iter().all(is_chosen) {
                copies.extend(edit_camera(camera, &edit.change).map_err(refuse)?);
            }
        }
    }
    if let Some(cameras) = block.get_mut("camera").and_then(toml::Value::as_array_mut) {
        cameras.extend(copies.into_iter().map(toml::Value::Table));
    }
    super::write_atomically(to, rewritten(&text, &block).as_bytes())
}

/// Edits one camera; the camera that is to be added, where the edit copies it.
fn edit_camera(camera: &mut toml::Table, change: &Change) -> Result<Option<toml::Table>, String> {
    match change {
        Change::Affine { column, factor, offset } => {
            let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|n| n as f64));
            if let Some(own) = camera.get(column).and_then(number) {
                camera.insert(column.clone(), toml::Value::Float(factor * own + offset));
            }
        }
        Change::ExchangeColumns { columns: [a, b] } => {
            if let (Some(first), Some(second)) = (camera.get(a).cloned(), camera.get(b).cloned()) {
                camera.insert(a.clone(), second);
                camera.insert(b.clone(), first);
            }
        }
        Change::Set { column, value } => {
            let whole = value.parse::<i64>().map(toml::Value::Integer);
            let number = whole.or_else(|_| value.parse::<f64>().map(toml::Value::Float));
            let number = number.map_err(|_| format!("{column}: {value:?} is no number"))?;
            camera.insert(column.clone(), number);
        }
        Change::Copy { id } => {
            let mut copy = camera.clone();
            copy.insert("id".into(), toml::Value::String(id.clone()));
            return Ok(Some(copy));
        }
        other => return Err(format!("{other:?} is no edit of a camera")),
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTROL: &str = "point,x,y,z,role\na,1,2,3,control\nb,4,5,,check\nc,7,8,9,control\n";

    fn after(edits: &[Edit]) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        fs::create_dir(&from).expect("a folder");
        fs::create_dir(&to).expect("a folder");
        fs::write(from.join("control.csv"), CONTROL).expect("a file");
        edited(&from, &to, edits).expect("a copy");
        fs::read_to_string(to.join("control.csv")).expect("a file")
    }

    fn edit(change: Change) -> Edit {
        Edit::all("control.csv", change)
    }

    #[test]
    fn cells_change_and_all_others_stay() {
        assert_eq!(after(&[]), CONTROL);
        let check = edit(Change::times("x", 2.0)).of("role", &["check".into()]);
        assert_eq!(after(&[check]), CONTROL.replace("b,4,", "b,8.0,"));
        assert_eq!(after(&[edit(Change::plus("z", -1.0))]), CONTROL.replace(",3,", ",2.0,").replace(",9,", ",8.0,"));
        let exchange = Change::ExchangeValues { column: "point".into(), values: ["a".into(), "c".into()] };
        assert_eq!(after(&[edit(exchange)]), CONTROL.replace("a,1", "x,1").replace("c,7", "a,7").replace("x,1", "c,1"));
        assert_eq!(after(&[edit(Change::Remove).of("point", &["b".into()])]), CONTROL.replace("b,4,5,,check\n", ""));
        let shift = Change::Shift { columns: vec!["x".into()], by: 1, within: "role".into() };
        assert_eq!(after(&[edit(shift)]), "point,x,y,z,role\na,,2,3,control\nb,,5,,check\nc,1,8,9,control\n");
        let columns = ["x".to_string(), "y".to_string()];
        let lines = "point,x,y,z,role\na,2,1,3,control\nb,5,4,,check\nc,8,7,9,control\n";
        assert_eq!(after(&[edit(Change::ExchangeColumns { columns })]), lines);
    }

    #[test]
    fn ideal_image_points_are_distorted() {
        // k1 r^2 is a hundredth, 100 px from the centre of distortion.
        let interior = [1000.0, 0.0, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let [from, to] = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
        fs::write(from.path().join("ties.csv"), "image,point,x,y\na,1,60,80\nb,1,,\n").expect("a file");
        edited(from.path(), to.path(), &[Edit::all("ties.csv", Change::Distort { interior })]).expect("a copy");
        let text = fs::read_to_string(to.path().join("ties.csv")).expect("a file");
        assert_eq!(text, "image,point,x,y\na,1,60.6,80.8\nb,1,,\n");
    }

    #[test]
    fn what_cannot_be_edited_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("control.csv"), CONTROL).expect("a file");
        let to = tempfile::tempdir().expect("a folder");
        let refused =
            |change: Change| edited(folder.path(), to.path(), &[edit(change)]).expect_err("refused").to_string();
        assert!(refused(Change::plus("height", 1.0)).contains("column height is missing"));
        assert!(refused(Change::plus("role", 1.0)).contains("is no number"));
    }

    #[test]
    fn images_get_a_camera_of_their_own() {
        let [from, to] = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
        let text = "format = 1 # of tests\n[[camera]]\nid = \"one\"\nf = 35.0 # mm?\n[sigma]\ntie_px = 1\n";
        fs::write(from.path().join("block.toml"), text).expect("a file");
        fs::write(from.path().join("images.csv"), "image,camera\na,one\nb,one\n").expect("a file");
        let copy = Edit::all("block.toml", Change::Copy { id: "two".into() }).of("id", &["one".into()]);
        let camera = Change::Set { column: "camera".into(), value: "two".into() };
        let own = Edit::all("images.csv", camera).of("image", &["b".into()]);
        edited(from.path(), to.path(), &[copy, own]).expect("a copy");
        let read = |file: &str| fs::read_to_string(to.path().join(file)).expect("a file");
        assert_eq!(read("block.toml"), format!("{text}\n[[camera]]\nf = 35.0\nid = \"two\"\n"));
        assert_eq!(read("images.csv"), "image,camera\na,one\nb,two\n");
    }

    #[test]
    fn a_camera_changes() {
        let [from, to] = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
        let text = "name = \"b\" # of tests\n[[camera]]\nid = \"one\"\nf = 35\n[[camera]]\nid = \"two\"\nf = 4000.0\n";
        fs::write(from.path().join("block.toml"), text).expect("a file");
        let edit = Edit::all("block.toml", Change::times("f", 100.0)).of("id", &["one".into()]);
        let width = Change::Set { column: "width_px".into(), value: "4000".into() };
        edited(from.path(), to.path(), &[edit, Edit::all("block.toml", width)]).expect("a copy");
        let text = fs::read_to_string(to.path().join("block.toml")).expect("a file");
        assert!(text.starts_with("name = \"b\" # of tests\n"), "comments stay: {text}");
        let block: toml::Table = text.parse().expect("TOML");
        assert_eq!(block["camera"][0]["f"].as_float(), Some(3500.0));
        assert_eq!(block["camera"][1]["f"].as_float(), Some(4000.0));
        assert_eq!(block["camera"][1]["width_px"].as_integer(), Some(4000));
    }
}
