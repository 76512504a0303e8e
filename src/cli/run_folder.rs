//! The folder that a run writes. Poses, points and their standard deviations are in the survey's system where a similarity took
//! the block there, else in the adjustment's own.

use super::summary::{Findings, theta_sigma};
use crate::adjust::Covariance;
use crate::block::{Block, Image, Role};
use crate::effects::Scope;
use crate::evaluate::Similarity;
use crate::io::table::{TableWriter, write_json};
use crate::io::{self, Error};
use crate::model::Model;
use crate::problem::{MeasurementKind, PointSource};
use nalgebra::Matrix3;
use std::path::Path;

/// Names of the sigma columns of `images.csv`: rotation `w` (rad), projection centre (m).
const POSE_SIGMAS: [&str; 6] = ["sigma_w1", "sigma_w2", "sigma_w3", "sigma_cx", "sigma_cy", "sigma_cz"];

/// Writes model, summary and tables into `dir`, which is made when it is not there; files of an older run are replaced.
///
/// # Errors
/// What cannot be written.
pub fn write(dir: &Path, model: &Model, findings: &Findings<'_>) -> Result<(), Error> {
    std::fs::create_dir_all(dir).map_err(|source| Error::Write { path: dir.to_owned(), source })?;
    let run = Run { findings: *findings, alignment: findings.comparison.and_then(|c| c.similarity) };
    io::model::write_model(model, &dir.join("model.toml"))?;
    io::block::write_images(&run.adjusted_block(), &dir.join("images.csv"))?;
    run.write_points(&dir.join("points.csv"))?;
    run.write_residuals(&dir.join("residuals.csv"))?;
    run.write_checks(&dir.join("checks.csv"))?;
    // Last: where it is, the run is complete.
    write_json(&dir.join("summary.json"), &findings.summary())
}

struct Run<'a> {
    findings: Findings<'a>,
    alignment: Option<Similarity>,
}

