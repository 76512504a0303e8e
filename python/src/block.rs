//! A block as an opaque object: where it comes from, its tables, and what can be done with it.

use crate::block_tables::{cameras, control, images, measurements, points};
use crate::errors::{input, raised};
use crate::figure::plan_and_profile;
use crate::job::work;
use crate::made::made;
use crate::run::{Result, Run};
use crate::simulated::{disturb, measured_again, read_scenario};
use crate::table::Packed;
use anyhow::Context;
use misclosure::block::Sigma;
use misclosure::diagnose::handed_on::Keep;
use misclosure::inject::mistakes;
use misclosure::io::block::{BLOCK_FILE, Loaded, SetAside, read_block, write_block};
use misclosure::io::foreign::{ExportOptions, ImportOptions, registry};
use misclosure::scenario::simulate;
use misclosure::shared::{self, Output, Usage};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folder of the truth, in a block.
const TRUTH: &str = "truth";

/// What was measured.
#[pyclass(frozen, module = "misclosure._native")]
#[derive(Clone)]
pub struct Block {
    block: Arc<misclosure::block::Block>,
    /// Of a simulated block.
    truth: Option<Arc<misclosure::block::Block>>,
    set_aside: SetAside,
    /// Folder that it was read from, as it is.
    source: Option<PathBuf>,
    /// What an import guessed or lost.
    notes: Vec<String>,
}

impl Block {
    fn of(block: misclosure::block::Block) -> Self {
        Self { block: Arc::new(block), truth: None, set_aside: SetAside::default(), source: None, notes: Vec::new() }
    }

    /// A block that has a result's cameras, poses and points.
    pub fn adjusted(block: misclosure::block::Block) -> Self {
        Self::of(block)
    }

    fn loaded(loaded: Loaded) -> Self {
        Self { set_aside: loaded.set_aside, ..Self::of(loaded.block) }
    }

    /// The block of a folder with its truth, where it has one.
    fn in_folder(folder: &Path) -> anyhow::Result<Self> {
        let loaded = read_block(folder)?;
        let truth = folder.join(TRUTH);
        let truth = if truth.is_dir() { Some(Arc::new(read_block(&truth)?.block)) } else { None };
        Ok(Self { truth, ..Self::loaded(loaded) })
    }

    fn put(&self, folder: &Path) -> anyhow::Result<()> {
        if let Some(truth) = &self.truth {
            write_block(truth, &folder.join(TRUTH))?;
        }
        Ok(write_block(&self.block, folder)?)
    }
}

#[pymethods]
impl Block {
    #[staticmethod]
    fn read(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let block = py.detach(|| Self::in_folder(&folder)).map_err(|error| raised(py, &error))?;
        Ok(Self { source: Some(folder), ..block })
    }

    #[staticmethod]
    #[pyo3(signature = (scenario, overrides, seed, noise_px, noise_survey, start, without_points, progress=None))]
    #[allow(clippy::too_many_arguments, reason = "Python gives each a name")]
    fn simulate(
        py: Python<'_>,
        scenario: String,
        overrides: BTreeMap<String, f64>,
        seed: u64,
        noise_px: f64,
        noise_survey: bool,
        start: [f64; 3],
        without_points: bool,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let made = work(py, None, progress, move |_, host| {
            let scenario = read_scenario(&scenario, &overrides)?;
            host.step(&format!("flying `{}`", scenario.name));
            let mut simulation = simulate(&scenario, seed)?;
            let exact = &simulation.block;
            let truth = misclosure::block::Block {
                ties: exact.ties.clone(),
                marks: exact.marks.clone(),
                ..simulation.truth.clone()
            };
            disturb(&mut simulation, seed, noise_px, noise_survey, start, without_points)?;
            Ok(Self { truth: Some(Arc::new(truth)), ..Self::of(simulation.block) })
        })?;
        Ok(made.0)
    }

    /// From columns (see `made`).
    #[staticmethod]
    fn from_columns(name: &str, crs: &str, sigma: BTreeMap<String, f64>, given: &Bound<'_, PyDict>) -> PyResult<Self> {
        let value = |key: &str| sigma.get(key).copied().unwrap_or(f64::INFINITY);
        let sigma = Sigma {
            tie_px: value("tie_px"),
            mark_px: value("mark_px"),
            control_xy_m: value("control_xy_m"),
            control_z_m: value("control_z_m"),
            gnss_xy_m: value("gnss_xy_m"),
            gnss_z_m: value("gnss_z_m"),
        };
        Ok(Self::loaded(made(name, crs, sigma, given)?))
    }

