//! Where places on the Earth lie in a block.

use super::Note;
use crate::block::Block;
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::Vector3;

/// The coordinate system of a block that has a place on the Earth.
pub(super) enum BlockSystem {
    Local(LocalSystem),
    Named(Crs),
}

impl BlockSystem {
    /// Of the `crs` of a block. One that is `local` and has no position of any kind gets a system about `places`: the
    /// poses are then brought there by the adjustment, which has nothing else to go by.
    pub(super) fn of(block: &mut Block, places: &[Geographic], notes: &mut Vec<Note>) -> Result<Self, String> {
        if let Some(system) = LocalSystem::parse(&block.crs) {
            return Ok(Self::Local(system));
        }
        if !block.crs.starts_with("local") {
            return Crs::parse(&block.crs).map(Self::Named).map_err(|problem| format!("crs of the block: {problem}"));
        }
        if !block.surveyed.is_empty() || block.images.iter().any(|image| image.gnss.is_some()) {
            return Err(format!(
                "the block has positions in its coordinate system {:?}, which says nothing of latitude and longitude; \
                 name the system in block.toml",
                block.crs
            ));
        }
        let system = LocalSystem::about(places).ok_or("there are no positions")?;
        block.crs = system.crs();
        notes.push(Note::fact(format!("the block was in no named coordinate system: positions are {}", block.crs)));
        Ok(Self::Local(system))
    }

    /// Coordinates in the block, m.
    pub(super) fn position(&self, place: &Geographic) -> Result<Vector3<f64>, String> {
        match self {
            Self::Local(system) => Ok(system.local(place)),
            Self::Named(crs) => crs.coordinates(place).map(Vector3::from),
        }
    }
}
