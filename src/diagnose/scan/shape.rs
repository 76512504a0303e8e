//! Shapes on the sensor: what a measurement is moved by one unit of an effect at a place.

use super::Scan;
use super::cells::Residual;
use crate::adjust::native::null_model::{Columns, Entries, Measured};
use crate::effects::Context;
use crate::effects::formula::FEW_PARAMETERS;
use crate::problem::ImageObservation;
use smallvec::{SmallVec, smallvec};

/// Steps of a finer grid to either side: the best is surrounded, and the next grid goes on from there.
const FINE_STEPS: i32 = 1;
/// Beyond this many widths a shape is cut off, for speed: what is left correlates with the whole by 0.998 or more, sharp or smooth.
const REACH: f64 = 2.0;

/// A variant at a place and a width, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    pub variant: usize,
    pub place: [f64; 2],
    pub width: f64,
}

impl Shape {
    /// How far one of a width reaches, px.
    pub fn reach(width: f64) -> f64 {
        REACH * width
    }

    /// Is the place of another one within the reach of this?
    pub fn reaches(&self, other: &Shape) -> bool {
        (0..2).all(|k| (other.place[k] - self.place[k]).abs() <= Self::reach(self.width))
    }

    /// Shapes of a width at places about this one, so many of its own widths from each other.
    pub fn about(self, step: f64, width: f64) -> Vec<Shape> {
        let step = step * self.width;
        let steps = || -FINE_STEPS..=FINE_STEPS;
        let place = |i: i32, j: i32| [self.place[0] + f64::from(i) * step, self.place[1] + f64::from(j) * step];
        let places = steps().flat_map(|j| steps().map(move |i| place(i, j)));
        places.map(|place| Shape { place, width, ..self }).collect()
    }
}

/// Score of a shape, and the square of its length before anything is taken out.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// `s`.
    pub score: f64,
    /// `B'PB`.
    pub length: f64,
}

impl Sums {
    /// `s^2 / B'PB`; zero where no measurement is reached.
    pub fn ratio(&self) -> f64 {
        if self.length > 0.0 { self.score * self.score / self.length } else { 0.0 }
    }
}

/// Moves that shapes of a search make. Its buffers are reused and allocate nothing: it is asked at every measurement.
pub(super) struct Moves<'a> {
    search: &'a Scan<'a>,
    values: SmallVec<[f64; FEW_PARAMETERS]>,
    d_theta: SmallVec<[f64; 2 * FEW_PARAMETERS]>,
}

impl<'a> Moves<'a> {
    pub fn new(search: &'a Scan<'a>) -> Self {
        let count = search.effect.descriptor().parameters.len();
        Self { search, values: smallvec![0.0; count], d_theta: smallvec![0.0; 2 * count] }
    }

    /// Adds what a shape has of residuals to its score and to the square of its length.
    pub fn add(&mut self, measured: &Residual<'_>, shape: &Shape, sums: &mut Sums) {
        let Residual { observation, predicted, interior, pull, weight } = measured;
        let Some([x, y]) = self.of(observation, *predicted, interior, shape) else { return };
        sums.score += x * pull[0] + y * pull[1];
        sums.length += weight * (x * x + y * y);
    }

    /// Derivative of the image point by the linear parameter; `None` where the shape does not reach.
    fn of(
        &mut self,
        observation: &ImageObservation,
        predicted: [f64; 2],
        interior: &[f64; 12],
        shape: &Shape,
    ) -> Option<[f64; 2]> {
        let search = self.search;
        let (x, y) = (predicted[0] - shape.place[0], predicted[1] - shape.place[1]);
        let reach = Shape::reach(shape.width);
        let image = &search.problem.image_contexts[observation.image as usize];
        if x * x + y * y > reach * reach || image.camera != search.cameras[shape.variant] {
            return None;
        }
        let context = Context {
            block: &search.problem.block_context,
            image,
            column_px: observation.x,
            row_px: observation.y,
            surveyed: None,
        };
        let mut input = [0.0; 14];
        input[..2].copy_from_slice(&predicted);
        input[2..].copy_from_slice(interior);
        let [linear, px, py, pw] = search.parameters;
        self.values.copy_from_slice(&search.values[shape.variant]);
        (self.values[px], self.values[py], self.values[pw]) = (shape.place[0], shape.place[1], shape.width);
        let mut moved = [0.0; 2];
        search.effect.eval(&context, &input, &self.values, &mut moved, None, Some(&mut self.d_theta)).ok()?;
        let d = [self.d_theta[linear], self.d_theta[self.values.len() + linear]];
        (d != [0.0; 2]).then_some(d)
    }
}

/// Shapes of a search as columns.
pub(super) struct List<'a> {
    /// What is searched.
    pub search: &'a Scan<'a>,
    /// Column by column.
    pub shapes: &'a [Shape],
}

impl Columns for List<'_> {
    fn dense(&self) -> usize {
        0
    }

    fn local(&self) -> usize {
        self.shapes.len()
    }

    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        let mut moves = Moves::new(self.search);
        for (column, shape) in self.shapes.iter().enumerate() {
            if let Some(d) = moves.of(measured.observation, measured.predicted, measured.interior, shape) {
                x.local(column, d[0]);
                y.local(column, d[1]);
            }
        }
    }
}