    /// From files of another program.
    #[staticmethod]
    #[pyo3(name = "import_")]
    fn import(
        py: Python<'_>,
        format: String,
        path: PathBuf,
        name: Option<String>,
        tie_px: Option<f64>,
        approximate: bool,
    ) -> PyResult<Self> {
        let (made, _) = work(py, None, None, move |_, _| {
            let known = || registry().iter().map(|format| format.name()).collect::<Vec<_>>().join(", ");
            let found = registry().iter().find(|own| own.name() == format);
            let found = found.ok_or_else(|| Usage(format!("format={format:?}: expected one of {}", known())))?;
            let imported = found.import(&[path], &ImportOptions { approximate, tie_px, size_px: None })?;
            let notes = imported.notes.iter().map(ToString::to_string).collect();
            let mut block = imported.block;
            block.name = name.unwrap_or(block.name);
            Ok(Self { notes, ..Self::of(block) })
        })?;
        Ok(made)
    }

    /// Into files of another program; gives what is lost. `alone`: cameras and images without points.
    fn export(&self, py: Python<'_>, format: &str, folder: PathBuf, alone: bool) -> PyResult<Vec<String>> {
        let exporter = registry().iter().find(|own| own.name() == format).and_then(|own| own.exporter());
        let exporter = exporter.ok_or_else(|| input(py, &format!("format={format:?}: cannot be written")))?;
        let options = ExportOptions { approximate: true };
        let written = py.detach(|| match alone {
            true => exporter.export(&self.block.images_alone(), &folder, &options),
            false => exporter.export(&self.block, &folder, &options),
        });
        let notes = written.map_err(|error| raised(py, &error.into()))?;
        Ok(notes.iter().map(ToString::to_string).collect())
    }

    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let written = py.detach(|| {
            let output = Output::of_block(&folder, self.source.as_deref())?;
            output.write(&[], BLOCK_FILE, |dir| self.put(dir))
        });
        written.map_err(|error| raised(py, &error))
    }

    /// Measures the block again under errors, and makes mistakes in it.
    fn inject(
        &self,
        py: Python<'_>,
        errors: Vec<String>,
        mistakes: Vec<String>,
        seed: u64,
        plugins: Vec<PathBuf>,
    ) -> PyResult<(Self, String)> {
        let (block, truth) = (self.block.clone(), self.truth.clone());
        let (set_aside, notes) = (self.set_aside, self.notes.clone());
        let (made, _) = work(py, None, None, move |_, _| {
            let mut own = Self { block, truth, set_aside, source: None, notes };
            let mut report = serde_json::Value::Null;
            if !errors.is_empty() {
                let (block, json) = measured_again(&own.block, own.truth.as_deref(), &errors, &plugins, seed)?;
                (own.block, report) = (Arc::new(block), json);
            }
            if !mistakes.is_empty() {
                let mistakes = mistakes.iter().map(|text| mistakes::parse(text)).collect::<anyhow::Result<Vec<_>>>();
                let mistakes = mistakes.map_err(|error| Usage(format!("{error:#}")))?;
                // Mistakes are made in files, as people make them.
                let folder = tempfile::tempdir().context("no temporary folder for the files of the block")?;
                own.put(folder.path())?;
                mistakes::make(folder.path(), &mistakes).map_err(|error| Usage(format!("{error:#}")))?;
                own = Self { notes: own.notes, ..Self::in_folder(folder.path())? };
            }
            Ok((own, report.to_string()))
        })?;
        Ok(made)
    }

    /// What is in the block, as `misclosure check --json` says it without its mistakes.
    fn contents(&self) -> String {
        let inventory = misclosure::block::inventory::Inventory::of(&self.block);
        shared::contents_json(&self.block, &inventory, &self.set_aside).to_string()
    }

    fn mistakes(&self, py: Python<'_>, threads: Option<usize>) -> PyResult<String> {
        let block = self.block.clone();
        let work = work(py, threads, None, move |options, _| {
            let found = shared::of_block(misclosure::block::Block::clone(&block), options.threads);
            Ok(serde_json::to_string(&found)?)
        });
        Ok(work?.0)
    }

    /// A copy in which mistakes are undone, and what was undone.
    fn mend(
        &self,
        py: Python<'_>,
        only: Vec<String>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Self, String)> {
        let own = self.clone();
        let (made, _) = work(py, threads, progress, move |options, host| {
            let from = tempfile::tempdir().context("no temporary folder for the files of the block")?;
            let to = tempfile::tempdir().context("no temporary folder for the mended copy of the block")?;
            own.put(from.path())?;
            let mended = shared::mend(from.path(), to.path(), &only, options.threads, &|what| host.step(what))?;
            let json = serde_json::to_string(&mended)?;
            if mended.mended.is_empty() {
                return Ok((own, json));
            }
            Ok((Self { truth: own.truth, notes: own.notes, ..Self::loaded(read_block(to.path())?) }, json))
        })?;
        Ok(made)
    }

    /// One adjustment; `words`: options as on the command line.
    fn adjust(
        &self,
        py: Python<'_>,
        words: Vec<String>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Run> {
        let asked: shared::ModelOptions = shared::options(&words).map_err(|error| raised(py, &error.into()))?;
        let block = self.block.clone();
        let (adjusted, messages) = work(py, threads, progress, move |options, host| {
            shared::adjust(misclosure::block::Block::clone(&block), &asked, options, None, host)
        })?;
        Ok(Run::new(Result::Adjusted(Box::new(adjusted)), messages, self.source.clone()))
    }

    /// A diagnosis, or with `improve` the loop; `words`: options as on the command line.
    fn diagnose(
        &self,
        py: Python<'_>,
        words: Vec<String>,
        improve: bool,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Run> {
        let asked: shared::Asked = shared::options(&words).map_err(|error| raised(py, &error.into()))?;
        let keep = if improve { Keep::Improved } else { Keep::Base };
        let block = self.block.clone();
        let (found, messages) = work(py, threads, progress, move |options, host| {
            shared::find(misclosure::block::Block::clone(&block), &asked, keep, options, host)
        })?;
        Ok(Run::new(Result::Found(Box::new(found)), messages, self.source.clone()))
    }

    /// What the block would show, if it were measured without errors; `words`: options as on the command line.
    fn plan(
        &self,
        py: Python<'_>,
        words: Vec<String>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let asked: shared::PlanOptions = shared::options(&words).map_err(|error| raised(py, &error.into()))?;
        let block = self.block.clone();
        let planned = work(py, threads, progress, move |options, host| {
            let twin = shared::error_free(misclosure::block::Block::clone(&block))?;
            let planned = asked.planned(&twin, options.clone(), &|what| host.step(what))?;
            Ok(serde_json::to_string(&planned)?)
        })?;
        Ok(planned.0)
    }

    /// One of the block's tables.
    fn table<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Packed<'py>> {
        let block = &self.block;
        let table = match name {
            "images" => images(block),
            "cameras" => cameras(block),
            "points" => points(&block.tie_points),
            "ties" => measurements(&block.ties),
            "marks" => measurements(&block.marks),
            "control" => control(block),
            _ => return Err(input(py, &format!("no table {name:?}"))),
        };
        table.packed(py)
    }

    /// The truth as a block, of a simulated one.
    #[getter]
    fn truth(&self) -> Option<Self> {
        self.truth.as_ref().map(|truth| Self::of(misclosure::block::Block::clone(truth)))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.block.name
    }

    #[getter]
    fn crs(&self) -> &str {
        &self.block.crs
    }

    #[getter]
    fn sigma(&self) -> BTreeMap<&'static str, f64> {
        let Sigma { tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m } = self.block.sigma;
        let all = [
            ("tie_px", tie_px),
            ("mark_px", mark_px),
            ("control_xy_m", control_xy_m),
            ("control_z_m", control_z_m),
            ("gnss_xy_m", gnss_xy_m),
            ("gnss_z_m", gnss_z_m),
        ];
        all.into_iter().filter(|(_, value)| value.is_finite()).collect()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    #[getter]
    fn source(&self) -> Option<PathBuf> {
        self.source.clone()
    }

    /// Images and surveyed points in plan and from the side, SVG.
    fn figure(&self) -> String {
        plan_and_profile(&self.block)
    }
}