impl Run<'_> {
    /// Covariance and sigma0, where both are known.
    fn precision(&self) -> Option<(&Covariance, f64)> {
        self.findings.solution().covariance.as_ref().zip(self.findings.sigma0())
    }

    /// The block with the adjusted poses and, as further columns, their standard deviations and the values that effects have
    /// per image.
    fn adjusted_block(&self) -> Block {
        let alignment = self.alignment.unwrap_or_else(Similarity::identity);
        let poses = &self.findings.solution().state.poses;
        let images: Vec<Image> = (self.findings.block.images.iter().zip(poses))
            .map(|(image, pose)| Image { pose: alignment.apply_to_pose(pose), ..image.clone() })
            .collect();
        let mut extra = self.findings.block.extra_image_columns.clone();
        let mut add = |name: String, cells: Vec<Option<f64>>| {
            // A column of this name that came with the block would make the table ambiguous.
            extra.retain(|(other, _)| *other != name);
            extra.push((name, cells.into_iter().map(cell).collect()));
        };
        for (k, name) in POSE_SIGMAS.into_iter().enumerate() {
            add(name.into(), (0..images.len()).map(|i| self.pose_sigma(i, k)).collect());
        }
        let problem = self.findings.problem;
        for instance in &problem.effects {
            let descriptor = instance.effect.descriptor();
            for (p, (_, base)) in instance.slots.iter().enumerate().filter(|(_, slot)| slot.0 == Scope::Image) {
                let name = format!("{}.{}", descriptor.id, descriptor.parameters[p].name);
                let solution = self.findings.solution();
                let theta = |image: usize| *base as usize + image;
                let sigma = |t: usize| theta_sigma(problem, solution, self.findings.sigma0(), t);
                add(name.clone(), (0..images.len()).map(|i| Some(solution.state.theta[theta(i)])).collect());
                add(format!("sigma_{name}"), (0..images.len()).map(|i| sigma(theta(i))).collect());
            }
        }
        Block { images, extra_image_columns: extra, ..self.findings.block.clone() }
    }

    /// A-posteriori standard deviation of component `k` of pose `i`.
    fn pose_sigma(&self, i: usize, k: usize) -> Option<f64> {
        let (covariance, sigma0) = self.precision()?;
        let pose = covariance.poses.get(i)?;
        // The rotation `w` is in camera axes: no similarity changes it.
        let variance = match k {
            0..3 => pose[(k, k)],
            _ => self.align(&pose.fixed_view::<3, 3>(3, 3).into_owned())[(k - 3, k - 3)],
        };
        Some(sigma0 * variance.max(0.0).sqrt())
    }

    fn align(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        self.alignment.map_or(*covariance, |similarity| similarity.apply_to_covariance(covariance))
    }

    fn write_points(&self, path: &Path) -> Result<(), Error> {
        let mut table = TableWriter::create(path, &["point", "x", "y", "z", "sigma_x", "sigma_y", "sigma_z"])?;
        let alignment = self.alignment.unwrap_or_else(Similarity::identity);
        let problem = self.findings.problem;
        for (j, position) in self.findings.solution().state.points.iter().enumerate() {
            if let PointSource::Tie(_) = problem.point_sources[j] {
                let p = alignment.apply(position);
                table.text(&problem.point_names[j]).number(p.x).number(p.y).number(p.z);
                let sigma = self.precision().and_then(|(covariance, sigma0)| {
                    covariance.points.get(j).map(|c| self.align(c).diagonal().map(|v| sigma0 * v.max(0.0).sqrt()))
                });
                for k in 0..3 {
                    table.optional(sigma.map(|s| s[k]));
                }
                table.end_row()?;
            }
        }
        table.finish()
    }

    /// Every tie, the marks that took part, and the marks that were compared with afterwards.
    fn write_residuals(&self, path: &Path) -> Result<(), Error> {
        let header = ["image", "point", "kind", "x", "y", "rx", "ry", "sigma"];
        let mut table = TableWriter::create(path, &header)?;
        let Findings { problem, block, residuals, .. } = self.findings;
        for j in 0..problem.point_sources.len() {
            for n in problem.point_start[j]..problem.point_start[j + 1] {
                let observation = &problem.observations[n];
                let kind = match observation.kind {
                    MeasurementKind::Tie => "tie",
                    MeasurementKind::Mark => "mark",
                };
                let sigma = 1.0 / observation.inverse_sigma;
                table.text(&problem.image_names[observation.image as usize]).text(&problem.point_names[j]).text(kind);
                table.number(observation.x).number(observation.y);
                table.number(residuals[2 * n] * sigma).number(residuals[2 * n + 1] * sigma).number(sigma).end_row()?;
            }
        }
        let solved = |point: usize| problem.point_sources.contains(&PointSource::Control(point.into()));
        for intersection in self.findings.comparison.iter().flat_map(|c| &c.intersections.points) {
            let point = intersection.point;
            // Their residuals stand above.
            if block.surveyed[point.index()].role == Role::Control && solved(point.index()) {
                continue;
            }
            for (m, r) in intersection.measurements.iter().zip(&intersection.residuals) {
                let mark = &block.marks[*m];
                let sigma = mark.sigma.unwrap_or(block.sigma.mark_px);
                table
                    .text(&block.images[mark.image.index()].name)
                    .text(&block.surveyed[point.index()].name)
                    .text("mark");
                table.number(mark.x).number(mark.y).number(r.x).number(r.y).number(sigma).end_row()?;
            }
        }
        table.finish()
    }

    fn write_checks(&self, path: &Path) -> Result<(), Error> {
        let mut table = TableWriter::create(path, &["point", "role", "dx", "dy", "dz", "x", "y", "z"])?;
        for row in self.findings.comparison.iter().flat_map(|comparison| &comparison.rows) {
            let role = match row.role {
                Role::Control => "control",
                Role::Check => "check",
            };
            table.text(&self.findings.block.surveyed[row.point.index()].name).text(role);
            for value in row.d.iter().chain(row.position.iter()) {
                table.number(*value);
            }
            table.end_row()?;
        }
        table.finish()
    }
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:?}"))
}
