//! A run folder, written.

use super::rows::{
    CheckRow, FoundRow, GnssRow, ImageRow, ImageScaleRow, ModelCheckRow, OutlierRow, PointRow, ProfileRow,
    ResidualLine, Row, SensorRow,
};
use super::{DIAGNOSIS, FINAL, MODEL, SUMMARY, covariance};
use crate::adjust::Covariance;
use crate::block::{Block, Image, Role};
use crate::camera::F;
use crate::effects::Scope;
use crate::evaluate::intersection::Intersection;
use crate::evaluate::{Comparison, Similarity, checks};
use crate::geodesy::survey::SurveySystem;
use crate::io::table::{TableWriter, write_json};
use crate::io::{self, Error};
use crate::model::Model;
use crate::problem::PointSource;
use crate::run::summary::{Summary, sigma0, theta_sigma};
use crate::run::{GnssResidual, ResidualKind, ResidualRow, Run, cell_means};
use nalgebra::Vector3;
use serde::Serialize;
use std::path::Path;

/// Names of the sigma columns of `images.csv`: rotation `w` (rad), projection centre (m).
const POSE_SIGMAS: [&str; 6] = ["sigma_w1", "sigma_w2", "sigma_w3", "sigma_cx", "sigma_cy", "sigma_cz"];

/// What the pictures of a diagnosis are drawn from; stage [`super::BASE`] before effects were added, [`super::FINAL`] after.
#[derive(Debug, Clone, Default)]
pub struct Pictures {
    /// Mean residuals over the sensor.
    pub sensor: Vec<SensorRow>,
    /// Scale residuals per image.
    pub scales: Vec<ImageScaleRow>,
    /// Pictures of the effects that were found.
    pub found: Vec<FoundRow>,
    /// Mean residuals against what was recorded.
    pub profiles: Vec<ProfileRow>,
    /// Surveyed points before effects were added and after; empty where none were.
    pub checks: Vec<ModelCheckRow>,
}

/// Writes model, summary and tables into `dir`, which is made when it is not there; files of an older run are replaced.
/// `rows` are the residuals of the run, `gnss` those of the GNSS positions.
///
/// # Errors
/// What cannot be written.
pub fn write(
    dir: &Path,
    block: &Block,
    model: &Model,
    run: &Run,
    rows: &[ResidualRow],
    gnss: &[GnssResidual],
) -> Result<(), Error> {
    std::fs::create_dir_all(dir).map_err(|source| Error::Write { path: dir.to_owned(), source })?;
    let similarity = run.comparison.as_ref().and_then(|comparison| comparison.similarity);
    let alignment = similarity.unwrap_or_else(Similarity::identity);
    let survey = SurveySystem::of(&block.crs, &block.survey_crs);
    let folder = Folder { block, model, run, alignment, survey, sigma0: sigma0(run) };
    io::model::write_model(model, &dir.join(MODEL))?;
    io::block::write_images(&folder.adjusted_images(), &dir.join(ImageRow::FILE))?;
    write_rows(dir, folder.points())?;
    write_rows(dir, lines(block, rows))?;
    write_rows(dir, folder.checks())?;
    let covariance = folder.precision().map(|(covariance, sigma0)| covariance::rows(&run.problem, covariance, sigma0));
    write_rows(dir, covariance.into_iter().flatten())?;
    write_rows(dir, gnss_rows(block, gnss))?;
    remove_diagnosis(dir)?;
    write_rows(dir, sensor_means(block, rows))?;
    // Last: where it is, the run is complete.
    write_json(&dir.join(SUMMARY), &Summary::of(block, run, rows))
}

/// Writes residuals alone: all that there is to say of an adjustment that failed.
///
/// # Errors
/// What cannot be written.
pub fn write_residuals(dir: &Path, block: &Block, rows: &[ResidualRow]) -> Result<(), Error> {
    write_rows(dir, lines(block, rows))
}

/// Adds to the folder of a run what was set aside before it was adjusted.
///
/// # Errors
/// What cannot be written.
pub fn write_outliers(dir: &Path, rows: Vec<OutlierRow>) -> Result<(), Error> {
    write_rows(dir, rows.into_iter())
}

/// Adds to the folder of a run what a diagnosis found; its means over the sensor replace those of the run.
///
/// # Errors
/// What cannot be written.
pub fn write_diagnosis<D: Serialize>(dir: &Path, diagnosis: &D, pictures: Pictures) -> Result<(), Error> {
    write_json(&dir.join(DIAGNOSIS), diagnosis)?;
    write_rows(dir, pictures.sensor.into_iter())?;
    write_rows(dir, pictures.scales.into_iter())?;
    write_rows(dir, pictures.found.into_iter())?;
    write_rows(dir, pictures.profiles.into_iter())?;
    match pictures.checks.is_empty() {
        true => Ok(()),
        false => write_rows(dir, pictures.checks.into_iter()),
    }
}

