//! The problems "bundle adjustment in the large": counts, measurements, then nine numbers per image and three per
//! point.

use super::super::super::error::Error;
use super::super::text::Lines;
use super::super::{ExportOptions, Exporter, Format, ImportOptions, Imported, Note, refuse};
use super::{Scene, View, pose_of, write};
use crate::block::Block;
use nalgebra::{UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};

/// The file that is written.
const FILE: &str = "problem.txt";

/// The format.
pub struct Bal;

impl Format for Bal {
    fn name(&self) -> &'static str {
        "bal"
    }

    fn about(&self) -> &'static str {
        "a problem of \"bundle adjustment in the large\" (--size gives the size of the images)"
    }

    fn recognises(&self, path: &Path) -> bool {
        // problem-16-22106-pre.txt: the name has images and points, the first line both and the measurements.
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let counts = || {
            let mut lines = Lines::open(path).ok()?;
            let mut line = lines.next_line().ok()??;
            let counts: [u32; 3] = [line.whole("").ok()?, line.whole("").ok()?, line.whole("").ok()?];
            line.is_empty().then_some(counts)
        };
        path.is_file() && counts().is_some_and(|[images, points, _]| name.contains(&format!("-{images}-{points}")))
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        let [file] = paths else { return Err(refuse(&paths[0], "expected one file")) };
        read(file)?.block(file, options)
    }

    fn exporter(&self) -> Option<&dyn Exporter> {
        Some(self)
    }
}

impl Exporter for Bal {
    fn export(&self, block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error> {
        let (scene, notes) = write::Scene::of(block, dir, options)?;
        scene.write(&dir.join(FILE), |file| {
            let measurements: usize = scene.tracks.iter().map(Vec::len).sum();
            writeln!(file, "{} {} {measurements}", scene.views.len(), scene.points.len())?;
            for (point, track) in scene.tracks.iter().enumerate() {
                for (image, _, [x, y]) in track {
                    writeln!(file, "{image} {point} {x:?} {y:?}")?;
                }
            }
            for (interior, rotation, t) in &scene.views {
                let numbers = rotation.scaled_axis().iter().chain(t).chain(interior).copied().collect::<Vec<f64>>();
                numbers.iter().try_for_each(|number| writeln!(file, "{number:?}"))?;
            }
            scene.points.iter().flatten().try_for_each(|number| writeln!(file, "{number:?}"))
        })?;
        Ok(notes)
    }

    fn camera_numbers(&self) -> Option<&'static [usize]> {
        Some(&write::NUMBERS)
    }
}

fn read(file: &Path) -> Result<Scene, Error> {
    let mut lines = Lines::open(file)?;
    let most = u64::from(u32::MAX);
    let images = lines.whole("the number of images", most)?;
    let points = lines.whole("the number of points", most)?;
    let measurements = lines.whole("the number of measurements", most)?;
    let mut scene = Scene::default();
    for _ in 0..measurements {
        let image = lines.whole("the number of an image", images as u64)?;
        let point = lines.whole("the number of a point", points as u64)?;
        scene.tracks.measure(image.into(), point.into(), lines.numbers("an image coordinate")?);
    }
    for _ in 0..images {
        let turn: [f64; 3] = lines.numbers("a component of a rotation")?;
        let t = lines.numbers("a component of a translation")?;
        let interior: [f64; 3] = lines.numbers("f, k1 or k2")?;
        if interior[0] <= 0.0 {
            return Err(lines.refuse(format!("expected a focal length above zero, found {}", interior[0])));
        }
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        scene.views.push(Some(View { interior, pose: pose_of(&rotation, t) }));
    }
    for point in 0..points {
        let position: [f64; 3] = lines.numbers("a coordinate of a point")?;
        scene.tracks.point((point + 1).to_string(), Some(position.into()));
    }
    Ok(scene)
}
