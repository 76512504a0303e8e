//! A block as a COLMAP model: the five files of either form, with a rig per camera and a frame per image, as COLMAP
//! makes them itself.

use super::super::super::error::Error;
use super::super::positions::Positioned;
use super::super::{CAMERA_ADVICE, ExportOptions, Note, not_held, pose, refuse, verification, write_file};
use super::cameras::{ModelCamera, nearest_to_fraser, of_fraser};
use super::read_binary::NO_POINT;
use crate::block::{Block, Image, ImageId};
use crate::camera::{B1, B2, Camera, DCX, DCY};
use std::io::{self, Write};
use std::path::Path;

/// How a model is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Numbers as they are in memory.
    Binary,
    /// Numbers in words.
    Text,
}

/// `SensorType::CAMERA`.
const CAMERA: i32 = 0;
/// Of every point: an image of the scene has its colours, measurements have none.
const GREY: u8 = 128;

/// What is written, in the order and with the numbers of the files.
struct Model {
    cameras: Vec<(ModelCamera, [u32; 2])>,
    block: Block,
    /// By image: the measurements (numbers in the block) that are its image points, in their order.
    of_image: Vec<Vec<usize>>,
    /// By point: image and place in that image's list.
    tracks: Vec<Vec<[u32; 2]>>,
    /// By point: mean distance of measured and predicted image points, px.
    errors: Vec<f64>,
    /// By point.
    ids: Vec<u64>,
}