/// Removes what only a diagnosis writes, so that an adjustment into the folder of an older one is not taken for it.
fn remove_diagnosis(dir: &Path) -> Result<(), Error> {
    for name in [DIAGNOSIS, ImageScaleRow::FILE, ProfileRow::FILE, FoundRow::FILE, ModelCheckRow::FILE] {
        let path = dir.join(name);
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => return Err(Error::Write { path, source }),
            _ => {}
        }
    }
    Ok(())
}

pub(super) fn write_rows<R: Row>(dir: &Path, rows: impl Iterator<Item = R>) -> Result<(), Error> {
    let mut table = TableWriter::create(&dir.join(R::FILE), R::COLUMNS)?;
    for row in rows {
        row.put(&mut table);
        table.end_row()?;
    }
    table.finish()
}

/// Mean tie residuals over the sensor, without tests.
fn sensor_means<'a>(block: &'a Block, rows: &'a [ResidualRow]) -> impl Iterator<Item = SensorRow> + 'a {
    block.cameras.iter().enumerate().flat_map(move |(c, camera)| {
        let size = [f64::from(camera.width_px), f64::from(camera.height_px)];
        let of_camera = move |row: &&ResidualRow| {
            row.kind == ResidualKind::Tie && block.images[row.image.index()].camera.index() == c
        };
        let cells = cell_means(size, rows.iter().filter(of_camera).map(|row| (row.observed, row.residual)));
        cells.into_iter().map(move |cell| SensorRow {
            stage: FINAL.into(),
            camera: camera.id.clone(),
            width_px: size[0],
            height_px: size[1],
            x: cell.centre[0],
            y: cell.centre[1],
            n: cell.n,
            dx: cell.mean[0],
            dy: cell.mean[1],
            p_value: None,
        })
    })
}

struct Folder<'a> {
    block: &'a Block,
    model: &'a Model,
    run: &'a Run,
    alignment: Similarity,
    /// Where the survey came in another system than that of the block.
    survey: Option<SurveySystem>,
    sigma0: Option<f64>,
}

