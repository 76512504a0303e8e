//! The reference for speed, two programs that are no part of the project: what a machine can do with a plain corridor,
//! by hand and with Ceres. They get the problem that our solvers get, as a file, and what they print is read.

use super::once::{CONVERGED, Measured};
use anyhow::{Context, Result, bail, ensure};
use misclosure::problem::{Loss, Pose, Problem};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SOURCE: &str = "../shared/perf";

/// Iterations at most: many more than either program takes.
const MOST_ITERATIONS: &str = "50";

/// Its programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    Native,
    Ceres,
}

impl Program {
    const ALL: [Self; 2] = [Self::Native, Self::Ceres];

    fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Ceres => "ceres",
        }
    }
}

/// The reference, as far as it can be built here: the native program needs AVX-512.
pub struct Reference {
    folder: PathBuf,
}

impl Reference {
    /// Builds it where it is not built yet; `None` where there is none, or nothing of it can be built.
    pub fn find() -> Result<Option<Self>> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let (source, folder) = (root.join(SOURCE), root.join("target/reference"));
        if !source.exists() {
            eprintln!("skipped: no {SOURCE}");
            return Ok(None);
        }
        let reference = Self { folder };
        let missing = || Program::ALL.into_iter().filter(|program| !reference.has(*program));
        if missing().next().is_some() {
            // It also makes blocks of its own, which are not used here: only its programs must be there in the end.
            let mut build = Command::new(source.join("build.sh"));
            build.arg(&reference.folder).stdout(Stdio::null()).stderr(Stdio::null()).status()?;
        }
        for program in missing() {
            eprintln!("skipped: {SOURCE}/build.sh makes no program `{}` on this machine", program.name());
        }
        if missing().count() == Program::ALL.len() {
            return Ok(None);
        }
        std::fs::create_dir_all(reference.folder.join("data"))?;
        Ok(Some(reference))
    }

    /// Whether a program of it could be built.
    pub fn has(&self, program: Program) -> bool {
        self.path(program).exists()
    }

    fn path(&self, program: Program) -> PathBuf {
        self.folder.join("bin").join(program.name())
    }

    /// Where a block's file stands.
    pub fn file(&self, block: &str) -> PathBuf {
        self.folder.join("data").join(format!("bench-{block}.fba"))
    }

    /// Solves a block from its file; costs are in units of `weight`, that of the measurements.
    pub fn measure(&self, program: Program, file: &Path, weight: f64) -> Result<Measured> {
        let name = program.name();
        let mut command = Command::new(self.path(program));
        command.arg(file);
        match program {
            Program::Native => command.args(["1", MOST_ITERATIONS, "chol"]),
            Program::Ceres => command.args(["ana", "sparse", "1", MOST_ITERATIONS]),
        };
        command.env("OPENBLAS_NUM_THREADS", "1").env("GLOG_minloglevel", "2").stderr(Stdio::null());
        let output = command.output()?;
        ensure!(output.status.success(), "the reference's {name}: {}", output.status);
        let text = String::from_utf8(output.stdout)?;
        read(program, &text, weight).with_context(|| format!("the reference's {name} printed:\n{text}"))
    }
}

