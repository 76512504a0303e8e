//! Periodic patterns on the sensor: Fourier transform of finely binned residuals, to find candidates; each candidate is
//! then tested exactly, as cosine and sine of its frequency in both components.
//!
//! The p-value is that of the exact test times the number of frequencies looked at. It holds whatever way the
//! candidates were found; neighbouring frequencies are correlated, so it is somewhat too large.

use super::asked::{Asked, Tested};
use super::columns::{Family, Writer};
use super::context::Context;
use super::found::Found;
use super::pictures::{Peak, SpectrumGrid};
use super::place::Place;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use std::f64::consts::TAU;

/// Shortest wavelength that is looked for, px.
const SHORTEST: f64 = 100.0;
/// Bins per shortest wavelength: binning takes a tenth of the amplitude there.
const BINS_PER_WAVE: f64 = 4.0;
/// The longest wavelength is this share of the sensor's long side: below two periods the cells see more.
const LONGEST_SHARE: f64 = 0.5;
/// Frequencies are this much finer than the sensor resolves, so that a peak between two of them keeps two thirds of its
/// power.
const OVERSAMPLING: usize = 2;
/// Peaks per camera that are tested exactly.
const CANDIDATES: usize = 8;
/// Measurements of a camera that a spectrum needs.
const LEAST: usize = 200;
/// Bins that a sensor may have along one side.
const MOST_BINS: usize = 4096;

/// A frequency, 1/px.
#[derive(Clone, Copy)]
struct Frequency {
    camera: usize,
    x: f64,
    y: f64,
    power: f64,
}

/// Frequencies that stand out, to be tested exactly.
pub(super) struct Spectrum {
    candidates: Vec<Frequency>,
    searched: usize,
}

impl Spectrum {
    /// Looks for them; `None` where a block does not allow it.
    pub fn new(context: &Context<'_>, found: &mut Found) -> Option<Self> {
        let mut candidates = Vec::new();
        let mut searched = 0;
        for camera in 0..context.problem.camera_free.len() {
            if let Some((grid, mut peaks, count)) = screen(context, camera) {
                peaks.sort_by(|a, b| b.power.total_cmp(&a.power));
                peaks.truncate(CANDIDATES);
                candidates.extend(peaks);
                searched += count;
                found.pictures.spectrum.push(grid);
            }
        }
        if candidates.is_empty() {
            found.skip("spectrum", "too few measurements on the sensor, or a sensor that is too small or too large");
            return None;
        }
        Some(Self { candidates, searched })
    }

    /// Cosine and sine of each frequency in both components.
    pub fn family(&self) -> Family<'_> {
        let fill = |place: &Place, to: &mut Writer<'_>| {
            for (c, frequency) in self.candidates.iter().enumerate().filter(|(_, f)| f.camera == place.camera) {
                let (sine, cosine) = (TAU * (frequency.x * place.x + frequency.y * place.y)).sin_cos();
                for (k, displacement) in
                    [[cosine, 0.0], [sine, 0.0], [0.0, cosine], [0.0, sine]].into_iter().enumerate()
                {
                    to.entry(4 * c + k, displacement);
                }
            }
        };
        let count = 4 * self.candidates.len();
        Family { against: "spectrum", count, local: false, fill: Box::new(fill), coordinates: None }
    }

    /// Tests each; those that the base model absorbs are left out. Columns of the strongest come first in what is found
    /// to be left.
    pub fn judge(&self, asked: &Asked<'_>, found: &mut Found) {
        let mut peaks: Vec<(Peak, Tested, usize)> = Vec::new();
        for (c, frequency) in self.candidates.iter().enumerate() {
            let own: Vec<usize> = (4 * c..4 * c + 4).collect();
            let Some(tested) = asked.test(&own) else { continue };
            let amplitude = asked
                .estimates(&own)
                .map_or([f64::NAN; 2], |estimate| [estimate[0].hypot(estimate[1]), estimate[2].hypot(estimate[3])]);
            let tested = tested.of_many(self.searched);
            let peak = Peak {
                camera: frequency.camera,
                wavelength: frequency.x.hypot(frequency.y).recip(),
                direction_deg: frequency.y.atan2(frequency.x).to_degrees(),
                amplitude,
                p_value: tested.p_value,
            };
            peaks.push((peak, tested, c));
        }
        peaks.sort_by(|(_, a, _), (_, b, _)| a.ln_p_value.total_cmp(&b.ln_p_value));
        let best = peaks.first().map(|(_, tested, _)| *tested);
        let description = peaks.first().map_or(String::new(), |(peak, ..)| {
            format!(
                "{} frequencies down to {SHORTEST:.0} px; strongest: wavelength {:.0} px, direction {:.0} degrees, \
                 amplitude {:.3} px in x and {:.3} px in y",
                self.searched, peak.wavelength, peak.direction_deg, peak.amplitude[0], peak.amplitude[1]
            )
        });
        if let Some((.., c)) = peaks.first() {
            found.shapes.push(("spectrum", (4 * c..4 * c + 4).collect()));
        }
        found.pictures.peaks = peaks.into_iter().map(|(peak, ..)| peak).collect();
        found.push("spectrum", best, description);
    }
}

