//! The picture that shows an effect: the residuals of the base model, in which cameras and poses absorb most of what
//! the model lacks, those of the final model, and the effect's own size: what the measurements leave when everything is
//! as in the final model but the effect is switched off.

use crate::effects::{By, ImageContext, Picture};
use crate::measure::{MeasureError, Predictor};
use crate::problem::{PositionObservation, Problem, State};
use crate::run::fit::Fit;
use crate::run::folder::{BASE, WITH, WITHOUT};
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;

/// Bins of a profile.
const BINS: usize = 16;
/// Cells along the longer side of a sensor.
const CELLS: f64 = 16.0;

/// A mark of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// [`BASE`], [`WITHOUT`] or [`WITH`].
    pub stage: &'static str,
    /// What `x` is, with its unit in brackets.
    pub against: &'static str,
    /// Component of the residual.
    pub component: &'static str,
    /// Unit of the mean.
    pub unit: &'static str,
    /// Camera; zero where marks are not of the sensor.
    pub camera: usize,
    /// Place.
    pub x: f64,
    /// Second coordinate of the place, on the sensor.
    pub y: Option<f64>,
    /// Number of residuals.
    pub n: usize,
    /// Their mean, observed minus computed.
    pub mean: f64,
    /// Its standard deviation.
    pub sigma: Option<f64>,
}

/// Marks of the picture of `effect`: of the base model, where it is given, and of the final one without and with it.
/// None for what is no effect of the fit.
///
/// # Errors
/// A state without the effect that cannot be projected.
pub fn marks(base: Option<&Fit>, fit: &Fit, effect: &str) -> Result<Vec<Mark>, MeasureError> {
    let Fit { problem, solution, .. } = fit;
    let mut off = solution.state.clone();
    let mut picture = None;
    for (entry, value) in problem.theta.iter().zip(&mut off.theta) {
        let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
        if descriptor.id == effect {
            *value = descriptor.parameters[entry.parameter as usize].nominal;
            picture = Some(descriptor.picture);
        }
    }
    let Some(picture) = picture else { return Ok(Vec::new()) };
    let mut marks = match base {
        Some(base) => seen(&base.problem, &base.solution.state, picture, BASE)?,
        None => Vec::new(),
    };
    marks.extend(seen(problem, &off, picture, WITHOUT)?);
    marks.extend(seen(problem, &solution.state, picture, WITH)?);
    Ok(marks)
}

fn seen(problem: &Problem, state: &State, picture: Picture, stage: &'static str) -> Result<Vec<Mark>, MeasureError> {
    let predictor = Predictor::new(problem, state)?;
    let mut marks = match picture {
        Picture::Gnss(by) => gnss(problem, &predictor, by),
        Picture::Surveyed => surveyed(problem, state, &predictor),
        Picture::Scale(by) => of_images(problem, state, &predictor, by, true),
        Picture::Shift(by) => of_images(problem, state, &predictor, by, false),
        Picture::Sensor | Picture::Row | Picture::Radius => binned(problem, state, &predictor, picture),
    };
    marks.iter_mut().for_each(|mark| mark.stage = stage);
    Ok(marks)
}

/// Calls `each` with image, predicted point and residual (px) of every measurement.
fn residuals(predictor: &Predictor<'_>, mut each: impl FnMut(usize, Vector2<f64>, Vector2<f64>)) {
    predictor.each_measurement(|_, row, predicted| {
        if let Some((predicted, _)) = predicted {
            let predicted = Vector2::from(predicted);
            each(row.image as usize, predicted, Vector2::new(row.x, row.y) - predicted);
        }
    });
}

/// Sums of a bin.
#[derive(Default, Clone, Copy)]
struct BinSums {
    n: usize,
    x: f64,
    sum: f64,
    squares: f64,
}

impl BinSums {
    fn add(&mut self, x: f64, value: f64) {
        self.n += 1;
        self.x += x;
        self.sum += value;
        self.squares += value * value;
    }

