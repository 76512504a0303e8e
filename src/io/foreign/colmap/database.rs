//! GNSS positions from the pose priors of a `database.db`.
//!
//! Columns are asked for by name: newer versions of COLMAP add some. Until 3.12 a prior belonged to an image
//! (`image_id`), later it belongs to the datum of a sensor (`corr_data_id`, of `corr_sensor_type` 0 for cameras), which
//! is an image too.

use super::super::super::error::{Error, shown};
use super::super::{Note, refuse};
use crate::block::{Block, Gnss};
use crate::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::Vector3;
use rusqlite::{Connection, OpenFlags, Row};
use std::collections::HashMap;
use std::path::Path;

/// `PosePrior::CoordinateSystem`.
const WGS84: i64 = 0;
/// See [`WGS84`].
const CARTESIAN: i64 = 1;

/// A prior that has a position.
struct Prior {
    image: String,
    position: [f64; 3],
    /// Row by row; what is not known is NaN.
    covariance: [f64; 9],
    system: i64,
}

/// Adds the priors of images of the block.
pub(super) fn add(block: &mut Block, path: &Path, notes: &mut Vec<Note>) -> Result<(), Error> {
    let priors =
        read(path).map_err(|error| refuse(path, format!("this cannot be read as a COLMAP database: {error}")))?;
    let named: HashMap<&str, &Prior> = priors.iter().map(|prior| (prior.image.as_str(), prior)).collect();
    let of_block: Vec<Option<&Prior>> =
        block.images.iter().map(|image| named.get(image.name.as_str()).copied()).collect();
    let Some(system) = of_block.iter().flatten().map(|prior| prior.system).next() else {
        notes.push(Note::fact(format!("{}: no position of an image of the model", path.display())));
        return Ok(());
    };
    if of_block.iter().flatten().any(|prior| prior.system != system) {
        return Err(refuse(path, "some positions are geographic and some are not; expected one coordinate system"));
    }
    let place = |prior: &Prior| {
        let [latitude, longitude, height] = prior.position;
        Geographic::checked(latitude, longitude, height)
            .map_err(|problem| refuse(path, format!("position of image {}: {problem}", shown(prior.image.as_bytes()))))
    };
    let mut places: Vec<Geographic> = Vec::new();
    let mut nowhere = 0;
    for prior in of_block.iter().flatten().filter(|_| system == WGS84) {
        let stated = place(prior)?;
        nowhere += usize::from(stated.is_none());
        places.extend(stated);
    }
    if nowhere > 0 {
        notes.push(Note::loss(format!("{nowhere} positions are 0, 0, which is none: left out")));
    }
    let local = if system == WGS84 { LocalSystem::about(&places) } else { None };
    for (image, prior) in block.images.iter_mut().zip(&of_block) {
        let Some(prior) = prior else { continue };
        let position = match local {
            None if system == WGS84 => continue,
            None => Vector3::from(prior.position),
            Some(local) => match place(prior)? {
                Some(place) => local.local(&place),
                None => continue,
            },
        };
        let [xx, _, _, _, yy, _, _, _, zz] = prior.covariance;
        let sigma = |variance: f64| (variance > 0.0 && variance.is_finite()).then(|| variance.sqrt());
        image.gnss = Some(Gnss { position, sigma_xy: sigma(0.5 * (xx + yy)), sigma_z: sigma(zz) });
    }
    if let Some(local) = local {
        block.crs = local.crs();
    }
    notes.extend(said(block, system));
    Ok(())
}

fn said(block: &Block, system: i64) -> Vec<Note> {
    let positions: Vec<&Gnss> = block.images.iter().filter_map(|image| image.gnss.as_ref()).collect();
    let unknown = positions.iter().filter(|gnss| gnss.sigma_xy.is_none() || gnss.sigma_z.is_none()).count();
    let system = match system {
        WGS84 => format!("geographic, taken to {}", block.crs),
        CARTESIAN => "Cartesian, as they stand".into(),
        _ => "of no stated coordinate system, taken as Cartesian".into(),
    };
    let mut notes = vec![Note::fact(format!("{} positions of the database: {system}", positions.len()))];
    if unknown > 0 {
        notes.push(Note::guess(format!(
            "{unknown} of them have no covariance: {} m in position and {} m in height are taken",
            block.sigma.gnss_xy_m, block.sigma.gnss_z_m
        )));
    }
    notes
}

fn read(path: &Path) -> rusqlite::Result<Vec<Prior>> {
    let database = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    let mut statement = database.prepare("SELECT name FROM pragma_table_info('pose_priors')")?;
    let columns: Vec<String> = statement.query_map([], |row| row.get(0))?.collect::<rusqlite::Result<_>>()?;
    if columns.is_empty() {
        // Also a file that is no database is found here.
        return Ok(Vec::new());
    }
    let has = |name: &str| columns.iter().any(|column| column == name);
    let belongs = match has("corr_data_id") {
        true => "corr_sensor_type = 0 AND corr_data_id",
        false => "pose_priors.image_id",
    };
    let covariance = if has("position_covariance") { "position_covariance" } else { "NULL" };
    let sql = format!(
        "SELECT images.name, position, {covariance}, coordinate_system FROM pose_priors JOIN images ON {belongs} = \
         images.image_id ORDER BY images.image_id"
    );
    let mut statement = database.prepare(&sql)?;
    let mut rows = statement.query([])?;
    let mut priors = Vec::new();
    while let Some(row) = rows.next()? {
        let Some(position) = numbers::<3>(row, 1)? else { continue };
        if position.iter().all(|coordinate| coordinate.is_finite()) {
            let covariance = numbers::<9>(row, 2)?.unwrap_or([f64::NAN; 9]);
            priors.push(Prior { image: row.get(0)?, position, covariance, system: row.get(3)? });
        }
    }
    Ok(priors)
}

/// Numbers of a blob; `None` where it is empty, or has another length.
fn numbers<const N: usize>(row: &Row<'_>, column: usize) -> rusqlite::Result<Option<[f64; N]>> {
    let blob: Option<Vec<u8>> = row.get(column)?;
    let Some(blob) = blob.filter(|blob| blob.len() == 8 * N) else { return Ok(None) };
    let mut numbers = [0.0; N];
    for (number, bytes) in numbers.iter_mut().zip(blob.chunks_exact(8)) {
        *number = f64::from_le_bytes(std::array::from_fn(|k| bytes[k]));
    }
    Ok(Some(numbers))
}