pub(super) fn write(block: &Block, dir: &Path, form: Form, options: &ExportOptions) -> Result<Vec<Note>, Error> {
    let mut notes = not_held(block);
    let Positioned { mut block, errors } = Positioned::of(block, &mut notes);
    let cameras = block
        .cameras
        .iter_mut()
        .map(|camera| {
            let written = converted(camera, dir, options, &mut notes)?;
            // Of an approximation: as whoever reads the files finds it.
            if let Some(interior) =
                written.exact().or_else(|| Some(written.nearest([camera.width_px, camera.height_px])?.parameters))
            {
                camera.interior = interior;
            }
            Ok((written, [camera.width_px, camera.height_px]))
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let model = Model::new(cameras, block, errors);
    match form {
        Form::Binary => model.write_binary(dir)?,
        Form::Text => model.write_text(dir)?,
    }
    verification::write(&model.block, dir)?;
    Ok(notes)
}

/// A camera of COLMAP for one of ours.
fn converted(
    camera: &Camera,
    dir: &Path,
    options: &ExportOptions,
    notes: &mut Vec<Note>,
) -> Result<ModelCamera, Error> {
    if let Some(exact) = of_fraser(&camera.interior) {
        return Ok(exact);
    }
    let Some(fit) = nearest_to_fraser(camera) else {
        return Err(refuse(
            dir,
            format!("camera {}: no camera of COLMAP comes near it over the whole sensor", camera.id),
        ));
    };
    let [b1, b2] = [camera.interior[B1], camera.interior[B2]];
    let centre = camera.interior[DCX] - camera.interior[1] != 0.0 || camera.interior[DCY] - camera.interior[2] != 0.0;
    let why = [(centre, "a centre of distortion beside the principal point"), (b1 != 0.0, "b1"), (b2 != 0.0, "b2")];
    let why: Vec<&str> = why.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
    let name = format!("{} ({}; {CAMERA_ADVICE})", camera.id, why.join(", "));
    fit.judge("colmap", &name, options.approximate, notes)
}

impl Model {
    fn new(cameras: Vec<(ModelCamera, [u32; 2])>, block: Block, errors: Vec<f64>) -> Self {
        let mut of_image = vec![Vec::new(); block.images.len()];
        let mut tracks = vec![Vec::new(); block.tie_points.len()];
        for (k, tie) in block.ties.iter().enumerate() {
            let list: &mut Vec<usize> = &mut of_image[tie.image.index()];
            tracks[tie.point.index()].push([tie.image.0 + 1, list.len() as u32]);
            list.push(k);
        }
        let ids = ids(&block);
        Self { cameras, block, of_image, tracks, errors, ids }
    }

    fn images(&self) -> impl Iterator<Item = (ImageId, &Image)> {
        self.block.images.iter().enumerate().map(|(k, image)| (ImageId::from(k), image))
    }

    fn write_binary(&self, dir: &Path) -> Result<(), Error> {
        write_file(&dir.join("cameras.bin"), |file| {
            put(file, self.cameras.len() as u64)?;
            for (id, (camera, size)) in (1u32..).zip(&self.cameras) {
                file.write_all(&id.to_le_bytes())?;
                file.write_all(&camera.model.id.to_le_bytes())?;
                size.iter().try_for_each(|side| put(file, u64::from(*side)))?;
                put_all(file, &camera.parameters)?;
            }
            Ok(())
        })?;
        write_file(&dir.join("images.bin"), |file| {
            put(file, self.block.images.len() as u64)?;
            for (id, image) in self.images() {
                file.write_all(&(id.0 + 1).to_le_bytes())?;
                put_all(file, &pose_of(image))?;
                file.write_all(&(image.camera.0 + 1).to_le_bytes())?;
                file.write_all(image.name.as_bytes())?;
                file.write_all(&[0])?;
                let ties = &self.of_image[id.index()];
                put(file, ties.len() as u64)?;
                for tie in ties.iter().map(|k| &self.block.ties[*k]) {
                    put_all(file, &[tie.x, tie.y])?;
                    put(file, self.ids[tie.point.index()])?;
                }
            }
            Ok(())
        })?;
        write_file(&dir.join("points3D.bin"), |file| {
            put(file, self.ids.len() as u64)?;
            for (k, id) in self.ids.iter().enumerate() {
                put(file, *id)?;
                put_all(file, &self.position(k))?;
                file.write_all(&[GREY; 3])?;
                put_all(file, &[self.errors[k]])?;
                put(file, self.tracks[k].len() as u64)?;
                for number in self.tracks[k].iter().flatten() {
                    file.write_all(&number.to_le_bytes())?;
                }
            }
            Ok(())
        })?;
        write_file(&dir.join("rigs.bin"), |file| {
            put(file, self.cameras.len() as u64)?;
            for id in 1..=self.cameras.len() as u32 {
                // A rig, its number of sensors, and the one that it has.
                for number in [id, 1, CAMERA as u32, id] {
                    file.write_all(&number.to_le_bytes())?;
                }
            }
            Ok(())
        })?;
        write_file(&dir.join("frames.bin"), |file| {
            put(file, self.block.images.len() as u64)?;
            for (id, image) in self.images() {
                let camera = image.camera.0 + 1;
                file.write_all(&(id.0 + 1).to_le_bytes())?;
                file.write_all(&camera.to_le_bytes())?;
                put_all(file, &pose_of(image))?;
                // One datum: the image of the camera.
                for number in [1, CAMERA as u32, camera] {
                    file.write_all(&number.to_le_bytes())?;
                }
                put(file, u64::from(id.0) + 1)?;
            }
            Ok(())
        })
    }

    fn write_text(&self, dir: &Path) -> Result<(), Error> {
        if let Some(name) =
            self.block.images.iter().map(|image| &image.name).find(|name| name.contains(char::is_whitespace))
        {
            return Err(refuse(
                dir,
                format!("image {name:?}: COLMAP cannot read blanks in names of its text form; write colmap"),
            ));
        }
        write_file(&dir.join("cameras.txt"), |file| {
            writeln!(file, "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]")?;
            for (id, (camera, [width, height])) in (1..).zip(&self.cameras) {
                writeln!(file, "{id} {} {width} {height}{}", camera.model.name, words(&camera.parameters))?;
            }
            Ok(())
        })?;
        write_file(&dir.join("images.txt"), |file| {
            writeln!(file, "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# (X Y POINT3D_ID)[]")?;
            for (id, image) in self.images() {
                writeln!(file, "{}{} {} {}", id.0 + 1, words(&pose_of(image)), image.camera.0 + 1, image.name)?;
                for (k, tie) in self.of_image[id.index()].iter().map(|k| &self.block.ties[*k]).enumerate() {
                    let blank = if k == 0 { "" } else { " " };
                    write!(file, "{blank}{:?} {:?} {}", tie.x, tie.y, self.ids[tie.point.index()])?;
                }
                writeln!(file)?;
            }
            Ok(())
        })?;
        write_file(&dir.join("points3D.txt"), |file| {
            writeln!(file, "# POINT3D_ID X Y Z R G B ERROR (IMAGE_ID POINT2D_IDX)[]")?;
            for (k, id) in self.ids.iter().enumerate() {
                write!(file, "{id}{} {GREY} {GREY} {GREY} {:?}", words(&self.position(k)), self.errors[k])?;
                self.tracks[k].iter().try_for_each(|[image, place]| write!(file, " {image} {place}"))?;
                writeln!(file)?;
            }
            Ok(())
        })?;
        write_file(&dir.join("rigs.txt"), |file| {
            writeln!(file, "# RIG_ID NUM_SENSORS REF_SENSOR_TYPE REF_SENSOR_ID")?;
            (1..=self.cameras.len()).try_for_each(|id| writeln!(file, "{id} 1 CAMERA {id}"))
        })?;
        write_file(&dir.join("frames.txt"), |file| {
            writeln!(file, "# FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS (SENSOR_TYPE SENSOR_ID DATA_ID)[]")?;
            for (id, image) in self.images() {
                let (id, camera) = (id.0 + 1, image.camera.0 + 1);
                writeln!(file, "{id} {camera}{} 1 CAMERA {camera} {id}", words(&pose_of(image)))?;
            }
            Ok(())
        })
    }

    fn position(&self, point: usize) -> [f64; 3] {
        // Points without one were left out.
        self.block.tie_points[point].position.unwrap_or_default().into()
    }
}

/// `qw qx qy qz tx ty tz`, of cam_from_world.
fn pose_of(image: &Image) -> [f64; 7] {
    let [w, x, y, z] = pose::quaternion(&image.pose.rotation);
    let t = pose::translation(&image.pose);
    [w, x, y, z, t.x, t.y, t.z]
}

/// Ids of the points: their names, where all are such numbers, as those of points that came from COLMAP are.
fn ids(block: &Block) -> Vec<u64> {
    let id = |name: &str| name.parse().ok().filter(|id: &u64| *id != NO_POINT && *id > 0 && id.to_string() == name);
    let named: Option<Vec<u64>> = block.tie_points.iter().map(|point| id(&point.name)).collect();
    named.unwrap_or_else(|| (1..=block.tie_points.len() as u64).collect())
}

fn put(file: &mut dyn Write, number: u64) -> io::Result<()> {
    file.write_all(&number.to_le_bytes())
}

fn put_all(file: &mut dyn Write, numbers: &[f64]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| file.write_all(&number.to_le_bytes()))
}

/// Numbers with a blank before each: the shortest text that reads back as the same number.
fn words(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!(" {number:?}")).collect()
}
