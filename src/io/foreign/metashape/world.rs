//! From the coordinates of a chunk to those of the block.

use super::super::{Note, pose};
use super::document::{Chunk, Similarity};
use crate::block::Pose;
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::{Matrix3, Vector3};

/// Where the block's coordinates come from.
pub(super) enum World {
    /// The similarity leads to them.
    Local,
    /// It leads to Earth-centred coordinates.
    Earth { system: LocalSystem, crs: Crs },
}

impl World {
    /// `centres` are those of the images, with what takes each to the world.
    pub(super) fn of(
        chunk: &Chunk,
        centres: impl Iterator<Item = (Similarity, Vector3<f64>)>,
        notes: &mut Vec<Note>,
    ) -> Result<Self, String> {
        if chunk.transforms.is_empty() {
            let text = "the chunk has no relation to a coordinate system: lengths are in its own unit, not in metres";
            notes.push(Note::guess(text));
            return Ok(Self::Local);
        }
        let Some(wkt) = chunk.wkt.as_deref().filter(|wkt| !wkt.starts_with("LOCAL_CS")) else { return Ok(Self::Local) };
        let crs = Crs::parse(wkt)?;
        let places: Vec<Geographic> = centres
            .map(|(similarity, centre)| Geographic::of_earth_centred(&transformed(&similarity, &centre)))
            .collect();
        let system = LocalSystem::about(&places).ok_or("no image has a pose")?;
        notes.push(Note::fact(format!("coordinates are {}; heights are taken as they are", system.crs())));
        Ok(Self::Earth { system, crs })
    }

    pub(super) fn crs(&self) -> String {
        match self {
            Self::Local => "local".into(),
            Self::Earth { system, .. } => system.crs(),
        }
    }

    pub(super) fn position(&self, similarity: &Similarity, point: &Vector3<f64>) -> Vector3<f64> {
        let point = transformed(similarity, point);
        match self {
            Self::Local => point,
            Self::Earth { system, .. } => system.of_earth_centred(&point),
        }
    }

    pub(super) fn pose(&self, similarity: &Similarity, rotation: &Matrix3<f64>, centre: &Vector3<f64>) -> Option<Pose> {
        let world_from_cam = similarity.rotation * rotation;
        let world_from_cam = match self {
            Self::Local => world_from_cam,
            Self::Earth { system, .. } => system.from_earth_centred_axes() * world_from_cam,
        };
        let rotation = pose::from_matrix(&world_from_cam.transpose())?;
        Some(Pose { rotation, centre: self.position(similarity, centre) })
    }

    /// Is it longitude and latitude 0, 0, which stand where a camera knew none?
    pub(super) fn is_nowhere(&self, position: &Vector3<f64>) -> bool {
        matches!(self, Self::Earth { crs, .. } if crs.is_geographic()) && [position.x, position.y] == [0.0, 0.0]
    }

    pub(super) fn reference(&self, position: &Vector3<f64>) -> Result<Vector3<f64>, String> {
        match self {
            Self::Local => Ok(*position),
            Self::Earth { system, crs } => Ok(system.local(&crs.place((*position).into())?)),
        }
    }
}

fn transformed(similarity: &Similarity, point: &Vector3<f64>) -> Vector3<f64> {
    similarity.translation + similarity.scale * (similarity.rotation * point)
}
