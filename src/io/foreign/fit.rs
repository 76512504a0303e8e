//! A camera in another formula: the numbers of one formula that come nearest to another, over the sensor.
//!
//! Where a formula of another program is ours in other units it is converted, not fitted; the fit is then the test of
//! that. It takes up whatever the twelve numbers can: the rotation of the camera is not among them.

use super::super::error::{Error, Place};
use super::Note;
use crate::camera::undistort::undistort;
use crate::camera::{Camera, DCX, DCY, F, Interior, K1, PARAMETER_COUNT, PPX, PPY, fraser, tie_centre};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Points of the sensor per side at which two formulas are compared.
const GRID: usize = 41;
/// Below this difference (px) two formulas are one: image coordinates are not measured to a hundredth of it.
const SILENT_PX: f64 = 1e-3;
/// Above this difference (px) an adjustment could show it.
const LARGEST_PX: f64 = 0.05;
/// Gauss-Newton iterations; five to ten are needed where a fit exists.
const ITERATIONS: usize = 50;
/// A step that moves no image point by more than this (px) is the last.
const LAST_STEP_PX: f64 = 1e-9;
/// Step (in units that move an image point by about a pixel) of a numerical derivative.
const STEP: f64 = 1e-4;
/// Newton steps of a numerical inverse.
const INVERSE_STEPS: usize = 40;
/// Step of the derivative of a foreign formula by a normalised coordinate.
const RAY_STEP: f64 = 1e-6;

/// The way a formula goes. A ray is `(X / Z, Y / Z)` in the camera frame, an image point px from the outer corner of
/// the top-left pixel.
pub enum Formula<'a> {
    /// From ray to image point.
    Forward(&'a dyn Fn([f64; 2]) -> Option<[f64; 2]>),
    /// From image point to ray.
    Backward(&'a dyn Fn([f64; 2]) -> Option<[f64; 2]>),
}

/// Image point (px) of numbers of a formula and a ray; `None` outside its domain.
pub type Predict<'a> = dyn Fn(&[f64], [f64; 2]) -> Option<[f64; 2]> + 'a;

/// How well one formula stands for another.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<P> {
    /// The numbers.
    pub parameters: P,
    /// Difference of image points over the sensor, root mean square per coordinate, px.
    pub rms_px: f64,
    /// Its largest length, px.
    pub max_px: f64,
}

impl<P> Fit<P> {
    /// Says what the difference is. One that an adjustment could show is refused unless it is asked for.
    ///
    /// # Errors
    /// Names the camera of `file` and the difference.
    pub fn judge(self, file: &str, camera: &str, approximate: bool, notes: &mut Vec<Note>) -> Result<P, Error> {
        let Self { parameters, rms_px, max_px } = self;
        let text = format!("camera {camera}: differs by {rms_px:.2e} px RMS, {max_px:.2e} px at most, over the sensor");
        if max_px > LARGEST_PX && !approximate {
            let problem = format!(
                "no exact counterpart; the nearest {text}; more than {LARGEST_PX} px are refused. --approximate writes \
                 it all the same; of a run, --correct-measurements takes the difference out of the measurements"
            );
            return Err(Error::content(file, Place::File, problem));
        }
        notes.push(if max_px <= SILENT_PX { Note::detail(text) } else { Note::loss(text) });
        Ok(parameters)
    }
}

/// The Fraser camera that is nearest to a formula over a sensor of `size` px, found from `start`; with `tied` its
/// centre of distortion is the principal point, else it stays where `start` has it (to first order moving it does what
/// p1 and p2 do). `None` where the formula does not cover the sensor, or nothing comes near it.
pub fn fit_fraser(formula: &Formula<'_>, size: [u32; 2], start: &Interior, tied: bool) -> Option<Fit<Interior>> {
    let samples = samples(formula, size, start)?;
    let camera = Camera { id: String::new(), width_px: size[0], height_px: size[1], pixel_um: None, interior: *start };
    let free: Vec<usize> = (0..PARAMETER_COUNT).filter(|k| ![DCX, DCY].contains(k)).collect();
    let interior = |values: &[f64]| {
        let mut interior = *start;
        free.iter().zip(values).for_each(|(k, value)| interior[*k] = *value);
        if tied {
            tie_centre(&mut interior);
        }
        interior
    };
    let scales: Vec<f64> = free.iter().map(|k| camera.scales()[*k]).collect();
    let values = free.iter().map(|k| start[*k]).collect();
    let predict = |values: &[f64], [x, y]: [f64; 2]| fraser::project(&interior(values), [x, y, 1.0]);
    let Fit { parameters, rms_px, max_px } = fit(&samples, values, &scales, &predict)?;
    Some(Fit { parameters: interior(&parameters), rms_px, max_px })
}