    fn mean(&self) -> f64 {
        self.sum / self.n as f64
    }

    fn sigma(&self) -> Option<f64> {
        let n = self.n as f64;
        (self.n > 1).then(|| ((self.squares / n - self.mean().powi(2)).max(0.0) / (n - 1.0)).sqrt())
    }
}

fn mark(against: &'static str, component: &'static str, unit: &'static str, x: f64, mean: f64) -> Mark {
    Mark { stage: WITH, against, component, unit, camera: 0, x, y: None, n: 1, mean, sigma: None }
}

fn binned(problem: &Problem, state: &State, predictor: &Predictor<'_>, picture: Picture) -> Vec<Mark> {
    let mut bins: BTreeMap<(usize, usize, usize), [BinSums; 3]> = BTreeMap::new();
    residuals(predictor, |image, predicted, residual| {
        let context = &problem.image_contexts[image];
        let camera = context.camera as usize;
        let (key, values) = match picture {
            Picture::Row => {
                let row = 2.0 * predicted.y / context.height_px - 1.0;
                let Some(along) = along_in_image(state, context, image) else { return };
                (((0.5 * (row + 1.0) * BINS as f64) as usize, 0), [(row, residual.dot(&along)), (0.0, 0.0), (0.0, 0.0)])
            }
            Picture::Radius => {
                let from_centre = predicted - centre(state, camera);
                let (radius, half) = (from_centre.norm(), 0.5 * context.width_px.hypot(context.height_px));
                let radial = if radius > 0.0 { residual.dot(&from_centre) / radius } else { 0.0 };
                (((radius / half * BINS as f64) as usize, 0), [(radius, radial), (0.0, 0.0), (0.0, 0.0)])
            }
            _ => {
                let side = context.width_px.max(context.height_px) / CELLS;
                let [i, j] = [predicted.x, predicted.y].map(|at| (at / side).max(0.0) as usize);
                ((i, j), [(predicted.x, residual.x), (predicted.y, residual.y), (0.0, 0.0)])
            }
        };
        let sums = bins.entry((camera, key.0, key.1)).or_default();
        for (sums, (x, value)) in sums.iter_mut().zip(values) {
            sums.add(x, value);
        }
    });
    let on_sensor = picture == Picture::Sensor;
    let mut marks = Vec::new();
    for ((camera, ..), [first, second, _]) in bins {
        let place = |sums: &BinSums| sums.x / sums.n as f64;
        let of = |against, component, sums: &BinSums, y: Option<f64>| Mark {
            camera,
            y,
            n: sums.n,
            sigma: sums.sigma(),
            ..mark(against, component, "px", place(&first), sums.mean())
        };
        match picture {
            _ if on_sensor => {
                let y = Some(place(&second));
                marks.extend([of("sensor (px)", "dx", &first, y), of("sensor (px)", "dy", &second, y)]);
            }
            Picture::Row => marks.push(of("row (half heights)", "along the motion", &first, None)),
            _ => marks.push(of("radius (px)", "radial", &first, None)),
        }
    }
    marks
}

fn centre(state: &State, camera: usize) -> Vector2<f64> {
    let interior = &state.interiors[camera];
    Vector2::new(interior[crate::camera::PPX], interior[crate::camera::PPY])
}

/// Unit vector in the image along the camera's motion.
fn along_in_image(state: &State, context: &ImageContext, image: usize) -> Option<Vector2<f64>> {
    let motion = state.poses[image].rotation * context.velocity;
    motion.xy().try_normalize(f64::MIN_POSITIVE).filter(|along| along.x.is_finite())
}