impl Folder<'_> {
    /// Easting, northing and height in the system of the survey; nothing where that is the block's.
    fn in_survey(&self, at: &Vector3<f64>) -> [Option<f64>; 3] {
        let coordinates = self.survey.as_ref().and_then(|survey| survey.coordinates(at));
        coordinates.map_or([None; 3], |values| values.map(Some))
    }

    /// Covariance and sigma0, where both are known.
    fn precision(&self) -> Option<(&Covariance, f64)> {
        self.run.solution().covariance.as_ref().zip(self.sigma0)
    }

    /// The images with the adjusted poses and, as further columns, their standard deviations and the values that effects have
    /// per image.
    fn adjusted_images(&self) -> Block {
        let poses = &self.run.solution().state.poses;
        let images: Vec<Image> = (self.block.images.iter().zip(poses))
            .map(|(image, pose)| Image { pose: self.alignment.apply_to_pose(pose), ..image.clone() })
            .collect();
        let mut extra = self.block.extra_image_columns.clone();
        let mut add = |name: String, cells: Vec<Option<f64>>| {
            // A column of this name that came with the block would make the table ambiguous.
            extra.retain(|(other, _)| *other != name);
            extra.push((name, cells.into_iter().map(cell).collect()));
        };
        for (k, name) in POSE_SIGMAS.into_iter().enumerate() {
            add(name.into(), (0..images.len()).map(|i| self.pose_sigma(i, k)).collect());
        }
        if self.survey.is_some() {
            let places: Vec<[Option<f64>; 3]> =
                images.iter().map(|image| self.in_survey(&(image.pose.centre + self.block.origin))).collect();
            for (k, name) in ["easting", "northing", "height"].into_iter().enumerate() {
                add(name.into(), places.iter().map(|place| place[k]).collect());
            }
        }
        let problem = &self.run.problem;
        for instance in &problem.effects {
            let descriptor = instance.effect.descriptor();
            for (p, (_, base)) in instance.slots.iter().enumerate().filter(|(_, slot)| slot.0 == Scope::Image) {
                let name = format!("{}.{}", descriptor.id, descriptor.parameters[p].name);
                let solution = self.run.solution();
                let theta = |image: usize| *base as usize + image;
                let sigma = |t: usize| theta_sigma(problem, solution, self.sigma0, t);
                add(name.clone(), (0..images.len()).map(|i| Some(solution.state.theta[theta(i)])).collect());
                add(format!("sigma_{name}"), (0..images.len()).map(|i| sigma(theta(i))).collect());
            }
        }
        Block { images, extra_image_columns: extra, ..self.block.images_alone() }.about(Vector3::zeros())
    }

    /// A-posteriori standard deviation of component `k` of pose `i`.
    fn pose_sigma(&self, i: usize, k: usize) -> Option<f64> {
        let (covariance, sigma0) = self.precision()?;
        let pose = covariance.poses.get(i)?;
        // The rotation `w` is in camera axes: no similarity changes it.
        let variance = match k {
            0..3 => pose[(k, k)],
            _ => self.alignment.apply_to_covariance(&pose.fixed_view::<3, 3>(3, 3).into_owned())[(k - 3, k - 3)],
        };
        Some(sigma0 * variance.max(0.0).sqrt())
    }

    fn points(&self) -> impl Iterator<Item = PointRow> {
        let problem = &self.run.problem;
        let tie = |j: usize| match problem.point_sources[j] {
            PointSource::Tie(id) => Some((id, j)),
            PointSource::Control(_) => None,
        };
        // The problem has them in an order of its own; a file has the block's.
        let mut ties: Vec<_> = (0..problem.point_sources.len()).filter_map(tie).collect();
        ties.sort_unstable();
        ties.into_iter().map(|(_, j)| {
            let position = self.alignment.apply(&self.run.solution().state.points[j]) + self.block.origin;
            let sigma = self.precision().and_then(|(covariance, sigma0)| {
                let aligned = self.alignment.apply_to_covariance(covariance.points.get(j)?);
                Some(aligned.diagonal().map(|variance| sigma0 * variance.max(0.0).sqrt()))
            });
            let [easting, northing, height] = self.in_survey(&position);
            let correlation = self.precision().and_then(|(covariance, _)| {
                let aligned = self.alignment.apply_to_covariance(covariance.points.get(j)?);
                Some(aligned[(0, 1)] / (aligned[(0, 0)] * aligned[(1, 1)]).sqrt()).filter(|r| r.is_finite())
            });
            let rows = problem.point_start[j]..problem.point_start[j + 1];
            PointRow {
                point: problem.point_names[j].clone(),
                x: position.x,
                y: position.y,
                z: position.z,
                sigma_x: sigma.map(|sigma| sigma.x),
                sigma_y: sigma.map(|sigma| sigma.y),
                sigma_z: sigma.map(|sigma| sigma.z),
                images: Some(rows.len()),
                gsd_m: self.gsd(j, rows),
                correlation_xy: correlation,
                easting,
                northing,
                height,
            }
        })
    }

    /// Depth over the focal length of point `j`, mean of its measurements `rows`, m per px.
    fn gsd(&self, j: usize, rows: std::ops::Range<usize>) -> Option<f64> {
        let state = &self.run.solution().state;
        let n = rows.len() as f64;
        let of = |row: usize| {
            let image = self.run.problem.observations[row].image as usize;
            let pose = &state.poses[image];
            let depth = (pose.rotation * (state.points[j] - pose.centre)).z;
            depth / state.interiors[self.block.images[image].camera.index()][F]
        };
        Some(self.alignment.scale * rows.map(of).sum::<f64>() / n).filter(|gsd| gsd.is_finite())
    }

    fn checks(&self) -> impl Iterator<Item = CheckRow> {
        let comparison = self.run.comparison.iter();
        let rows = comparison.flat_map(|comparison| comparison.rows.iter().zip(&comparison.intersections.points));
        rows.map(|(row, seen)| {
            let Surveyed { point, role, d, at } = Surveyed::of(self.block, row);
            // A survey without a stated precision has an infinite one.
            let sigma = self.sigma0.map(|sigma0| self.check_sigma(row, seen, sigma0));
            let sigma = |k: usize| sigma.map(|sigma| sigma[k]).filter(|sigma| sigma.is_finite());
            let [easting, northing, height] = self.in_survey(&at);
            let squares: f64 = seen.residuals.iter().map(|residual| residual.norm_squared()).sum();
            CheckRow {
                point,
                role,
                dx: d.x,
                dy: d.y,
                dz: d.z,
                x: at.x,
                y: at.y,
                z: at.z,
                sigma_dx: sigma(0),
                sigma_dy: sigma(1),
                sigma_dz: sigma(2),
                images: Some(seen.residuals.len()),
                rms_px: Some((squares / (2.0 * seen.residuals.len() as f64)).sqrt()).filter(|rms| rms.is_finite()),
                easting,
                northing,
                height,
            }
        })
    }

    /// Standard deviations of computed minus surveyed: of the point's own marks, as precise as the adjustment found
    /// them, and of its survey. Errors that cameras and poses have in common are no part of it.
    fn check_sigma(&self, row: &checks::CheckRow, seen: &Intersection, sigma0: f64) -> Vector3<f64> {
        let (block, factors) = (self.block, &self.model.sigma_factors);
        let of_flight = |mark: &usize| {
            let flight = &block.flights[block.images[block.marks[*mark].image.index()].flight.index()];
            self.model.flight_factors.get(flight).map_or(1.0, |factors| factors.image).powi(2)
        };
        let of_flights = seen.measurements.iter().map(of_flight).sum::<f64>() / seen.measurements.len() as f64;
        let marks = row.covariance.diagonal() * ((sigma0 * factors.image * factors.mark).powi(2) * of_flights);
        let own = &block.surveyed[row.point.index()];
        let xy = factors.control * own.sigma_xy.unwrap_or(block.sigma.control_xy_m);
        let z = factors.control_z * own.sigma_z.unwrap_or(block.sigma.control_z_m);
        (marks + Vector3::new(xy, xy, z).map(|sigma| sigma * sigma)).map(|variance| variance.max(0.0).sqrt())
    }
}

