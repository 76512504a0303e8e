//! A block as a run left it: for whoever goes on with it elsewhere.
//!
//! A run folder has what is needed: adjusted cameras, poses and points, and the residual of every measurement that took
//! part. The computed image point of a measurement, observed minus residual, has all effects of the model in it; the
//! camera alone predicts it without them. What lies between is what the effects do to the measurement, whatever they
//! are.

use super::RunFolder;
use super::read::{read_points, read_residuals};
use super::rows::ResidualLine;
use crate::block::{Block, Measurement, PointId, Pose, TiePoint};
use crate::camera::fraser::project;
use crate::camera::{Interior, PARAMETERS};
use crate::effects::Stage;
use crate::io::Error;
use nalgebra::Vector3;
use std::collections::HashMap;
use std::path::Path;

/// A block with the cameras, poses and points of a run, and the measurements that took part.
#[derive(Debug, Clone)]
pub struct Adjusted {
    /// The block.
    pub block: Block,
    /// Names of the effects in the model.
    pub effects: Vec<String>,
    /// By tie measurement: what the effects move it by, px.
    ties: Vec<[f64; 2]>,
    /// The same by mark; `None` where the folder does not tell: of control points that took part in the adjustment.
    marks: Vec<Option<[f64; 2]>>,
}

impl Adjusted {
    /// Puts the results of the run in `dir` into the block that it adjusted.
    ///
    /// # Errors
    /// Files that cannot be read, or that are of another block.
    pub fn read(mut block: Block, dir: &Path) -> Result<Self, Error> {
        let folder = RunFolder::<serde::de::IgnoredAny>::read(dir)?;
        let of_block = |id: &String| block.cameras.iter().any(|camera| camera.id == *id);
        if let Some((id, _)) = folder.summary.cameras.0.iter().find(|(id, _)| !of_block(id)) {
            return Err(second_camera(dir, id));
        }
        for camera in &mut block.cameras {
            let of_run = folder.summary.cameras.0.iter().find(|(id, _)| *id == camera.id);
            let (_, values) = of_run.ok_or_else(|| stranger(dir, "camera", &camera.id))?;
            let value = |name: &str| values.0.iter().find(|(other, _)| other == name).map(|(_, p)| p.value);
            for (k, name) in PARAMETERS.into_iter().enumerate() {
                camera.interior[k] = value(name).ok_or_else(|| stranger(dir, "camera", &camera.id))?;
            }
        }
        let poses: HashMap<String, Pose> = folder.images.iter().map(|row| (row.image.clone(), row.pose())).collect();
        for image in &mut block.images {
            image.pose = *poses.get(&image.name).ok_or_else(|| stranger(dir, "image", &image.name))?;
        }
        let points = read_points(dir)?;
        let points = points.into_iter().map(|row| (row.point, Vector3::new(row.x, row.y, row.z))).collect();
        let lines = read_residuals(dir)?;
        let residuals = Residuals::of(&lines);
        let ties = keep_adjusted(&mut block, &points, &residuals);
        let effects: Vec<String> = folder.summary.effects.0.iter().map(|(name, _)| name.clone()).collect();
        let control_took_part = folder.summary.similarity.is_none();
        // Computed coordinates are then those that a survey would give, not those that images see.
        let in_frame = effects.iter().any(|name| {
            crate::effects::find(name)
                .is_none_or(|effect| matches!(effect.descriptor().stage, Stage::Control | Stage::Frame))
        });
        let marks = block.marks.iter().map(|mark| {
            let row = folder.checks.iter().find(|row| row.point == block.surveyed[mark.point.index()].name)?;
            if in_frame || (control_took_part && row.role == "control") {
                return None;
            }
            let computed = Vector3::new(row.x + row.dx, row.y + row.dy, row.z + row.dz);
            effect(&block, mark, &computed, residuals.of_mark(&block, mark)?)
        });
        let marks = marks.collect();
        Ok(Self { block, effects, ties, marks })
    }