/// The numbers of a forward formula `predict(numbers, ray)` that are nearest to a Fraser camera, found from `start`;
/// `scales` are the changes of the numbers that move an image point by about a pixel. `None` where the camera does not
/// cover its sensor, or nothing comes near it.
pub fn fit_to_fraser(camera: &Camera, start: Vec<f64>, scales: &[f64], predict: &Predict<'_>) -> Option<Fit<Vec<f64>>> {
    let interior = camera.interior;
    let backward = |xy: [f64; 2]| {
        let [u, v] = undistort(&interior, xy)?;
        Some([(u - interior[PPX]) / interior[F], (v - interior[PPY]) / interior[F]])
    };
    let samples = samples(&Formula::Backward(&backward), [camera.width_px, camera.height_px], &interior)?;
    fit(&samples, start, scales, predict)
}

/// The Fraser camera that is nearest to another over its sensor and has `numbers` alone, its centre of distortion at
/// the principal point. The same camera where it has no others. `None` where it does not cover its sensor, or nothing
/// comes near it.
pub fn nearest_with(camera: &Camera, numbers: &[usize]) -> Option<Fit<Interior>> {
    let whole = camera.interior;
    let of = |values: &[f64]| {
        let mut interior = [0.0; PARAMETER_COUNT];
        numbers.iter().zip(values).for_each(|(k, value)| interior[*k] = *value);
        tie_centre(&mut interior);
        interior
    };
    let start: Vec<f64> = numbers.iter().map(|k| whole[*k]).collect();
    let same = of(&start);
    // Without distortion about it, it does not matter where the centre is.
    let has_centre = whole[K1..].iter().any(|k| *k != 0.0);
    if whole[K1..] == same[K1..] && (!has_centre || whole == same) {
        return Some(Fit { parameters: same, rms_px: 0.0, max_px: 0.0 });
    }
    let scales: Vec<f64> = numbers.iter().map(|k| camera.scales()[*k]).collect();
    let predict = |values: &[f64], [x, y]: [f64; 2]| fraser::project(&of(values), [x, y, 1.0]);
    let Fit { parameters, rms_px, max_px } = fit_to_fraser(camera, start, &scales, &predict)?;
    Some(Fit { parameters: of(&parameters), rms_px, max_px })
}

/// A ray and its image point.
type Sample = ([f64; 2], [f64; 2]);

/// Over the sensor; `near` is a camera to start the inverse from.
fn samples(formula: &Formula<'_>, size: [u32; 2], near: &Interior) -> Option<Vec<Sample>> {
    let place = |k: usize, side: u32| f64::from(side) * k as f64 / (GRID - 1) as f64;
    let mut samples = Vec::with_capacity(GRID * GRID);
    for (i, j) in (0..GRID * GRID).map(|k| (k % GRID, k / GRID)) {
        let xy = [place(i, size[0]), place(j, size[1])];
        let ray = match formula {
            Formula::Backward(backward) => backward(xy)?,
            Formula::Forward(forward) => invert(*forward, xy, near)?,
        };
        if !ray.iter().all(|coordinate| coordinate.is_finite()) {
            return None;
        }
        samples.push((ray, xy));
    }
    Some(samples)
}

/// The ray that a formula takes to an image point, by Newton.
fn invert(forward: &dyn Fn([f64; 2]) -> Option<[f64; 2]>, xy: [f64; 2], near: &Interior) -> Option<[f64; 2]> {
    let at = |ray: Vector2<f64>| forward(ray.into()).map(Vector2::from);
    let mut ray = Vector2::new((xy[0] - near[PPX]) / near[F], (xy[1] - near[PPY]) / near[F]);
    for _ in 0..INVERSE_STEPS {
        let miss = Vector2::from(xy) - at(ray)?;
        let by = |step: Vector2<f64>| Some((at(ray + step)? - at(ray - step)?) / (2.0 * RAY_STEP));
        let derivative = Matrix2::from_columns(&[by(Vector2::new(RAY_STEP, 0.0))?, by(Vector2::new(0.0, RAY_STEP))?]);
        let step = derivative.try_inverse()? * miss;
        ray += step;
        if step.norm() * near[F] < LAST_STEP_PX {
            return Some(ray.into());
        }
    }
    None
}