/// Power over the frequencies of a camera, its local maxima, and the number of frequencies in the band.
fn screen(context: &Context<'_>, camera: usize) -> Option<(SpectrumGrid, Vec<Frequency>, usize)> {
    let of = |k: usize| context.problem.image_contexts[context.problem.observations[k].image as usize].camera as usize;
    let own = || context.measurements.iter().enumerate().filter(|(k, _)| of(*k) == camera);
    let size = context.problem.image_contexts.iter().find(|image| image.camera as usize == camera)?;
    let (width, height) = (size.width_px, size.height_px);
    let bin = SHORTEST / BINS_PER_WAVE;
    let bins = |side: f64| (side / bin).ceil() as usize;
    let (bx, by) = (bins(width), bins(height));
    let longest = LONGEST_SHARE * width.max(height);
    if own().count() < LEAST || longest < SHORTEST || bx.max(by) > MOST_BINS {
        return None;
    }
    let (nx, ny) = (OVERSAMPLING * bx, OVERSAMPLING * by);
    // x and y as real and imaginary part: one transform serves both.
    let mut field = vec![Complex64::default(); nx * ny];
    let mut expected = [0.0; 2];
    for (k, local) in own() {
        let weight = context.problem.observations[k].inverse_sigma;
        let residual = local.residual.map(|r| r * weight);
        let i = ((local.predicted[0] / bin).max(0.0) as usize).min(bx - 1);
        let j = ((local.predicted[1] / bin).max(0.0) as usize).min(by - 1);
        field[j * nx + i] += Complex64::new(residual[0], residual[1]);
        expected[0] += local.redundancy[(0, 0)];
        expected[1] += local.redundancy[(1, 1)];
    }
    transform(&mut field, nx, ny);
    let expected = expected.map(|sum| (sum * context.variance()).max(f64::MIN_POSITIVE));
    let step = [1.0 / (nx as f64 * bin), 1.0 / (ny as f64 * bin)];
    let (ax, ay) = ((1.0 / (SHORTEST * step[0])) as usize, (1.0 / (SHORTEST * step[1])) as usize);
    let shape = [ax + 1, 2 * ay + 1];
    let mut power = vec![f64::NAN; shape[0] * shape[1]];
    let mut searched = 0;
    for row in 0..shape[1] {
        let b = row as isize - ay as isize;
        for a in 0..=ax {
            let frequency = (a as f64 * step[0]).hypot(b as f64 * step[1]);
            if (a == 0 && b <= 0) || frequency * SHORTEST > 1.0 || frequency * longest < 1.0 {
                continue;
            }
            let at = |a: isize, b: isize| {
                field[b.rem_euclid(ny as isize) as usize * nx + a.rem_euclid(nx as isize) as usize]
            };
            let (here, there) = (at(a as isize, b), at(-(a as isize), -b).conj());
            let (x, y) = ((here + there) * 0.5, (here - there) * 0.5);
            power[row * shape[0] + a] = 0.5 * (x.norm_sqr() / expected[0] + y.norm_sqr() / expected[1]);
            searched += 1;
        }
    }
    let peaks = local_maxima(&power, shape)
        .map(|(a, row)| Frequency {
            camera,
            x: a as f64 * step[0],
            y: (row as f64 - ay as f64) * step[1],
            power: power[row * shape[0] + a],
        })
        .collect();
    Some((SpectrumGrid { camera, shape, step, power }, peaks, searched))
}

fn local_maxima(power: &[f64], shape: [usize; 2]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let places = (0..shape[1]).flat_map(move |row| (0..shape[0]).map(move |a| (a, row)));
    places.filter(move |(a, row)| {
        let own = power[row * shape[0] + a];
        let rows = row.saturating_sub(1)..(row + 2).min(shape[1]);
        // NaN (outside the band) is never larger.
        own.is_finite()
            && rows.into_iter().all(|r| {
                (a.saturating_sub(1)..(a + 2).min(shape[0])).all(|c| {
                    let other = power[r * shape[0] + c];
                    other.is_nan() || other <= own
                })
            })
    })
}

/// Two-dimensional Fourier transform in place, rows of `nx`.
fn transform(field: &mut [Complex64], nx: usize, ny: usize) {
    let mut planner = FftPlanner::new();
    planner.plan_fft_forward(nx).process(field);
    let along = planner.plan_fft_forward(ny);
    let mut column = vec![Complex64::default(); ny];
    for i in 0..nx {
        for (j, value) in column.iter_mut().enumerate() {
            *value = field[j * nx + i];
        }
        along.process(&mut column);
        for (j, value) in column.iter().enumerate() {
            field[j * nx + i] = *value;
        }
    }
}
