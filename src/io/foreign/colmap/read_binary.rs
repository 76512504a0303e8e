//! The binary form: counted records, little endian.

use super::super::super::error::Error;
use super::super::binary::Bytes;
use super::cameras::ModelCamera;
use super::model::{Model, model};
use std::path::Path;

/// In place of a point where an image point has none.
pub(super) const NO_POINT: u64 = u64::MAX;

pub(super) fn read(folder: &Path) -> Result<Model, Error> {
    let mut gathered = Model::default();
    cameras(Bytes::open(&folder.join("cameras.bin"))?, &mut gathered)?;
    points(Bytes::open(&folder.join("points3D.bin"))?, &mut gathered)?;
    images(Bytes::open(&folder.join("images.bin"))?, &mut gathered)?;
    let rigs = folder.join("rigs.bin");
    if rigs.exists() {
        self::rigs(Bytes::open(&rigs)?, &mut gathered)?;
    }
    Ok(gathered)
}

fn cameras(mut file: Bytes, gathered: &mut Model) -> Result<(), Error> {
    for _ in 0..file.u64("the number of cameras")? {
        let id = file.u32("the id of a camera")?;
        let number = file.i32("a camera model")?;
        let model = model(|model| model.id == number, &number.to_string()).map_err(|problem| file.refuse(problem))?;
        let size = [file.u64("a width")?, file.u64("a height")?];
        let parameters =
            (0..model.parameters).map(|_| file.f64("a parameter of a camera")).collect::<Result<_, _>>()?;
        gathered.add_camera(id, ModelCamera { model, parameters }, size).map_err(|problem| file.refuse(problem))?;
    }
    file.end()
}

fn points(mut file: Bytes, gathered: &mut Model) -> Result<(), Error> {
    for _ in 0..file.u64("the number of points")? {
        let id = file.u64("the id of a point")?;
        let position = file.f64s("a coordinate")?;
        file.bytes::<3>("a colour")?;
        let error = f64::from_le_bytes(file.bytes::<8>("an error")?);
        let measurements = file.u64("the length of a track")?;
        // The images have its track too.
        for _ in 0..measurements {
            file.bytes::<8>("a track")?;
        }
        gathered.add_point(id, position, Some(error), usize::try_from(measurements).unwrap_or(usize::MAX));
    }
    gathered.end_of_points().map_err(|problem| file.refuse(problem))?;
    file.end()
}

fn images(mut file: Bytes, gathered: &mut Model) -> Result<(), Error> {
    for _ in 0..file.u64("the number of images")? {
        file.u32("the id of an image")?;
        let (q, t) = (file.f64s("a component of a quaternion")?, file.f64s("a component of a translation")?);
        let camera = file.u32("the id of a camera")?;
        let name = file.name("the name of an image")?;
        let image = gathered.add_image(q, t, camera, &name).map_err(|problem| file.refuse(problem))?;
        for _ in 0..file.u64("the number of image points")? {
            let xy = file.f64s("an image coordinate")?;
            match file.u64("the id of a point")? {
                NO_POINT => {}
                point => gathered.add_measurement(image, point, xy),
            }
        }
    }
    file.end()
}

fn rigs(mut file: Bytes, gathered: &mut Model) -> Result<(), Error> {
    for _ in 0..file.u64("the number of rigs")? {
        file.u32("the id of a rig")?;
        let sensors = file.u32("the number of sensors")?;
        gathered.rigs += usize::from(sensors > 1);
        for sensor in 0..sensors {
            file.i32("the type of a sensor")?;
            file.u32("the id of a sensor")?;
            // The first is the reference: it has no pose in the rig.
            if sensor > 0 && file.u8("whether a sensor has a pose")? != 0 {
                file.f64s::<7>("the pose of a sensor")?;
            }
        }
    }
    file.end()
}
