//! What an adjustment or a diagnosis of a block takes: time and memory from counts, before anything is computed.
//!
//! Each term has the form of a part of the work; its factor is a fit to measured runs: the presets `dike` and
//! `mapping`, areas of 731 to 4,956 images (`cargo bench --bench areal`) and a corridor of two million measurements,
//! each on two threads of an Intel Xeon with AVX-512. The estimates are within a third in memory, and within a factor
//! of two in time.

use super::EVERYTHING_UNKNOWNS;
use crate::block::Block;
use crate::null_model::MOST_IMAGES;
use anyhow::bail;

/// Unknowns of a pose.
const POSE: f64 = 6.0;
/// Bytes of a number.
const NUMBER: f64 = 8.0;
/// Columns of the null model beside the values per image: laws, fields and patterns of residuals.
const OTHER_COLUMNS: f64 = 1000.0;
/// Values per image that are tested: focal length and principal point.
const VALUES_PER_IMAGE: f64 = 3.0;

/// A task that the estimate covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// An adjustment by the native solver.
    Adjust,
    /// A diagnosis that takes in nothing, the final adjustment by both solvers.
    Diagnose,
}

/// Time and memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// On two threads, s.
    pub seconds: f64,
    /// Peak.
    pub bytes: f64,
    /// Matrices that the task cannot do without.
    pub least_bytes: f64,
}

impl Cost {
    /// Of a block.
    pub fn of(block: &Block, task: Task) -> Self {
        Self::of_counts(block.images.len() as f64, (block.ties.len() + block.marks.len()) as f64, task)
    }

    fn of_counts(images: f64, measurements: f64, task: Task) -> Self {
        // Fill of the factor of an area under nested dissection, and the work of a few factorisations.
        let area = images.powf(1.5);
        let rows = 200.0 * measurements;
        let factor = 1600.0 * area;
        match task {
            Task::Adjust => {
                let unknowns = POSE * images;
                // A dense inversion: the normal matrix, its factor, the covariance.
                let dense = unknowns <= EVERYTHING_UNKNOWNS as f64;
                let covariance = if dense { 3.0 * NUMBER * unknowns.powi(2) } else { 0.0 };
                Self {
                    seconds: 0.5 + 5e-6 * measurements + 5.3e-5 * area,
                    bytes: 30e6 + rows + factor + covariance,
                    least_bytes: rows,
                }
            }
            Task::Diagnose => {
                let of_images = VALUES_PER_IMAGE * images.min(MOST_IMAGES as f64);
                let columns = of_images + OTHER_COLUMNS;
                let with_poses = |columns: f64| NUMBER * POSE * images * columns;
                let information = |columns: f64| NUMBER * columns.powi(2);
                let null_model = 130e6 + rows + factor + 1.5 * with_poses(columns) + 4.0 * information(columns);
                let ceres = 1000.0 * measurements;
                Self {
                    seconds: 1.0
                        + 3.2e-5 * measurements
                        + 6.0 * (columns / 4000.0).powi(3)
                        + 4e-3 * images
                        + 9e-7 * images.powi(2),
                    bytes: null_model.max(ceres),
                    least_bytes: rows + with_poses(of_images) + information(of_images),
                }
            }
        }
    }

    /// In words: `about 80 s and 2.7 GB`.
    pub fn in_words(&self) -> String {
        let time = duration_in_words(self.seconds);
        let memory = match self.bytes {
            b if b < 1e9 => format!("{} MB", round(b / 1e6)),
            b => format!("{:.1} GB", b / 1e9),
        };
        format!("{time} and {memory}")
    }

    /// Refuses what needs more than the `available` memory, bytes; `None` where that is not known.
    ///
    /// # Errors
    /// Less memory than the matrices of the task take.
    pub fn judge(&self, images: usize, available: Option<u64>) -> anyhow::Result<()> {
        let gigabytes = |bytes: f64| format!("{:.1} GB", bytes / 1e9);
        match available {
            Some(available) if self.least_bytes > available as f64 => bail!(
                "{images} images with their measurements take at least {} of memory, some {} in all; {} are free. \
                 Give it a part of the area with control points in it, or more memory",
                gigabytes(self.least_bytes),
                gigabytes(self.bytes),
                gigabytes(available as f64)
            ),
            _ => Ok(()),
        }
    }
}

/// An estimated time in words: `about 80 s`.
pub fn duration_in_words(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "less than 1 s".to_string(),
        s if s < 100.0 => format!("about {} s", round(s)),
        s => format!("about {} min", round(s / 60.0)),
    }
}

/// To two digits.
fn round(value: f64) -> f64 {
    let step = 10f64.powf(value.max(1.0).log10().floor() - 1.0).max(1.0);
    (value / step).round() * step
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Images, image measurements; seconds and megabytes of an adjustment and of a diagnosis.
    const MEASURED: [(f64, f64, [f64; 2], [f64; 2]); 7] = [
        (113.0, 78_782.0, [1.26, 76.0], [3.83, 256.0]),
        (90.0, 59_559.0, [0.67, 52.0], [2.38, 209.0]),
        (731.0, 335_853.0, [4.26, 561.0], [21.9, 632.0]),
        (1501.0, 693_099.0, [6.34, 237.0], [38.3, 1140.0]),
        (4956.0, 1_171_754.0, [24.2, 823.0], [84.1, 2681.0]),
        (4956.0, 2_432_790.0, [33.6, 1050.0], [133.6, 3340.0]),
        (1035.0, 2_067_530.0, [10.2, 438.0], [78.4, 2098.0]),
    ];

    #[test]
    fn estimates_are_near_what_was_measured() {
        for (images, measurements, adjust, diagnose) in MEASURED {
            for (task, [seconds, megabytes]) in [(Task::Adjust, adjust), (Task::Diagnose, diagnose)] {
                let cost = Cost::of_counts(images, measurements, task);
                let (time, memory) = (cost.seconds / seconds, cost.bytes / (1e6 * megabytes));
                println!("{images} {task:?}: {:.1} s ({time:.2}), {} ({memory:.2})", cost.seconds, cost.in_words());
                assert!((0.5..2.0).contains(&time) && (0.67..1.5).contains(&memory), "{images} {task:?}");
                assert!(cost.least_bytes < 1e6 * megabytes, "{images} {task:?}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_what_helps() {
        let cost = Cost::of_counts(20_000.0, 4.7e6, Task::Diagnose);
        let error = cost.judge(20_000, Some(2 << 30)).unwrap_err().to_string();
        assert!(
            error.contains("20000 images") && error.contains("memory") && error.contains("part of the area"),
            "{error}"
        );
        assert!(cost.judge(20_000, Some(64 << 30)).is_ok() && cost.judge(20_000, None).is_ok());
    }
}
