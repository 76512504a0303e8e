//! A block in Snavely's terms: coordinates from the principal point, y up.

use super::super::super::error::Error;
use super::super::fit::{Fit, fit_to_fraser};
use super::super::positions::Positioned;
use super::super::{CAMERA_ADVICE, ExportOptions, Note, not_held, pose, refuse, verification, write_file};
use super::{LIST, interior};
use crate::block::Block;
use crate::camera::{B1, B2, Camera, DCX, DCY, F, K1, K2, K3, P1, P2, PPX, PPY};
use nalgebra::UnitQuaternion;
use std::io::{self, Write};
use std::path::Path;

/// Numbers of a camera that the formats hold; the principal point by moving the measurements.
pub(super) const NUMBERS: [usize; 5] = [F, PPX, PPY, K1, K2];

/// An image that sees a point: its number, the number of the feature in it, and the place.
type Sight = (usize, usize, [f64; 2]);

/// What either file holds.
pub(super) struct Scene {
    /// By image: `f, k1, k2`, their rotation and their translation.
    pub views: Vec<([f64; 3], UnitQuaternion<f64>, [f64; 3])>,
    pub points: Vec<[f64; 3]>,
    /// By point.
    pub tracks: Vec<Vec<Sight>>,
    /// The block as the files hold it.
    block: Block,
}

impl Scene {
    pub(super) fn of(block: &Block, dir: &Path, options: &ExportOptions) -> Result<(Self, Vec<Note>), Error> {
        let mut notes = not_held(block);
        let Positioned { mut block, .. } = Positioned::of(block, &mut notes);
        let mut converted = Vec::new();
        let mut shifts = Vec::new();
        for camera in &mut block.cameras {
            let [f, k1, k2, ppx, ppy] = camera_of(camera, dir, options, &mut notes)?;
            let middle = [0.5 * f64::from(camera.width_px), 0.5 * f64::from(camera.height_px)];
            shifts.push([middle[0] - ppx, middle[1] - ppy]);
            camera.interior = interior([f, k1, k2], middle);
            converted.push([f, k1, k2]);
        }
        let largest = shifts.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
        if largest > 0.0 {
            notes.push(Note::loss(format!(
                "image coordinates are moved by up to {largest:.1} px: the format has its principal point in the \
                 middle of the image"
            )));
        }
        for tie in &mut block.ties {
            let [dx, dy] = shifts[block.images[tie.image.index()].camera.index()];
            (tie.x, tie.y) = (tie.x + dx, tie.y + dy);
        }
        let views = block.images.iter().map(|image| {
            let turned = crate::block::Pose { rotation: pose::half_turn_about_x(&image.pose.rotation), ..image.pose };
            (converted[image.camera.index()], turned.rotation, pose::translation(&turned).into())
        });
        let views = views.collect();
        let mut tracks = vec![Vec::new(); block.tie_points.len()];
        let mut keys = vec![0; block.images.len()];
        for tie in &block.ties {
            let camera = block.camera_of(tie.image);
            let xy = [tie.x - 0.5 * f64::from(camera.width_px), 0.5 * f64::from(camera.height_px) - tie.y];
            let key = &mut keys[tie.image.index()];
            tracks[tie.point.index()].push((tie.image.index(), *key, xy));
            *key += 1;
        }
        // Points without coordinates were left out.
        let points = block.tie_points.iter().map(|point| point.position.unwrap_or_default().into()).collect();
        Ok((Self { views, points, tracks, block }, notes))
    }

    /// Writes the file, the list of the images and the verification points beside it.
    pub(super) fn write(&self, path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
        let dir = super::folder_of(path);
        if let Some(image) = self.block.images.iter().find(|image| image.name.contains(char::is_whitespace)) {
            return Err(refuse(dir, format!("image {:?}: {LIST} cannot hold names with blanks", image.name)));
        }
        write_file(path, fill)?;
        write_file(&dir.join(LIST), |file| {
            self.block.images.iter().try_for_each(|image| writeln!(file, "{}", image.name))
        })?;
        verification::write(&self.block, dir)
    }
}

/// `f, k1, k2` and the principal point of a camera: exact where the Fraser camera has no more.
fn camera_of(camera: &Camera, dir: &Path, options: &ExportOptions, notes: &mut Vec<Note>) -> Result<[f64; 5], Error> {
    let i = &camera.interior;
    let (f, normalised) = (i[F], [i[K1] * i[F].powi(2), i[K2] * i[F].powi(4)]);
    let start = [f, normalised[0], normalised[1], i[PPX], i[PPY]];
    let centred = (i[DCX], i[DCY]) == (i[PPX], i[PPY]) || (i[K1], i[K2]) == (0.0, 0.0);
    if centred && [K3, P1, P2, B1, B2].iter().all(|k| i[*k] == 0.0) {
        return Ok(start);
    }
    let predict = |values: &[f64], [u, v]: [f64; 2]| {
        let r2 = u * u + v * v;
        let scale = values[0] * (1.0 + r2 * (values[1] + r2 * values[2]));
        Some([values[3] + scale * u, values[4] + scale * v])
    };
    // Changes that move a point at half the diagonal by a pixel.
    let h = camera.half_diagonal_px();
    let edge = h / f;
    let scales = [edge.recip(), edge.powi(-2) / h, edge.powi(-4) / h, 1.0, 1.0];
    let Some(Fit { parameters, rms_px, max_px }) = fit_to_fraser(camera, start.into(), &scales, &predict) else {
        return Err(refuse(
            dir,
            format!("camera {}: nothing of f, k1 and k2 comes near it over the whole sensor", camera.id),
        ));
    };
    let name = format!("{} ({CAMERA_ADVICE})", camera.id);
    Fit { parameters: std::array::from_fn(|k| parameters[k]), rms_px, max_px }.judge(
        "bundler, bal",
        &name,
        options.approximate,
        notes,
    )
}

/// Numbers with blanks between them: the shortest text that reads back as the same number.
pub(super) fn words(numbers: &[f64; 3]) -> String {
    let [a, b, c] = numbers;
    format!("{a:?} {b:?} {c:?}")
}
