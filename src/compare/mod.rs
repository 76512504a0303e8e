//! Runs side by side: each against the first, in cameras, poses, points and findings.
//!
//! ```text
//! run folders ──► figures of each ──► table, JSON, page (report::compare)
//!             └─► differences to the first: cameras (fields over the sensor), images, tie points, check points
//! ```

pub mod cameras;
pub mod places;

use crate::camera::{Interior, PARAMETERS};
use crate::diagnose::verdict::{Diagnosis, EstimateEntry, Verdict};
use crate::evaluate::Similarity;
use crate::io;
use crate::run::folder::{RunFolder, read_points};
use cameras::{CameraDifference, difference};
use nalgebra::Vector3;
use places::{Distances, Places, aligning, distances, rotations_mrad};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One run.
#[derive(Debug, Clone, Serialize)]
pub struct RunFigures {
    /// Its folder, as it was named.
    pub run: String,
    /// Name of its block.
    pub block: String,
    /// Of a diagnosis.
    pub verdict: Option<Verdict>,
    /// What a diagnosis found, with the sizes of the parameters; of an adjustment the effects of its model.
    pub effects: BTreeMap<String, BTreeMap<String, EstimateEntry>>,
    /// `sqrt(v'Pv / redundancy)`.
    pub sigma0: Option<f64>,
    /// Per coordinate, px.
    pub tie_rms_px: Option<f64>,
    /// Control points, 3D RMS, m.
    pub control_rms_m: Option<f64>,
    /// Check points, 3D RMS, m.
    pub check_rms_m: Option<f64>,
    /// The same in height.
    pub check_height_m: Option<f64>,
    /// Kinds of the mistakes of people that were found.
    pub mistakes: Vec<String>,
    /// Has it a scale? Without one its metres are those of the start values.
    pub scaled: bool,
}

/// A run against the first one.
#[derive(Debug, Clone, Serialize)]
pub struct RunDifference {
    /// The run.
    pub run: String,
    /// The first one.
    pub against: String,
    /// Cameras in common.
    pub cameras: Vec<CameraDifference>,
    /// Cameras in common that cannot be compared, with the reason.
    pub not_compared: BTreeMap<String, String>,
    /// Projection centres.
    pub images: Option<Distances>,
    /// RMS of the rotations between the images, mrad.
    pub rotation_rms_mrad: Option<f64>,
    /// Tie points.
    pub points: Option<Distances>,
    /// Check points, by their differences to the survey.
    pub check_points: Option<Distances>,
    /// Were images and points compared after a similarity? They are where one of the two runs has no scale.
    pub after_similarity: bool,
}

/// Runs side by side.
#[derive(Debug, Clone, Serialize)]
pub struct Compared {
    /// Every run, in the order in which they were named.
    pub runs: Vec<RunFigures>,
    /// Every run but the first against the first.
    pub differences: Vec<RunDifference>,
}

/// What is read of a run.
struct Read {
    path: PathBuf,
    folder: RunFolder<Diagnosis>,
    ties: Places,
}

impl Read {
    fn of(path: &Path) -> Result<Self, io::Error> {
        let folder = RunFolder::read(path)?;
        let ties = read_points(path)?.into_iter().map(|row| (row.point, Vector3::new(row.x, row.y, row.z))).collect();
        Ok(Self { path: path.to_owned(), folder, ties })
    }

    fn name(&self) -> String {
        self.path.display().to_string()
    }

    fn centres(&self) -> Places {
        self.folder.images.iter().map(|row| (row.image.clone(), Vector3::new(row.x, row.y, row.z))).collect()
    }

    /// Computed less surveyed coordinates of the check points: the survey cancels in a difference.
    fn checks(&self) -> Places {
        let checks = self.folder.checks.iter().filter(|row| row.role == "check");
        checks.map(|row| (row.point.clone(), Vector3::new(row.dx, row.dy, row.dz))).collect()
    }

    fn sensor(&self, camera: &str) -> Option<[f64; 2]> {
        self.folder.sensor.iter().find(|row| row.camera == camera).map(|row| [row.width_px, row.height_px])
    }

    fn interior(&self, camera: &str) -> Option<Interior> {
        let (_, named) = self.folder.summary.cameras.0.iter().find(|(name, _)| name == camera)?;
        let mut interior = [f64::NAN; PARAMETERS.len()];
        for (value, wanted) in interior.iter_mut().zip(PARAMETERS) {
            *value = named.0.iter().find(|(name, _)| name == wanted)?.1.value;
        }
        Some(interior)
    }

