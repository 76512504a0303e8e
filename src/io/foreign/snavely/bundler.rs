//! Bundler's `bundle.out`, version 0.3.

use super::super::super::error::Error;
use super::super::text::Lines;
use super::super::{ExportOptions, Exporter, Format, ImportOptions, Imported, Note, pose, refuse};
use super::{Scene, View, pose_of, write};
use crate::block::Block;
use nalgebra::{Matrix3, Vector3};
use std::path::{Path, PathBuf};

/// The first line.
const HEADER: &str = "# Bundle file v0.3";
/// The file that is written.
const FILE: &str = "bundle.out";

/// The format.
pub struct Bundler;

impl Format for Bundler {
    fn name(&self) -> &'static str {
        "bundler"
    }

    fn about(&self) -> &'static str {
        "Bundler v0.3, bundle.out with list.txt beside it (--size gives the size of the images)"
    }

    fn recognises(&self, path: &Path) -> bool {
        path.is_file()
            && Lines::open(path).is_ok_and(|mut lines| {
                lines.next_line().is_ok_and(|line| line.is_some_and(|line| line.text().trim_end() == HEADER))
            })
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        let [file] = paths else { return Err(refuse(&paths[0], "expected one file")) };
        read(file)?.block(file, options)
    }

    fn exporter(&self) -> Option<&dyn Exporter> {
        Some(self)
    }
}

impl Exporter for Bundler {
    fn export(&self, block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error> {
        let (scene, notes) = write::Scene::of(block, dir, options)?;
        scene.write(&dir.join(FILE), |file| {
            writeln!(file, "{HEADER}\n{} {}", scene.views.len(), scene.points.len())?;
            for (interior, rotation, t) in &scene.views {
                writeln!(file, "{}", write::words(interior))?;
                for row in rotation.to_rotation_matrix().matrix().row_iter() {
                    writeln!(file, "{:?} {:?} {:?}", row[0], row[1], row[2])?;
                }
                writeln!(file, "{}", write::words(t))?;
            }
            for (position, track) in scene.points.iter().zip(&scene.tracks) {
                writeln!(file, "{}\n128 128 128", write::words(position))?;
                write!(file, "{}", track.len())?;
                for (image, key, [x, y]) in track {
                    write!(file, " {image} {key} {x:?} {y:?}")?;
                }
                writeln!(file)?;
            }
            Ok(())
        })?;
        Ok(notes)
    }

    fn camera_numbers(&self) -> Option<&'static [usize]> {
        Some(&write::NUMBERS)
    }
}

fn read(file: &Path) -> Result<Scene, Error> {
    let mut lines = Lines::open(file)?;
    let header = lines.next_line()?.is_some_and(|line| line.text().trim_end() == HEADER);
    if !header {
        return Err(lines.refuse(format!("expected {HEADER:?}")));
    }
    let images = lines.whole("the number of images", u64::from(u32::MAX))?;
    let points = lines.whole("the number of points", u64::from(u32::MAX))?;
    let mut scene = Scene::default();
    for _ in 0..images {
        let interior: [f64; 3] = lines.numbers("f, k1 or k2")?;
        let matrix = Matrix3::from_row_slice(&lines.numbers::<9>("an element of a rotation")?);
        let t = lines.numbers("a component of a translation")?;
        let [f, ..] = interior;
        scene.views.push(match (f > 0.0, pose::from_matrix(&matrix)) {
            (true, Some(rotation)) => Some(View { interior, pose: pose_of(&rotation, t) }),
            (true, None) => return Err(lines.refuse("the nine numbers of this image are no rotation")),
            (false, _) if f == 0.0 => None,
            (false, _) => {
                return Err(lines.refuse(format!("expected a focal length of 0 (not oriented) or more, found {f}")));
            }
        });
    }
    for point in 0..points {
        let position: [f64; 3] = lines.numbers("a coordinate of a point")?;
        lines.numbers::<3>("a colour")?;
        let number = scene.tracks.point((point + 1).to_string(), Some(Vector3::from(position)));
        for _ in 0..lines.whole("the number of images that see a point", u64::from(u32::MAX))? {
            let image = lines.whole("the number of an image", images as u64)?;
            lines.word("the number of a feature")?;
            scene.tracks.measure(image.into(), number, lines.numbers("an image coordinate")?);
        }
    }
    Ok(scene)
}
