//! The files of a block as text: tables, and `block.toml`.

use super::table::Table;
use crate::files::toml_text::rewritten;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Cameras and standard deviations.
const BLOCK: &str = "block.toml";
/// Keys of the interior orientation, in the order of CONVENTIONS.md.
pub(super) const INTERIOR: [&str; 12] = ["f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2"];
const MICROMETRES_PER_MM: f64 = 1000.0;

/// A camera as `block.toml` states it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Camera {
    /// Its id.
    pub(super) id: String,
    /// Width and height, px.
    pub(super) size: [f64; 2],
    /// Side of a pixel, mm.
    pub(super) pixel_mm: Option<f64>,
    /// In the order of [`INTERIOR`].
    pub(super) interior: [f64; 12],
}

impl Camera {
    /// Side of a pixel, mm: as given in micrometres, or as the camera states it.
    pub(super) fn pixel_mm(&self, given_um: Option<f64>) -> Result<f64> {
        let pixel = given_um.map(|um| um / MICROMETRES_PER_MM).or(self.pixel_mm);
        let pixel =
            pixel.with_context(|| format!("camera `{}` states no pixel_um; give the parameter `pixel_um`", self.id))?;
        ensure!(pixel > 0.0, "parameter `pixel_um` must be positive");
        Ok(pixel)
    }
}

/// The files of a block. A table is read when it is first asked for.
pub(super) struct Files {
    folder: PathBuf,
    tables: BTreeMap<&'static str, Table>,
    /// `block.toml` as it was read, and with the changes.
    text: String,
    block: toml::Table,
    /// Entries of `block.toml` that were changed.
    changes: usize,
}

impl Files {
    /// The files in a folder.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let text = crate::files::read_text(&folder.join(BLOCK)).with_context(|| format!("{BLOCK}: cannot read"))?;
        let block = text.parse::<toml::Table>().with_context(|| BLOCK.to_owned())?;
        Ok(Self { folder: folder.to_owned(), tables: BTreeMap::new(), text, block, changes: 0 })
    }

    /// Writes the files that were changed.
    pub(super) fn write(&self) -> Result<()> {
        for (file, table) in self.tables.iter().filter(|(_, table)| table.changes() > 0) {
            table.write(&self.folder.join(file))?;
        }
        if self.changes > 0 {
            let path = self.folder.join(BLOCK);
            std::fs::write(path, rewritten(&self.text, &self.block))
                .with_context(|| format!("{BLOCK}: cannot write"))?;
        }
        Ok(())
    }

    /// Cells and entries that were changed since the files were read.
    pub(super) fn changes(&self) -> usize {
        self.changes + self.tables.values().map(Table::changes).sum::<usize>()
    }

    /// Does the block have this file?
    pub(super) fn has(&self, file: &str) -> bool {
        self.folder.join(file).is_file()
    }

    /// A table.
    pub(super) fn table(&mut self, file: &'static str) -> Result<&mut Table> {
        if !self.tables.contains_key(file) {
            ensure!(self.has(file), "the block has no {file}");
            self.tables.insert(file, Table::read(&self.folder.join(file), file)?);
        }
        self.tables.get_mut(file).with_context(|| format!("the block has no {file}"))
    }

    /// Applies a function to each tie and mark table that the block has, of those asked for.
    pub(super) fn each_table(
        &mut self,
        files: &[&'static str],
        mut change: impl FnMut(&mut Table) -> Result<()>,
    ) -> Result<()> {
        // One table alone must be there; of several, those that are.
        let there: Vec<&'static str> =
            files.iter().copied().filter(|file| files.len() == 1 || self.has(file)).collect();
        there.into_iter().try_for_each(|file| change(self.table(file)?))
    }

    /// The cameras.
    pub(super) fn cameras(&self) -> Result<Vec<Camera>> {
        let tables = self.block.get("camera").and_then(toml::Value::as_array).into_iter().flatten();
        tables.filter_map(toml::Value::as_table).map(camera).collect()
    }

    /// The camera of each image, by the image's name.
    pub(super) fn camera_by_image(&mut self) -> Result<BTreeMap<String, Camera>> {
        let cameras = self.cameras()?;
        let table = self.table("images.csv")?;
        let [image, own] = table.columns(["image", "camera"])?;
        let of = |row: usize| {
            let id = table.cell(row, own);
            let camera = cameras.iter().find(|camera| camera.id == id);
            let camera = camera.with_context(|| format!("{BLOCK} has no camera `{id}`"))?;
            Ok((table.cell(row, image).to_owned(), camera.clone()))
        };
        (0..table.len()).map(of).collect()
    }

    /// Changes entries of the camera `id`, or of every camera where it is empty: `change` gives keys and new numbers.
    pub(super) fn change_cameras(
        &mut self,
        id: &str,
        change: impl Fn(&Camera) -> Result<Vec<(&'static str, f64)>>,
    ) -> Result<()> {
        let cameras = self.cameras()?;
        ensure!(id.is_empty() || cameras.iter().any(|own| own.id == id), "{BLOCK} has no camera `{id}`");
        let tables = self.block.get_mut("camera").and_then(toml::Value::as_array_mut).into_iter().flatten();
        for (table, own) in tables.filter_map(toml::Value::as_table_mut).zip(&cameras) {
            if !id.is_empty() && own.id != id {
                continue;
            }
            for (key, number) in change(own)? {
                self.changes += usize::from(put(table, key, number)?);
            }
        }
        Ok(())
    }

    /// Multiplies standard deviations of the block, where it states them.
    pub(super) fn multiply_sigmas(&mut self, keys: &[&'static str], factor: f64) -> Result<()> {
        let Some(table) = self.block.get_mut("sigma").and_then(toml::Value::as_table_mut) else { return Ok(()) };
        for key in keys {
            if let Some(own) = table.get(*key).and_then(number) {
                self.changes += usize::from(put(table, key, factor * own)?);
            }
        }
        Ok(())
    }
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// Sets an entry; a whole number stays one. Was it another number before?
fn put(table: &mut toml::Table, key: &str, new: f64) -> Result<bool> {
    ensure!(new.is_finite(), "{BLOCK}: `{key}` would be {new}");
    let old = table.get(key);
    if old.and_then(number) == Some(new) {
        return Ok(false);
    }
    let is_whole = old.is_some_and(toml::Value::is_integer) && new.fract() == 0.0;
    let value = if is_whole { toml::Value::Integer(new as i64) } else { toml::Value::Float(new) };
    table.insert(key.to_owned(), value);
    Ok(true)
}

fn camera(table: &toml::Table) -> Result<Camera> {
    let id = table.get("id").and_then(toml::Value::as_str).unwrap_or_default().to_owned();
    let required = |key: &str| {
        table.get(key).and_then(number).with_context(|| format!("{BLOCK}: camera `{id}` has no number `{key}`"))
    };
    let mut interior = [0.0; 12];
    for (value, key) in interior.iter_mut().zip(INTERIOR) {
        *value = required(key)?;
    }
    let size = [required("width_px")?, required("height_px")?];
    let pixel_mm = table.get("pixel_um").and_then(number).map(|um| um / MICROMETRES_PER_MM);
    Ok(Camera { size, pixel_mm, interior, id })
}