/// The columns that every table of surveyed points has.
struct Surveyed {
    point: String,
    role: String,
    d: Vector3<f64>,
    at: Vector3<f64>,
}

impl Surveyed {
    fn of(block: &Block, row: &checks::CheckRow) -> Self {
        let role = match row.role {
            Role::Control => "control",
            Role::Check => "check",
        };
        let point = block.surveyed[row.point.index()].name.clone();
        Self { point, role: role.into(), d: row.d, at: row.position + block.origin }
    }
}

/// Surveyed points against the block at one stage of a diagnosis.
pub fn checks_by_model(block: &Block, comparison: &Comparison, stage: &str) -> Vec<ModelCheckRow> {
    let row = |row: &checks::CheckRow| {
        let Surveyed { point, role, d, at } = Surveyed::of(block, row);
        ModelCheckRow { stage: stage.into(), point, role, dx: d.x, dy: d.y, dz: d.z, x: at.x, y: at.y, z: at.z }
    };
    comparison.rows.iter().map(row).collect()
}

fn lines(block: &Block, rows: &[ResidualRow]) -> impl Iterator<Item = ResidualLine> {
    rows.iter().map(move |row| {
        let (point, kind) = match row.kind {
            ResidualKind::Tie => (&block.tie_points[row.point as usize].name, "tie"),
            ResidualKind::Mark => (&block.surveyed[row.point as usize].name, "mark"),
        };
        ResidualLine {
            image: block.images[row.image.index()].name.clone(),
            point: point.clone(),
            kind: kind.into(),
            x: row.observed[0],
            y: row.observed[1],
            rx: row.residual[0],
            ry: row.residual[1],
            sigma: row.sigma,
        }
    })
}

/// Residuals of GNSS positions as they stand in the file, in the survey's system.
pub fn gnss_rows<'a>(block: &'a Block, gnss: &'a [GnssResidual]) -> impl Iterator<Item = GnssRow> + 'a {
    let known = |value: f64| Some(value).filter(|value| value.is_finite());
    gnss.iter().map(move |row| {
        let position = row.position + block.origin;
        GnssRow {
            image: block.images[row.image.index()].name.clone(),
            dx: row.d.x,
            dy: row.d.y,
            dz: row.d.z,
            x: position.x,
            y: position.y,
            z: position.z,
            time_s: known(row.time_s),
            heading_deg: known(row.heading_deg),
        }
    })
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:?}"))
}

#[cfg(test)]
mod tests {
    use super::super::read::rows;
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let row = ImageScaleRow {
            stage: FINAL.into(),
            image: "a, \"b\"".into(),
            flight: "1".into(),
            scale_px: Some(0.1 + 0.2),
            sigma_px: None,
        };
        write_rows(dir.path(), std::iter::once(row.clone())).unwrap();
        assert_eq!(rows::<ImageScaleRow>(&dir.path().join("image_scale.csv"), ImageScaleRow::COLUMNS).unwrap(), [row]);
    }

    #[test]
    fn a_diagnosis_of_an_older_run_goes() {
        let dir = tempfile::tempdir().unwrap();
        write_diagnosis(dir.path(), &"found", Pictures::default()).unwrap();
        let files = || {
            let mut names: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        assert_eq!(files(), ["diagnosis.json", "found.csv", "image_scale.csv", "profiles.csv", "sensor.csv"]);
        remove_diagnosis(dir.path()).unwrap();
        assert_eq!(files(), ["sensor.csv"]);
    }
}
