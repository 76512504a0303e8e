//! The folder that a run writes. Poses, points and their standard deviations are in the survey's system where a similarity took
//! the block there, else in the adjustment's own.

use super::structure_files;
use crate::adjust::Covariance;
use crate::block::{Block, Image, Role};
use crate::effects::Scope;
use crate::evaluate::Similarity;
use crate::io::table::{TableWriter, write_json};
use crate::io::{self, Error};
use crate::model::Model;
use crate::problem::PointSource;
use crate::run::summary::{Summary, sigma0, theta_sigma};
use crate::run::{ResidualKind, ResidualRow, Run};
use std::path::Path;

/// Names of the sigma columns of `images.csv`: rotation `w` (rad), projection centre (m).
const POSE_SIGMAS: [&str; 6] = ["sigma_w1", "sigma_w2", "sigma_w3", "sigma_cx", "sigma_cy", "sigma_cz"];

/// Writes model, summary and tables into `dir`, which is made when it is not there; files of an older run are replaced.
/// `rows` are the residuals of the run.
///
/// # Errors
/// What cannot be written.
pub fn write(dir: &Path, block: &Block, model: &Model, run: &Run, rows: &[ResidualRow]) -> Result<(), Error> {
    std::fs::create_dir_all(dir).map_err(|source| Error::Write { path: dir.to_owned(), source })?;
    let similarity = run.comparison.as_ref().and_then(|comparison| comparison.similarity);
    let folder = Folder { block, run, alignment: similarity.unwrap_or_else(Similarity::identity) };
    io::model::write_model(model, &dir.join("model.toml"))?;
    io::block::write_images(&folder.adjusted_block(), &dir.join("images.csv"))?;
    folder.write_points(&dir.join("points.csv"))?;
    folder.write_residuals(rows, &dir.join("residuals.csv"))?;
    folder.write_checks(&dir.join("checks.csv"))?;
    structure_files::remove(dir)?;
    structure_files::write_means(dir, block, rows)?;
    // Last: where it is, the run is complete.
    write_json(&dir.join("summary.json"), &Summary::of(block, run, rows))
}

struct Folder<'a> {
    block: &'a Block,
    run: &'a Run,
    alignment: Similarity,
}

impl Folder<'_> {
    /// Covariance and sigma0, where both are known.
    fn precision(&self) -> Option<(&Covariance, f64)> {
        self.run.solution().covariance.as_ref().zip(sigma0(self.run))
    }

    /// The block with the adjusted poses and, as further columns, their standard deviations and the values that effects have
    /// per image.
    fn adjusted_block(&self) -> Block {
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
        let problem = &self.run.problem;
        for instance in &problem.effects {
            let descriptor = instance.effect.descriptor();
            for (p, (_, base)) in instance.slots.iter().enumerate().filter(|(_, slot)| slot.0 == Scope::Image) {
                let name = format!("{}.{}", descriptor.id, descriptor.parameters[p].name);
                let solution = self.run.solution();
                let theta = |image: usize| *base as usize + image;
                let sigma = |t: usize| theta_sigma(problem, solution, sigma0(self.run), t);
                add(name.clone(), (0..images.len()).map(|i| Some(solution.state.theta[theta(i)])).collect());
                add(format!("sigma_{name}"), (0..images.len()).map(|i| sigma(theta(i))).collect());
            }
        }
        Block { images, extra_image_columns: extra, ..self.block.clone() }
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

    fn write_points(&self, path: &Path) -> Result<(), Error> {
        let problem = &self.run.problem;
        let tie = |j: usize| match problem.point_sources[j] {
            PointSource::Tie(id) => Some((id, j)),
            PointSource::Control(_) => None,
        };
        // The problem has them in an order of its own; a file has the block's.
        let mut ties: Vec<_> = (0..problem.point_sources.len()).filter_map(tie).collect();
        ties.sort_unstable();
        let mut table = TableWriter::create(path, &["point", "x", "y", "z", "sigma_x", "sigma_y", "sigma_z"])?;
        for (_, j) in ties {
            let position = self.alignment.apply(&self.run.solution().state.points[j]);
            table.text(&problem.point_names[j]).number(position.x).number(position.y).number(position.z);
            let sigma = self.precision().and_then(|(covariance, sigma0)| {
                let aligned = self.alignment.apply_to_covariance(covariance.points.get(j)?);
                Some(aligned.diagonal().map(|variance| sigma0 * variance.max(0.0).sqrt()))
            });
            for k in 0..3 {
                table.optional(sigma.map(|sigma| sigma[k]));
            }
            table.end_row()?;
        }
        table.finish()
    }

    fn write_residuals(&self, rows: &[ResidualRow], path: &Path) -> Result<(), Error> {
        let mut table = TableWriter::create(path, &["image", "point", "kind", "x", "y", "rx", "ry", "sigma"])?;
        for row in rows {
            let (point, kind) = match row.kind {
                ResidualKind::Tie => (&self.block.tie_points[row.point as usize].name, "tie"),
                ResidualKind::Mark => (&self.block.surveyed[row.point as usize].name, "mark"),
            };
            table.text(&self.block.images[row.image.index()].name).text(point).text(kind);
            for value in [row.observed[0], row.observed[1], row.residual[0], row.residual[1], row.sigma] {
                table.number(value);
            }
            table.end_row()?;
        }
        table.finish()
    }

    fn write_checks(&self, path: &Path) -> Result<(), Error> {
        let mut table = TableWriter::create(path, &["point", "role", "dx", "dy", "dz", "x", "y", "z"])?;
        for row in self.run.comparison.iter().flat_map(|comparison| &comparison.rows) {
            let role = match row.role {
                Role::Control => "control",
                Role::Check => "check",
            };
            table.text(&self.block.surveyed[row.point.index()].name).text(role);
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
