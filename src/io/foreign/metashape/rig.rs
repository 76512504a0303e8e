//! Rigs: several cameras that are fixed to each other. Of each exposure the master alone has a pose; those of the
//! slaves follow from it and from the offsets of their sensors.
//!
//! ```text
//! slave = master [R | t]      camera to chunk; R, t: <rotation> and <location> of the slave's sensor
//! ```
//!
//! `R` takes the axes of the slave's camera to those of the master's, `t` is the slave's projection centre in the
//! master's camera axes. An image names its master image, a sensor its master sensor; where an image of another sensor
//! than that is the master, the offsets of both lead by way of the master sensor.

use super::super::Note;
use super::document::{Chunk, Photo, Sensor};
use super::offset::Placed;
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// Why a slave gets no pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reason {
    /// Its master image is not there, or has no pose.
    MasterUnaligned,
    /// Its sensor, or that of its master, has no offset.
    NoOffset,
    /// The offsets of the two sensors are against different ones.
    OtherMaster,
}

impl Reason {
    /// All, in the order in which they are said.
    const ALL: [Self; 3] = [Self::MasterUnaligned, Self::NoOffset, Self::OtherMaster];

    fn words(self) -> &'static str {
        match self {
            Self::MasterUnaligned => "their master image is not aligned",
            Self::NoOffset => "their sensor has no rotation and location in the rig",
            Self::OtherMaster => "the offset of their sensor is against another sensor than that of their master image",
        }
    }
}

/// The images of a chunk and its sensors, by id.
pub(super) struct Rigs<'a> {
    photos: HashMap<&'a str, &'a Photo>,
    sensors: HashMap<&'a str, &'a Sensor>,
}

impl<'a> Rigs<'a> {
    pub(super) fn of(chunk: &'a Chunk) -> Self {
        Self {
            photos: chunk.photos.iter().map(|photo| (photo.id.as_str(), photo)).collect(),
            sensors: chunk.sensors.iter().map(|sensor| (sensor.id.as_str(), sensor)).collect(),
        }
    }

    /// The master of a slave.
    pub(super) fn master(&self, slave: &Photo) -> Option<&'a Photo> {
        self.photos.get(slave.master.as_deref()?).copied()
    }

    /// The pose of a slave.
    pub(super) fn pose(&self, slave: &Photo) -> Result<Placed, Reason> {
        let master = self.master(slave).ok_or(Reason::MasterUnaligned)?;
        let (rotation, centre) = master.pose.ok_or(Reason::MasterUnaligned)?;
        let (of_master, base) = self.offset(&master.sensor)?;
        let (of_slave, own_base) = self.offset(&slave.sensor)?;
        if base != own_base {
            return Err(Reason::OtherMaster);
        }
        // Master image to master sensor, and from there to the slave.
        let back = of_master.0.transpose();
        let (turn, shift) = (back * of_slave.0, back * (of_slave.1 - of_master.1));
        Ok((rotation * turn, centre + rotation * shift))
    }

    /// The offset of a sensor against its master sensor, and the id of that.
    fn offset(&self, id: &str) -> Result<(Placed, &'a str), Reason> {
        let sensor = self.sensors.get(id).ok_or(Reason::NoOffset)?;
        match sensor.master.as_deref() {
            Some(master) if master != sensor.id => Ok((sensor.offset.ok_or(Reason::NoOffset)?, master)),
            _ => Ok(((Matrix3::identity(), Vector3::zeros()), sensor.id.as_str())),
        }
    }
}

/// What became of the slaves of a chunk.
#[derive(Default)]
pub(super) struct Slaves {
    /// Those that got a pose.
    pub resolved: usize,
    /// Why others got none.
    pub lost: Vec<Reason>,
}

impl Slaves {
    pub(super) fn tell(&self, notes: &mut Vec<Note>) {
        if self.resolved > 0 {
            notes.push(Note::guess(format!(
                "{} images of rigs have their pose from that of their master and the offset of their sensor. Its \
                 location is taken in the unit of the chunk",
                self.resolved
            )));
        }
        for reason in Reason::ALL {
            let count = self.lost.iter().filter(|own| **own == reason).count();
            if count > 0 {
                notes.push(Note::loss(format!("{count} images of rigs have no pose, {}: left out", reason.words())));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Offsets that do not commute.
    #[test]
    fn a_master_of_another_sensor_leads_by_way_of_the_master_sensor() {
        let turn = |axis: Vector3<f64>, angle: f64| nalgebra::Rotation3::from_scaled_axis(axis * angle).into_inner();
        let offsets = [
            (turn(Vector3::x(), 0.3), Vector3::new(0.1, 0.0, 0.0)),
            (turn(Vector3::y(), -0.2), Vector3::new(0.0, 0.2, 0.1)),
        ];
        let sensor = |id: &str, master: Option<&str>, offset: Option<Placed>| Sensor {
            id: id.into(),
            label: id.into(),
            width_px: 100,
            height_px: 100,
            pixel_um: None,
            calibration: super::super::document::Calibration {
                f: 100.0,
                pp: [50.0; 2],
                b: [0.0; 2],
                k: [0.0; 4],
                p: [0.0; 4],
            },
            has_rolling_shutter: false,
            master: master.map(str::to_owned),
            offset,
        };
        let photo = |id: &str, sensor: &str, master: Option<&str>, pose: Option<Placed>| Photo {
            id: id.into(),
            label: id.into(),
            sensor: sensor.into(),
            component: None,
            group: None,
            enabled: true,
            pose,
            master: master.map(str::to_owned),
            reference: None,
        };
        let base: Placed = (turn(Vector3::z(), 1.0), Vector3::new(5.0, 6.0, 7.0));
        let after = |(r, c): Placed, (turn, shift): Placed| (r * turn, c + r * shift);
        let master = after(base, offsets[0]);
        let chunk = |offset: Option<Placed>| Chunk {
            label: String::new(),
            sensors: vec![
                sensor("0", None, None),
                sensor("1", Some("0"), Some(offsets[0])),
                sensor("2", Some("0"), offset),
            ],
            photos: vec![photo("a", "1", None, Some(master)), photo("b", "2", Some("a"), None)],
            markers: Vec::new(),
            transforms: std::collections::BTreeMap::new(),
            wkt: None,
            accuracies: std::collections::BTreeMap::new(),
        };
        let whole = chunk(Some(offsets[1]));
        let (rotation, centre) = Rigs::of(&whole).pose(&whole.photos[1]).expect("a pose");
        let expected = after(base, offsets[1]);
        assert!((rotation - expected.0).abs().max() < 1e-12 && (centre - expected.1).norm() < 1e-12);
        let without = chunk(None);
        assert_eq!(Rigs::of(&without).pose(&without.photos[1]), Err(Reason::NoOffset));
        let mut unaligned = chunk(Some(offsets[1]));
        unaligned.photos[0].pose = None;
        assert_eq!(Rigs::of(&unaligned).pose(&unaligned.photos[1]), Err(Reason::MasterUnaligned));
    }
}
