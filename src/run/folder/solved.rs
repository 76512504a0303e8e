//! Rows of the solution: images and tie points, with their standard deviations.

use super::rows::PointRow;
use crate::adjust::Covariance;
use crate::block::{Block, Image};
use crate::camera::F;
use crate::effects::Scope;
use crate::evaluate::Similarity;
use crate::geodesy::survey::SurveySystem;
use crate::model::Model;
use crate::problem::PointSource;
use crate::run::Run;
use crate::run::summary::{sigma0, theta_sigma};
use nalgebra::Vector3;

/// Names of the sigma columns of `images.csv`: rotation `w` (rad), projection centre (m).
const POSE_SIGMAS: [&str; 6] = ["sigma_w1", "sigma_w2", "sigma_w3", "sigma_cx", "sigma_cy", "sigma_cz"];

/// A solution as its tables have it: aligned with the survey.
pub(super) struct Solved<'a> {
    pub(super) block: &'a Block,
    pub(super) model: &'a Model,
    pub(super) run: &'a Run,
    alignment: Similarity,
    /// Where the survey came in another system than that of the block.
    survey: Option<SurveySystem>,
    pub(super) sigma0: Option<f64>,
}

impl<'a> Solved<'a> {
    pub(super) fn of(block: &'a Block, model: &'a Model, run: &'a Run) -> Self {
        let similarity = run.comparison.as_ref().and_then(|comparison| comparison.similarity);
        let alignment = similarity.unwrap_or_else(Similarity::identity);
        let survey = SurveySystem::of(&block.crs, &block.survey_crs);
        Self { block, model, run, alignment, survey, sigma0: sigma0(run) }
    }

    /// Easting, northing and height in the system of the survey; nothing where that is the block's.
    pub(super) fn in_survey(&self, at: &Vector3<f64>) -> [Option<f64>; 3] {
        let coordinates = self.survey.as_ref().and_then(|survey| survey.coordinates(at));
        coordinates.map_or([None; 3], |values| values.map(Some))
    }

    /// Covariance and sigma0, where both are known.
    pub(super) fn precision(&self) -> Option<(&Covariance, f64)> {
        self.run.solution().covariance.as_ref().zip(self.sigma0)
    }

    /// The images with the adjusted poses and, as further columns, their standard deviations and the values that
    /// effects have per image.
    pub(super) fn adjusted_images(&self) -> Block {
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

    pub(super) fn points(&self) -> impl Iterator<Item = PointRow> {
        let problem = &self.run.problem;
        let tie = |j: usize| match problem.point_sources[j] {
            PointSource::Tie(id) => Some((id, j)),
            PointSource::Control(_) => None,
        };
        // The problem sorts points along the block; the file keeps the order of the block's table.
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
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:?}"))
}