/// What a run printed.
fn read(program: Program, text: &str, weight: f64) -> Result<Measured> {
    // `it 0 cost 1.234e+05 ...`; a step that was refused is a line with the cost that it would have had.
    let steps: Vec<(f64, f64)> = text
        .lines()
        .filter(|line| line.starts_with("it "))
        .filter_map(|line| number(line, "it ").ok().zip(number(line, "cost ").ok()))
        .collect();
    let line = |start: &str| text.lines().find(|line| line.starts_with(start)).with_context(|| format!("no {start}"));
    let (cpu, result) = (line("CPU ")?, line("RESULT ")?);
    let (per_iteration, cost) = (number(cpu, "cpu/iter=")?, number(result, "final=")?);
    let converged = steps.iter().find(|(_, own)| *own <= cost * (1.0 + CONVERGED)).context("no converged iteration")?;
    let iterations = converged.0 as usize;
    ensure!(iterations > 0, "a single iteration cannot be timed");
    // What it does before the first step, it says by the clock; one thread is as long on the processor.
    let before = match program {
        Program::Native => number(result, "setup=")? + number(result, "analyze=")?,
        Program::Ceres => number(result, "build=")? + number(cpu, "cpu_before_it0=")?,
    };
    let call = number(cpu, "cpu_solve=")?
        + match program {
            Program::Native => before,
            Program::Ceres => number(result, "build=")?,
        };
    let megabytes = |key: &str| Ok::<_, anyhow::Error>((number(result, key)? * 1024.0 * 1024.0) as u64);
    Ok(Measured {
        cost: cost * weight * weight,
        iterations,
        per_iteration,
        wall_per_iteration: per_iteration,
        to_convergence: before + iterations as f64 * per_iteration,
        call,
        peak: if program == Program::Ceres { Some(megabytes("rss_minus_block=")?) } else { None },
        peak_of_process: megabytes(" rss=")?,
    })
}

/// The number behind a key.
fn number(line: &str, key: &str) -> Result<f64> {
    let (_, rest) = line.split_once(key).with_context(|| format!("no `{key}` in `{line}`"))?;
    let end = rest.find(|c: char| !"0123456789.+-e".contains(c)).unwrap_or(rest.len());
    rest[..end].parse().with_context(|| format!("`{key}` in `{line}`: expected a number"))
}

/// Weight of the measurements, the same for all: the reference knows no other problem than ours with one free camera.
pub fn weight_of(problem: &Problem) -> Result<f64> {
    let one_camera = problem.camera_free.len() == 1 && problem.camera_free[0] == [true; 12] && !problem.tie_dc_to_pp;
    let plain = problem.effects.is_empty() && problem.loss == Loss::None && problem.camera_priors.is_empty();
    if !one_camera || !plain || !problem.gnss.is_empty() || !problem.control.is_empty() {
        bail!("the reference knows one free camera and image measurements alone");
    }
    let weight = problem.observations.first().context("no measurement")?.inverse_sigma;
    ensure!(problem.observations.iter().all(|o| o.inverse_sigma == weight), "the reference knows one weight alone");
    Ok(weight)
}

/// Writes the problem as the reference reads it (`src/fba.h`): header, interior orientation, poses, points,
/// measurements. What it keeps of the truth it does not look at here.
pub fn write(problem: &Problem, path: &Path) -> Result<()> {
    weight_of(problem)?;
    let mut file = BufWriter::new(File::create(path).with_context(|| path.display().to_string())?);
    let start = &problem.start;
    let counts = [start.poses.len(), start.points.len(), problem.observations.len()];
    file.write_all(&u64::from(u32::from_le_bytes(*b"FBA1")).to_le_bytes())?;
    for count in counts {
        file.write_all(&(count as u64).to_le_bytes())?;
    }
    let pose = |pose: &Pose| {
        let (q, c) = (pose.rotation.quaternion(), pose.centre);
        [q.w, q.i, q.j, q.k, c.x, c.y, c.z]
    };
    let poses: Vec<f64> = start.poses.iter().flat_map(pose).collect();
    let points: Vec<f64> = start.points.iter().flat_map(|point| [point.x, point.y, point.z]).collect();
    for numbers in [start.interiors[0].as_slice(), &poses, &points] {
        for _truth_and_start in 0..2 {
            numbers.iter().try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
        }
    }
    for observation in problem.observations.iter() {
        file.write_all(&observation.image.to_le_bytes())?;
    }
    for (j, range) in problem.point_start.windows(2).enumerate() {
        for _ in range[0]..range[1] {
            file.write_all(&(j as u32).to_le_bytes())?;
        }
    }
    for observation in problem.observations.iter() {
        file.write_all(&observation.x.to_le_bytes())?;
        file.write_all(&observation.y.to_le_bytes())?;
    }
    file.flush()?;
    Ok(())
}