    /// The most that the effects move a measurement by, px.
    pub fn largest_px(&self) -> f64 {
        let all = self.ties.iter().chain(self.marks.iter().flatten());
        all.map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max)
    }

    /// The block as a camera without the effects would have seen it, and the number of marks that keep their effects.
    pub fn without_effects(self) -> (Block, usize) {
        let Self { mut block, ties, marks, .. } = self;
        let kept = marks.iter().filter(|mark| mark.is_none()).count();
        let known = ties.into_iter().map(Some).chain(marks);
        for (measurement, effect) in block.ties.iter_mut().chain(&mut block.marks).zip(known) {
            let [x, y] = effect.unwrap_or_default();
            (measurement.x, measurement.y) = (measurement.x - x, measurement.y - y);
        }
        (block, kept)
    }
}

/// Residuals by kind, image and point.
struct Residuals<'a>(HashMap<(&'a str, &'a str, &'a str), [f64; 2]>);

impl<'a> Residuals<'a> {
    fn of(lines: &'a [ResidualLine]) -> Self {
        let key = |line: &'a ResidualLine| (line.kind.as_str(), line.image.as_str(), line.point.as_str());
        Self(lines.iter().map(|line| (key(line), [line.rx, line.ry])).collect())
    }

    fn of_tie(&self, block: &Block, tie: &Measurement) -> Option<[f64; 2]> {
        self.get("tie", block, tie, &block.tie_points[tie.point.index()].name)
    }

    fn of_mark(&self, block: &Block, mark: &Measurement) -> Option<[f64; 2]> {
        self.get("mark", block, mark, &block.surveyed[mark.point.index()].name)
    }

    fn get(&self, kind: &str, block: &Block, measurement: &Measurement, point: &str) -> Option<[f64; 2]> {
        self.0.get(&(kind, block.images[measurement.image.index()].name.as_str(), point)).copied()
    }
}

/// Leaves the tie points and measurements that took part; gives what the effects move each by, px.
fn keep_adjusted(
    block: &mut Block,
    points: &HashMap<String, Vector3<f64>>,
    residuals: &Residuals<'_>,
) -> Vec<[f64; 2]> {
    let (mut kept, mut effects) = (Vec::new(), Vec::new());
    for tie in &block.ties {
        let position = points.get(&block.tie_points[tie.point.index()].name);
        let moved = position.zip(residuals.of_tie(block, tie));
        if let Some(moved) = moved.and_then(|(position, residual)| effect(block, tie, position, residual)) {
            kept.push(*tie);
            effects.push(moved);
        }
    }
    let mut used = vec![false; block.tie_points.len()];
    kept.iter().for_each(|tie| used[tie.point.index()] = true);
    let mut numbers = vec![PointId(0); used.len()];
    let mut tie_points = Vec::new();
    for (k, point) in block.tie_points.iter().enumerate().filter(|(k, _)| used[*k]) {
        numbers[k] = PointId::from(tie_points.len());
        tie_points.push(TiePoint { position: points.get(&point.name).copied(), ..point.clone() });
    }
    kept.iter_mut().for_each(|tie| tie.point = numbers[tie.point.index()]);
    (block.ties, block.tie_points) = (kept, tie_points);
    effects
}

/// Computed with the effects (observed minus residual) minus computed without, px.
fn effect(block: &Block, seen: &Measurement, point: &Vector3<f64>, residual: [f64; 2]) -> Option<[f64; 2]> {
    let interior: &Interior = &block.camera_of(seen.image).interior;
    let plain = project(interior, block.images[seen.image.index()].pose.cam_from_world(point).into())?;
    Some([seen.x - residual[0] - plain[0], seen.y - residual[1] - plain[1]])
}

/// A diagnosis split a camera of the block into two.
fn second_camera(dir: &Path, id: &str) -> Error {
    let problem =
        format!("the run has camera {id:?}, which the block lacks; make the block of the run by `misclosure mend`");
    Error::Read { path: dir.to_owned(), source: std::io::Error::new(std::io::ErrorKind::InvalidData, problem) }
}

fn stranger(dir: &Path, what: &str, name: &str) -> Error {
    let source = std::io::Error::new(
        std::io::ErrorKind::InvalidData,
        format!("the run has no {what} {name:?}; is this the block that it adjusted?"),
    );
    Error::Read { path: dir.to_owned(), source }
}
