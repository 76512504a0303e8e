//! Results: an adjustment, or a diagnosis with the adjustment of the model that it hands on.

use crate::block::Block;
use crate::errors::{exception, input, raised};
use crate::run_tables::{checks, covariance, gnss, images, outliers, points, residuals};
use crate::table::Packed;
use anyhow::Context;
use misclosure::adjust::Solution;
use misclosure::block::TiePoint;
use misclosure::io::model::write_model;
use misclosure::model::Model;
use misclosure::problem::PointSource;
use misclosure::report::pictures::RunFolder;
use misclosure::report::run::{Coverage, page};
use misclosure::run::folder::{self, OutlierRow, Tables};
use misclosure::run::summary::Summary;
use misclosure::run::{ResidualRow, TieResiduals, gnss_residuals, residual_rows};
use misclosure::shared::{Adjusted, Exit, Found, Output, diagnosis_text, summary_text};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// What was computed.
pub enum Result {
    /// By an adjustment.
    Adjusted(Box<Adjusted>),
    /// By a diagnosis.
    Found(Box<Found>),
}

/// A result as an opaque object. A getter computes its table.
#[pyclass(frozen, module = "misclosure._native")]
pub struct Run {
    result: Result,
    /// What the program would have said on standard error.
    messages: Vec<String>,
    /// Folder of the block.
    source: Option<PathBuf>,
    rows: OnceLock<Vec<ResidualRow>>,
    tables: OnceLock<Tables>,
}

impl Run {
    pub fn new(result: Result, messages: Vec<String>, source: Option<PathBuf>) -> Self {
        Self { result, messages, source, rows: OnceLock::new(), tables: OnceLock::new() }
    }

    fn block(&self) -> &misclosure::block::Block {
        match &self.result {
            Result::Adjusted(own) => &own.block,
            Result::Found(own) => &own.diagnosed.block,
        }
    }

    fn run(&self) -> &misclosure::run::Run {
        match &self.result {
            Result::Adjusted(own) => &own.run,
            Result::Found(own) => &own.run,
        }
    }

    fn solution(&self) -> &Solution {
        self.run().solution()
    }

    fn of_model(&self) -> &Model {
        match &self.result {
            Result::Adjusted(own) => &own.model,
            Result::Found(own) => &own.model,
        }
    }

    fn outliers(&self) -> &[OutlierRow] {
        match &self.result {
            Result::Adjusted(own) => &own.outliers,
            Result::Found(own) => &own.outliers,
        }
    }

    fn rows(&self) -> anyhow::Result<&[ResidualRow]> {
        if let Some(rows) = self.rows.get() {
            return Ok(rows);
        }
        let run = self.run();
        let rows = residual_rows(self.block(), &run.problem, &self.solution().state, run.comparison.as_ref())?;
        Ok(self.rows.get_or_init(|| rows))
    }

    fn tables(&self) -> &Tables {
        self.tables.get_or_init(|| Tables::of(self.block(), self.of_model(), self.run()))
    }

    fn of_summary(&self) -> anyhow::Result<Summary> {
        Ok(Summary::of(self.block(), self.run(), self.rows()?))
    }

    fn put(&self, folder: &Path) -> anyhow::Result<()> {
        match &self.result {
            Result::Adjusted(own) => own.write(folder, self.source.as_deref()).map(drop),
            Result::Found(own) => own.write(folder, self.source.as_deref()),
        }
    }
}