/// Scale (px at half the diagonal) or shift of each image.
fn of_images(problem: &Problem, state: &State, predictor: &Predictor<'_>, by: By, scale: bool) -> Vec<Mark> {
    // Sums of residual by shape, and of the shape's squares; of two shapes.
    let mut sums = vec![[[0.0; 2]; 2]; problem.image_contexts.len()];
    let mut counts = vec![0; problem.image_contexts.len()];
    let mut squares = (0.0, 0.0);
    residuals(predictor, |image, predicted, residual| {
        let context = &problem.image_contexts[image];
        let half = 0.5 * context.width_px.hypot(context.height_px);
        let u = (predicted - centre(state, context.camera as usize)) / half;
        let shapes = if scale { [u, Vector2::zeros()] } else { [Vector2::x(), Vector2::y()] };
        for ([sum, length], shape) in sums[image].iter_mut().zip(shapes) {
            *sum += residual.dot(&shape);
            *length += shape.norm_squared();
        }
        counts[image] += 1;
        squares = (squares.0 + residual.norm_squared(), squares.1 + 2.0);
    });
    let noise = (squares.0 / f64::max(squares.1, 1.0)).sqrt();
    let components = if scale { &["scale, at half the diagonal"][..] } else { &["shift in x", "shift in y"][..] };
    let mut marks = Vec::new();
    for (image, own) in sums.iter().enumerate().filter(|(image, _)| counts[*image] > 0) {
        let Some((against, x)) = place_of(problem, by, image) else { continue };
        for ([sum, length], component) in own.iter().zip(components) {
            let sigma = Some(noise / length.sqrt());
            marks.push(Mark { n: counts[image], sigma, ..mark(against, component, "px", x, sum / length) });
        }
    }
    marks
}

fn place_of(problem: &Problem, by: By, image: usize) -> Option<(&'static str, f64)> {
    let context = &problem.image_contexts[image];
    let (against, x) = match by {
        By::Time => ("time (s)", context.time_s),
        By::Temperature => ("temperature (degrees Celsius)", context.temperature_c),
        By::Order => ("image, in the order of the block", image as f64 + 1.0),
        By::Heading => {
            let [east, north] = [context.velocity.x, context.velocity.y];
            ("heading (degrees from north to east)", east.atan2(north).to_degrees().rem_euclid(360.0))
        }
    };
    x.is_finite().then_some((against, x))
}

fn gnss(problem: &Problem, predictor: &Predictor<'_>, by: By) -> Vec<Mark> {
    let mut marks = Vec::new();
    for observation in &problem.gnss {
        let image = observation.index as usize;
        let Some(antenna) = predictor.antenna(image) else { continue };
        let residual = observation.position - antenna;
        let Some((against, x)) = place_of(problem, by, image) else { continue };
        let velocity = problem.image_contexts[image].velocity.xy();
        if let Some(along) = velocity.try_normalize(f64::MIN_POSITIVE).filter(|along| along.x.is_finite()) {
            let across = along.y * residual.x - along.x * residual.y;
            marks.push(mark(against, "along the track", "m", x, along.dot(&residual.xy())));
            marks.push(mark(against, "across the track", "m", x, across));
        }
        marks.push(mark(against, "up", "m", x, residual.z));
    }
    marks
}

fn surveyed(problem: &Problem, state: &State, predictor: &Predictor<'_>) -> Vec<Mark> {
    let control = problem.control.iter().filter_map(|observation| {
        let computed = predictor.surveyed(&state.points[observation.index as usize])?;
        Some((observation, computed))
    });
    let antennas = problem.gnss.iter().filter_map(|o| Some((o, predictor.antenna(o.index as usize)?)));
    let all: Vec<(&PositionObservation, Vector3<f64>)> = control.chain(antennas).collect();
    let count = all.len().max(1) as f64;
    let centre = all.iter().map(|(observation, _)| observation.position).sum::<Vector3<f64>>() / count;
    let mut marks = Vec::new();
    for (observation, computed) in all {
        let residual = observation.position - computed;
        let out = (observation.position - centre).xy();
        let distance = out.norm();
        let outward = if distance > 0.0 { residual.xy().dot(&out) / distance } else { 0.0 };
        marks.push(mark("distance from the centre of the survey (m)", "outward", "m", distance, outward));
        marks.push(mark("distance from the centre of the survey (m)", "up", "m", distance, residual.z));
    }
    marks
}