    fn figures(&self) -> RunFigures {
        let (summary, diagnosis) = (&self.folder.summary, self.folder.diagnosis.as_ref());
        let effects = match diagnosis {
            Some(diagnosis) => diagnosis.found.iter().map(|f| (f.effect.clone(), f.estimate.clone())).collect(),
            None => self.of_model(),
        };
        let mistakes = diagnosis.map_or(&summary.mistakes, |diagnosis| &diagnosis.mistakes);
        RunFigures {
            run: self.name(),
            block: summary.block.clone(),
            verdict: diagnosis.map(|diagnosis| diagnosis.verdict),
            effects,
            sigma0: summary.sigma0,
            tie_rms_px: summary.tie_rms_px,
            control_rms_m: summary.control.as_ref().map(|control| control.rms_m.xyz),
            check_rms_m: summary.check.as_ref().map(|check| check.rms_m.xyz),
            check_height_m: summary.check.as_ref().map(|check| check.rms_m.z),
            mistakes: mistakes.iter().map(|mistake| mistake.kind.to_string()).collect(),
            scaled: summary.has_scale(),
        }
    }

    /// The effects of an adjustment.
    fn of_model(&self) -> BTreeMap<String, BTreeMap<String, EstimateEntry>> {
        let entry = |of: &crate::run::summary::EffectParameter| EstimateEntry {
            value: of.value,
            sigma: of.sigma.unwrap_or(f64::NAN),
            unit: of.unit.clone(),
        };
        let effects = self.folder.summary.effects.0.iter();
        effects
            .map(|(effect, parameters)| {
                (effect.clone(), parameters.0.iter().map(|(name, of)| (name.clone(), entry(of))).collect())
            })
            .collect()
    }
}

/// Reads runs and compares each with the first.
///
/// # Errors
/// A folder that cannot be read.
pub fn compare(paths: &[PathBuf]) -> Result<Compared, io::Error> {
    let runs: Vec<Read> = paths.iter().map(|path| Read::of(path)).collect::<Result<_, _>>()?;
    let differences = match runs.split_first() {
        Some((first, others)) => others.iter().map(|run| against(first, run)).collect(),
        None => Vec::new(),
    };
    Ok(Compared { runs: runs.iter().map(Read::figures).collect(), differences })
}

fn against(first: &Read, run: &Read) -> RunDifference {
    let (mut cameras, mut not_compared) = (Vec::new(), BTreeMap::new());
    for (camera, _) in &run.folder.summary.cameras.0 {
        let (Some(a), Some(b)) = (first.interior(camera), run.interior(camera)) else { continue };
        let compared = match (first.sensor(camera), run.sensor(camera)) {
            (Some(one), Some(other)) if one == other => {
                difference(camera, one, &a, &b).map_err(|error| error.to_string())
            }
            (Some(_), Some(_)) => Err("the two runs have sensors of different sizes".into()),
            _ => Err("a run without tie points does not tell the size of the sensor".into()),
        };
        match compared {
            Ok(of) => cameras.push(of),
            Err(reason) => {
                not_compared.insert(camera.clone(), reason);
            }
        }
    }
    let after_similarity = !(first.folder.summary.has_scale() && run.folder.summary.has_scale());
    let (before, after) = (first.centres(), run.centres());
    // Tie points hold the shape of a block better than its images do.
    let alignment = match after_similarity {
        true => aligning(&first.ties, &run.ties).or_else(|| aligning(&before, &after)),
        false => Some(Similarity::identity()),
    };
    let rotation = alignment.map_or_else(Default::default, |alignment| alignment.rotation);
    let poses: BTreeMap<&str, _> =
        first.folder.images.iter().map(|row| (row.image.as_str(), row.pose().rotation)).collect();
    // World to camera: a similarity of the world turns it from the right.
    let turned: Vec<_> = run
        .folder
        .images
        .iter()
        .filter_map(|row| Some((*poses.get(row.image.as_str())?, row.pose().rotation * rotation.inverse())))
        .collect();
    let images = alignment.and_then(|alignment| distances(&before, &after, &alignment));
    RunDifference {
        run: run.name(),
        against: first.name(),
        cameras,
        not_compared,
        rotation_rms_mrad: images.as_ref().map(|_| rotations_mrad(turned.iter().map(|(a, b)| (a, b)))),
        images,
        points: alignment.and_then(|alignment| distances(&first.ties, &run.ties, &alignment)),
        check_points: distances(&first.checks(), &run.checks(), &Similarity::identity()),
        after_similarity,
    }
}
