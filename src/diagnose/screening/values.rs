//! The tables of a block as plain values.

use crate::block::{Block, Image, Measurement};
use crate::camera::{Camera, DCX, DCY, F, K1, K2, K3, P1, P2, PPX, PPY};
use crate::mistakes::Mistake;
use crate::mistakes::values::{self, Measured, Row, Table, Tables};

/// Mistakes that the values of a block's tables show without any adjustment.
pub fn of_values(block: &Block) -> Vec<Mistake> {
    values::judge(&tables(block))
}

/// The block as plain tables.
fn tables(block: &Block) -> Tables<'_> {
    Tables {
        cameras: block.cameras.iter().map(camera).collect(),
        images: block.images.iter().map(image).collect(),
        ties: Table {
            of: Measured::Ties,
            rows: block.ties.len(),
            row: Box::new(|k| row(&block.ties[k], block.sigma.tie_px)),
            points: block.tie_points.len(),
            point_name: Box::new(|point| block.tie_points[point].name.clone()),
        },
        marks: Table {
            of: Measured::Marks,
            rows: block.marks.len(),
            row: Box::new(|k| row(&block.marks[k], block.sigma.mark_px)),
            points: block.surveyed.len(),
            point_name: Box::new(|point| block.surveyed[point].name.clone()),
        },
    }
}

fn camera(camera: &Camera) -> values::Camera {
    let interior = &camera.interior;
    values::Camera {
        id: camera.id.clone(),
        sides: [camera.width_px, camera.height_px].map(f64::from),
        pixel_um: camera.pixel_um,
        focal: interior[F],
        principal: [interior[PPX], interior[PPY]],
        distortion_centre: [interior[DCX], interior[DCY]],
        radial: [interior[K1], interior[K2], interior[K3]],
        decentring: [interior[P1], interior[P2]],
    }
}

fn image(image: &Image) -> values::Image {
    values::Image {
        name: image.name.clone(),
        camera: image.camera.index(),
        flight: image.flight.index(),
        time_s: image.time_s,
        temperature_c: image.temperature_c,
        centre: image.pose.centre,
        gnss: image.gnss.map(|gnss| gnss.position),
        velocity: image.velocity,
    }
}

fn row(row: &Measurement, of_block: f64) -> Row {
    let sigma = row.sigma.unwrap_or(of_block);
    Row { image: row.image.index(), point: row.point.index(), xy: [row.x, row.y], sigma }
}