/// Gauss-Newton with numerical derivatives.
fn fit(samples: &[Sample], mut values: Vec<f64>, scales: &[f64], predict: &Predict<'_>) -> Option<Fit<Vec<f64>>> {
    for _ in 0..ITERATIONS {
        let misses = misses(samples, &values, predict)?;
        let mut derivatives = DMatrix::zeros(misses.len(), values.len());
        for (k, scale) in scales.iter().enumerate() {
            let moved = |sign: f64| {
                let mut moved = values.clone();
                moved[k] += sign * STEP * scale;
                self::misses(samples, &moved, predict)
            };
            derivatives.set_column(k, &((moved(-1.0)? - moved(1.0)?) / (2.0 * STEP)));
        }
        let normal = derivatives.tr_mul(&derivatives);
        let step = normal.cholesky()?.solve(&derivatives.tr_mul(&misses));
        values.iter_mut().zip(scales).zip(step.iter()).for_each(|((value, scale), step)| *value += scale * step);
        if (derivatives * step).amax() < LAST_STEP_PX {
            break;
        }
    }
    // What did not converge shows a difference that is refused.
    let misses = misses(samples, &values, predict)?;
    let lengths = misses.as_slice().chunks_exact(2).map(|miss| miss[0].hypot(miss[1]));
    let max_px = lengths.fold(0.0, f64::max);
    let rms_px = (misses.norm_squared() / misses.len() as f64).sqrt();
    (max_px.is_finite() && rms_px.is_finite()).then_some(Fit { parameters: values, rms_px, max_px })
}

/// Image points minus predicted ones, px.
fn misses(samples: &[Sample], values: &[f64], predict: &Predict<'_>) -> Option<DVector<f64>> {
    let mut misses = DVector::zeros(2 * samples.len());
    for (k, (ray, xy)) in samples.iter().enumerate() {
        let [x, y] = predict(values, *ray)?;
        (misses[2 * k], misses[2 * k + 1]) = (xy[0] - x, xy[1] - y);
    }
    Some(misses)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [5120, 3840];
    /// A 35 mm lens with every term.
    const CAMERA: Interior =
        [5510.09, 2539.75, 1945.80, 2539.75, 1945.80, 1.5e-9, -4.5e-17, 1.4e-24, 3e-8, -2e-8, 2e-4, -1e-4];
    const START: Interior = [5000.0, 2560.0, 1920.0, 2560.0, 1920.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

    fn fraser([x, y]: [f64; 2]) -> Option<[f64; 2]> {
        fraser::project(&CAMERA, [x, y, 1.0])
    }

    #[test]
    fn finds_a_fraser_camera_from_either_side() {
        let backward = |xy: [f64; 2]| {
            let [u, v] = undistort(&CAMERA, xy)?;
            Some([(u - CAMERA[PPX]) / CAMERA[F], (v - CAMERA[PPY]) / CAMERA[F]])
        };
        for formula in [Formula::Forward(&fraser), Formula::Backward(&backward)] {
            let fit = fit_fraser(&formula, SIZE, &START, true).unwrap();
            assert!(fit.max_px < 1e-8, "{fit:?}");
            for (found, true_value) in fit.parameters.iter().zip(CAMERA) {
                assert!((found - true_value).abs() <= 1e-6 * true_value.abs(), "{found} {true_value}");
            }
        }
    }

    #[test]
    fn a_difference_is_silent_said_or_refused_by_its_size() {
        let judge = |max_px: f64, approximate| {
            let mut notes = Vec::new();
            let fit = Fit { parameters: (), rms_px: 0.5 * max_px, max_px };
            fit.judge("cameras.txt", "1", approximate, &mut notes).map(|()| notes[0].kind)
        };
        use super::super::Kind;
        assert_eq!(judge(0.0009, false).unwrap(), Kind::Detail);
        assert_eq!(judge(0.02, false).unwrap(), Kind::Loss);
        let refused = judge(0.2, false).unwrap_err().to_string();
        assert!(refused.starts_with("cameras.txt: no exact counterpart") && refused.contains("2.00e-1"), "{refused}");
        assert_eq!(judge(0.2, true).unwrap(), Kind::Loss);
    }

    #[test]
    fn a_formula_that_does_not_cover_the_sensor_has_no_fit() {
        let half = |ray: [f64; 2]| fraser(ray).filter(|[x, _]| *x < 2560.0);
        assert!(fit_fraser(&Formula::Forward(&half), SIZE, &START, true).is_none());
    }
}