#[pymethods]
impl Run {
    /// `summary.json`.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        let json = py.detach(|| anyhow::Ok(serde_json::to_string(&self.of_summary()?)?));
        json.map_err(|error| raised(py, &error))
    }

    /// `diagnosis.json`; `None` of an adjustment.
    fn diagnosis(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let Result::Found(found) = &self.result else { return Ok(None) };
        let json = serde_json::to_string(&found.diagnosed.diagnosis);
        json.map(Some).map_err(|error| raised(py, &error.into()))
    }

    /// What the program prints of it.
    fn text(&self, py: Python<'_>) -> PyResult<String> {
        let text = py.detach(|| {
            let summary = self.of_summary()?;
            anyhow::Ok(match &self.result {
                Result::Adjusted(_) => summary_text(&summary),
                Result::Found(own) => diagnosis_text(&own.diagnosed.diagnosis, summary.has_scale()),
            })
        });
        text.map_err(|error| raised(py, &error))
    }

    /// `model.toml`.
    fn model(&self, py: Python<'_>) -> PyResult<String> {
        let text = py.detach(|| {
            let folder = tempfile::tempdir().context("no temporary folder")?;
            let file = folder.path().join("model.toml");
            write_model(self.of_model(), &file)?;
            anyhow::Ok(std::fs::read_to_string(&file)?)
        });
        text.map_err(|error| raised(py, &error))
    }

    #[getter]
    fn messages(&self) -> Vec<String> {
        self.messages.clone()
    }

    /// The exception of a result that is none: solvers that disagree, blunders that bend it.
    fn failure(&self, py: Python<'_>) -> Option<PyErr> {
        let failure = match &self.result {
            Result::Adjusted(own) => &own.failure,
            Result::Found(own) => &own.failure,
        };
        failure.as_ref().map(|error| raised(py, error))
    }

    /// One of the result's tables.
    fn table<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Packed<'py>> {
        let failed = |error: anyhow::Error| raised(py, &error);
        let block = self.block();
        match name {
            "residuals" => residuals(py.detach(|| self.rows()).map_err(failed)?).packed(py),
            "images" => images(py.detach(|| self.tables())).packed(py),
            "points" => points(py.detach(|| self.tables())).packed(py),
            "checks" => checks(py.detach(|| self.tables())).packed(py),
            "covariance" => covariance(py.detach(|| self.tables())).packed(py),
            "outliers" => outliers(self.outliers()).packed(py),
            "gnss" => {
                let run = self.run();
                let rows = gnss_residuals(block, &run.problem, &self.solution().state, run.comparison.as_ref());
                let rows = rows.map_err(|error| failed(error.into()))?;
                let rows: Vec<_> = folder::gnss_rows(block, &rows).collect();
                gnss(&rows).packed(py)
            }
            _ => Err(input(py, &format!("no table {name:?}"))),
        }
    }

    /// The block with the adjusted cameras, poses and points.
    fn adjusted(&self) -> Block {
        let (own, tables) = (self.block(), self.tables());
        let mut block = misclosure::block::Block::clone(own).about(nalgebra::Vector3::zeros());
        block.images.iter_mut().zip(&tables.images.images).for_each(|(own, image)| own.pose = image.pose);
        let problem = &self.run().problem;
        let interiors = &self.solution().state.interiors;
        block.cameras.iter_mut().zip(interiors).for_each(|(camera, interior)| camera.interior = *interior);
        // Rows are in the order of the block's points, those that took part alone.
        let mut places = vec![None; block.tie_points.len()];
        let mut ids: Vec<_> = problem
            .point_sources
            .iter()
            .filter_map(|of| match of {
                PointSource::Tie(id) => Some(id.index()),
                PointSource::Control(_) => None,
            })
            .collect();
        ids.sort_unstable();
        ids.iter()
            .zip(&tables.points)
            .for_each(|(id, row)| places[*id] = Some(nalgebra::Vector3::new(row.x, row.y, row.z)));
        let set = |(point, place): (&mut TiePoint, Option<_>)| point.position = place;
        block.tie_points.iter_mut().zip(places).for_each(set);
        Block::adjusted(block)
    }

    /// Writes what the program writes of it.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let written = py.detach(|| {
            // Of a block in memory: a path that lies nowhere near.
            let nowhere = Path::new("/nonexistent/block");
            let output = Output::of_run(&folder, self.source.as_deref().unwrap_or(nowhere))?;
            output.write(&folder::FILES, folder::SUMMARY, |dir| self.put(dir))
        });
        written.map_err(|error| raised(py, &error))
    }

    /// Ids and SVG texts of the report's pictures, and the report.
    fn report(&self, py: Python<'_>) -> PyResult<(Vec<(String, String)>, String)> {
        let made = py.detach(|| {
            let folder = tempfile::tempdir().context("no temporary folder for the report")?;
            self.put(folder.path())?;
            let run = RunFolder::read(folder.path())?;
            let ties = TieResiduals::of(self.block(), self.rows()?);
            let page = page(&run, ties, &Coverage::read(folder.path())?);
            anyhow::Ok((page.figures().to_vec(), page.html()))
        });
        made.map_err(|error| raised(py, &error))
    }

    /// Names of rows, for positions in tables.
    fn names(&self, py: Python<'_>, of: &str) -> PyResult<Vec<String>> {
        let block = self.block();
        Ok(match of {
            "images" => block.images.iter().map(|image| image.name.clone()).collect(),
            "points" => block.tie_points.iter().map(|point| point.name.clone()).collect(),
            "control" => block.surveyed.iter().map(|point| point.name.clone()).collect(),
            _ => return Err(exception(py, "InternalError", &format!("no names of {of}"), Exit::Other as u8)),
        })
    }
}
