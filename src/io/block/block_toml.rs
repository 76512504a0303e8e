//! `block.toml`: name, coordinate system, a-priori precision, cameras.

use super::super::toml_table::{Source, Table, quoted};
use super::{BLOCK, EVERY_BLOCK, Error, Place};
use crate::block::{Block, Sigma};
use crate::camera::{Camera, F, PARAMETER_COUNT, PARAMETERS};
use crate::geodesy::crs::Crs;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;
use toml::de::DeTable;

/// The format that this program reads and writes.
const FORMAT: u32 = 1;
/// The one camera model.
const MODEL: &str = "fraser";

const KEYS: [&str; 6] = ["format", "name", "crs", "survey_crs", "sigma", "camera"];
const SIGMA_KEYS: [&str; 6] = ["tie_px", "mark_px", "control_xy_m", "control_z_m", "gnss_xy_m", "gnss_z_m"];
/// Before the twelve interior parameters.
const CAMERA_KEYS: [&str; 5] = ["id", "width_px", "height_px", "pixel_um", "model"];

/// What `block.toml` says.
pub(super) struct ReferenceFrame {
    pub name: String,
    pub crs: String,
    pub survey_crs: String,
    pub sigma: Sigma,
    pub cameras: Vec<Camera>,
}

pub(super) fn read(dir: &Path) -> Result<ReferenceFrame, Error> {
    let source = Source::read(&dir.join(BLOCK), BLOCK, EVERY_BLOCK)?;
    let root = source.parse()?;
    let whole = 0..0;
    let table = Table::new(&source, "block.toml", root.get_ref(), &KEYS)?;
    table.expect_format(FORMAT, &whole)?;
    let name = table.required("name", &whole, table.text("name")?)?.to_owned();
    let crs = table.required("crs", &whole, table.text("crs")?)?.to_owned();
    let survey_crs = table.text("survey_crs")?.unwrap_or_default().to_owned();
    if let (Some(value), Err(problem)) = (table.value("survey_crs"), Crs::parse(&survey_crs)) {
        return Err(table.refuse("survey_crs", value, &problem));
    }
    let sigma = match table.table("sigma")? {
        Some((entries, _)) => sigma(&Table::new(&source, "[sigma]", entries, &SIGMA_KEYS)?)?,
        None => Sigma::NOT_GIVEN,
    };
    let mut cameras: Vec<Camera> = Vec::new();
    for (entries, span) in table.tables("camera")? {
        let camera = camera(&source, entries, &span)?;
        if cameras.iter().any(|other| other.id == camera.id) {
            return Err(source.refuse(&span, format!("camera {:?} stands twice; ids are unique", camera.id)));
        }
        cameras.push(camera);
    }
    if cameras.is_empty() {
        return Err(source.refuse(&whole, "there is no [[camera]]; a block has at least one"));
    }
    Ok(ReferenceFrame { name, crs, survey_crs, sigma, cameras })
}

fn sigma(table: &Table<'_>) -> Result<Sigma, Error> {
    let or_not_given = |key: &str| Ok::<f64, Error>(table.positive(key)?.unwrap_or(f64::INFINITY));
    Ok(Sigma {
        tie_px: or_not_given("tie_px")?,
        mark_px: or_not_given("mark_px")?,
        control_xy_m: or_not_given("control_xy_m")?,
        control_z_m: or_not_given("control_z_m")?,
        gnss_xy_m: or_not_given("gnss_xy_m")?,
        gnss_z_m: or_not_given("gnss_z_m")?,
    })
}

fn camera(source: &Source, entries: &DeTable<'_>, span: &Range<usize>) -> Result<Camera, Error> {
    let known: Vec<&str> = CAMERA_KEYS.into_iter().chain(PARAMETERS).collect();
    let table = Table::new(source, "[[camera]]", entries, &known)?;
    let id = table.required("id", span, table.text("id")?)?;
    if let ("", Some(value)) = (id, table.value("id")) {
        return Err(table.refuse("id", value, "a name"));
    }
    let model = table.required("model", span, table.text("model")?)?;
    if let (true, Some(value)) = (model != MODEL, table.value("model")) {
        return Err(table.refuse("model", value, &format!("{MODEL:?}, the one there is")));
    }
    let mut interior = [0.0; PARAMETER_COUNT];
    interior[F] = table.required("f", span, table.positive("f")?)?;
    for (value, parameter) in interior.iter_mut().zip(PARAMETERS).skip(1) {
        *value = table.required(parameter, span, table.number(parameter)?)?;
    }
    Ok(Camera {
        id: id.to_owned(),
        width_px: table.required("width_px", span, table.count("width_px")?)?,
        height_px: table.required("height_px", span, table.count("height_px")?)?,
        pixel_um: table.positive("pixel_um")?,
        interior,
    })
}

pub(super) fn write(block: &Block, path: &Path) -> Result<(), Error> {
    let Sigma { tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m } = block.sigma;
    // Infinite means that the block gives none.
    let sigmas = [tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m].into_iter();
    let sigmas = sigmas.filter(|sigma| *sigma != f64::INFINITY);
    let cameras = block.cameras.iter().flat_map(|camera| camera.interior.into_iter().chain(camera.pixel_um));
    if let Some(number) = sigmas.chain(cameras).find(|number| !number.is_finite()) {
        let problem = format!("{number} cannot be written; it is not a number to read");
        return Err(Error::content(path.display().to_string(), Place::File, problem));
    }
    super::super::write_atomically(path, text(block).as_bytes())
}

fn text(block: &Block) -> String {
    let (name, crs) = (quoted(&block.name), quoted(&block.crs));
    let survey_crs = match block.survey_crs.as_str() {
        "" => String::new(),
        system => format!("survey_crs = {}\n", quoted(system)),
    };
    let mut text = format!("format = {FORMAT}\nname = {name}\ncrs = {crs}\n{survey_crs}\n[sigma]\n");
    let Sigma { tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m } = block.sigma;
    let sigmas = [tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m];
    for (key, sigma) in SIGMA_KEYS.into_iter().zip(sigmas) {
        if sigma.is_finite() {
            // Writing into a String does not fail.
            let _ = writeln!(text, "{key} = {sigma:?}");
        }
    }
    for camera in &block.cameras {
        let _ = writeln!(text, "\n[[camera]]\nid = {}", quoted(&camera.id));
        let _ = writeln!(text, "width_px = {}\nheight_px = {}", camera.width_px, camera.height_px);
        if let Some(pixel_um) = camera.pixel_um {
            let _ = writeln!(text, "pixel_um = {pixel_um:?}");
        }
        let _ = writeln!(text, "model = {}", quoted(MODEL));
        for (parameter, value) in PARAMETERS.into_iter().zip(camera.interior) {
            let _ = writeln!(text, "{parameter} = {value:?}");
        }
    }
    text
}
