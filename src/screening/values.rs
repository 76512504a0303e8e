//! The tables of a block as plain values.

use super::meeting::meeting_places;
use crate::block::{Block, Image, Measurement, Role};
use crate::camera::{Camera, DCX, DCY, F, K1, K2, K3, P1, P2, PPX, PPY};
use crate::geodesy::exchanged::exchanged;
use crate::geodesy::geographic::LocalSystem;
use crate::mistakes::values::{self, Measured, Places, Row, Table, Tables};
use crate::mistakes::{Mistake, Subject};
use crate::model::{Datum, Model};
use nalgebra::Vector3;

/// Measurements that tell the distance of the tie points: a quantile of them is known to a hundredth.
const SAMPLED: usize = 10_000;
/// Share of the measurements that see points within [`Tables::reach`]: the rest may be false matches.
const WITHIN: f64 = 0.95;

/// Mistakes that the values of a block's tables show without any adjustment.
pub fn of_values(block: &Block) -> Vec<Mistake> {
    values::judge(&tables(block))
}

/// Control that does not fix a block, where the model asks it to.
pub fn of_datum(block: &Block, model: &Model) -> Option<Mistake> {
    match model.datum {
        Datum::Control | Datum::All => values::datum::judge(&tables(block), model.datum == Datum::All),
        Datum::Free | Datum::Gnss => None,
    }
}

/// Where surveyed positions lie against the cameras, as the values alone say.
pub fn of_places(block: &Block) -> Places {
    values::places(&tables(block))
}

/// The block as plain tables.
fn tables(block: &Block) -> Tables<'_> {
    Tables {
        cameras: block.cameras.iter().map(camera).collect(),
        images: block.images.iter().map(|own| image(block, own)).collect(),
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
        surveyed: surveyed(block),
        origin: block.origin,
        is_local: LocalSystem::parse(&block.crs).is_some(),
        reach: reach(block),
    }
}

/// A position as it would be if latitude and longitude had been exchanged, in the block's coordinates.
fn turned(block: &Block, position: &Vector3<f64>) -> Option<Vector3<f64>> {
    Some(exchanged(&block.crs, &(position + block.origin))? - block.origin)
}

fn surveyed(block: &Block) -> Vec<values::Surveyed> {
    let met = meeting_places(block);
    let point = |(own, met): (&crate::block::SurveyedPoint, Option<Vector3<f64>>)| values::Surveyed {
        name: own.name.clone(),
        subject: if own.role == Role::Control { Subject::Control } else { Subject::Check },
        position: own.position,
        exchanged: turned(block, &own.position),
        met,
    };
    block.surveyed.iter().zip(met).map(point).collect()
}

/// Distance from which nearly all tie points are seen, m.
fn reach(block: &Block) -> Option<f64> {
    let step = block.ties.len().div_ceil(SAMPLED).max(1);
    let distance = |row: &Measurement| {
        let place = block.tie_points[row.point.index()].position?;
        Some((place - block.images[row.image.index()].pose.centre).norm())
    };
    let mut distances: Vec<f64> = block.ties.iter().step_by(step).filter_map(distance).collect();
    distances.sort_by(f64::total_cmp);
    distances.get((WITHIN * distances.len() as f64) as usize).copied()
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

fn image(block: &Block, image: &Image) -> values::Image {
    values::Image {
        name: image.name.clone(),
        camera: image.camera.index(),
        flight: image.flight.index(),
        time_s: image.time_s,
        temperature_c: image.temperature_c,
        centre: image.pose.centre,
        gnss: image.gnss.map(|gnss| gnss.position),
        velocity: image.velocity,
        view: image.pose.rotation.inverse() * Vector3::z(),
        gnss_exchanged: image.gnss.and_then(|gnss| turned(block, &gnss.position)),
    }
}

fn row(row: &Measurement, of_block: f64) -> Row {
    let sigma = row.sigma.unwrap_or(of_block);
    Row { image: row.image.index(), point: row.point.index(), xy: [row.x, row.y], sigma }
}
