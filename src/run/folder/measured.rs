//! Rows of what was measured: residuals, their means over the sensor, GNSS positions.

use super::FINAL;
use super::rows::{GnssRow, ResidualLine, SensorRow};
use crate::block::Block;
use crate::run::{GnssResidual, ResidualKind, ResidualRow, cell_means};

/// Mean tie residuals over the sensor, without tests.
pub(super) fn sensor_means<'a>(block: &'a Block, rows: &'a [ResidualRow]) -> impl Iterator<Item = SensorRow> + 'a {
    block.cameras.iter().enumerate().flat_map(move |(c, camera)| {
        let size = [f64::from(camera.width_px), f64::from(camera.height_px)];
        let of_camera = move |row: &&ResidualRow| {
            row.kind == ResidualKind::Tie && block.images[row.image.index()].camera.index() == c
        };
        let cells = cell_means(size, rows.iter().filter(of_camera).map(|row| (row.observed, row.residual)));
        cells.into_iter().map(move |cell| SensorRow {
            stage: FINAL.into(),
            camera: camera.id.clone(),
            width_px: size[0],
            height_px: size[1],
            x: cell.centre[0],
            y: cell.centre[1],
            n: cell.n,
            dx: cell.mean[0],
            dy: cell.mean[1],
            p_value: None,
        })
    })
}

/// Residuals of image measurements.
pub(super) fn lines(block: &Block, rows: &[ResidualRow]) -> impl Iterator<Item = ResidualLine> {
    rows.iter().map(move |row| {
        let (point, kind) = match row.kind {
            ResidualKind::Tie => (&block.tie_points[row.point as usize].name, "tie"),
            ResidualKind::Mark => (&block.surveyed[row.point as usize].name, "mark"),
        };
        ResidualLine {
            image: block.images[row.image.index()].name.clone(),
            point: point.clone(),
            kind: kind.into(),
            x: row.observed[0],
            y: row.observed[1],
            rx: row.residual[0],
            ry: row.residual[1],
            sigma: row.sigma,
        }
    })
}

/// Residuals of GNSS positions as they stand in the file, in the survey's system.
pub fn gnss_rows<'a>(block: &'a Block, gnss: &'a [GnssResidual]) -> impl Iterator<Item = GnssRow> + 'a {
    let known = |value: f64| Some(value).filter(|value| value.is_finite());
    gnss.iter().map(move |row| {
        let position = row.position + block.origin;
        GnssRow {
            image: block.images[row.image.index()].name.clone(),
            dx: row.d.x,
            dy: row.d.y,
            dz: row.d.z,
            x: position.x,
            y: position.y,
            z: position.z,
            time_s: known(row.time_s),
            heading_deg: known(row.heading_deg),
        }
    })
}
