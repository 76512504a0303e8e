//! Shapes on the sensor: what a measurement is moved by one unit of an effect at a place.

use super::Scan;
use super::cells::Residual;
use crate::effects::answer::{Answer, FEW_PARAMETERS, Thetas};
use crate::effects::{Context, Stage};
use crate::math::lane::{LANES, Lane};
use crate::null_model::{Columns, Entries, Measured};
use crate::problem::ImageObservation;
use smallvec::{SmallVec, smallvec};

/// Steps of a finer grid to either side: the best is surrounded, and the next grid goes on from there.
const FINE_STEPS: i32 = 1;
/// Beyond this many widths a shape is cut off, for speed: what is left correlates with the whole by 0.998 or more,
/// sharp or smooth.
const REACH: f64 = 2.0;

/// Coordinates of an image point.
const OUTPUTS: usize = Stage::Image.outputs();

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

/// Moves that shapes of a search make, asked about eight side by side. Its buffers are reused and allocate nothing: it
/// is asked at every measurement.
pub(super) struct Moves<'a> {
    search: &'a Scan<'a>,
    /// Shapes that are not asked about yet, each with the number that it was given.
    waiting: SmallVec<[(usize, Shape); LANES]>,
    /// Parameters of these, one shape after the other.
    values: SmallVec<[f64; LANES * FEW_PARAMETERS]>,
    d_theta: SmallVec<[Lane; OUTPUTS * FEW_PARAMETERS]>,
}

impl<'a> Moves<'a> {
    pub fn new(search: &'a Scan<'a>) -> Self {
        let count = search.effect.descriptor().parameters.len();
        let (values, d_theta) = (smallvec![0.0; LANES * count], smallvec![Lane::default(); OUTPUTS * count]);
        Self { search, waiting: SmallVec::new(), values, d_theta }
    }

    /// Adds what numbered shapes have of residuals to their scores and to the squares of their lengths.
    pub fn add(&mut self, measured: &Residual<'_>, shapes: impl Iterator<Item = (usize, Shape)>, sums: &mut [Sums]) {
        let Residual { observation, predicted, interior, pull, weight } = measured;
        self.each(observation, *predicted, interior, shapes, |number, [x, y]| {
            sums[number].score += x * pull[0] + y * pull[1];
            sums[number].length += weight * (x * x + y * y);
        });
    }

    /// Tells the derivative of the image point by the linear parameter, and the number, of all shapes that reach there,
    /// in their order.
    fn each(
        &mut self,
        observation: &ImageObservation,
        predicted: [f64; 2],
        interior: &[f64; 12],
        shapes: impl Iterator<Item = (usize, Shape)>,
        mut tell: impl FnMut(usize, [f64; 2]),
    ) {
        let search = self.search;
        let image = &search.problem.image_contexts[observation.image as usize];
        let context = Context {
            block: &search.problem.block_context,
            image,
            column_px: predicted[0],
            row_px: predicted[1],
            surveyed: None,
        };
        let mut input = [Lane::default(); Stage::Image.inputs()];
        let numbers = predicted.iter().chain(interior);
        input.iter_mut().zip(numbers).for_each(|(to, value)| *to = Lane::splat(*value));
        for (number, shape) in shapes {
            let (x, y) = (predicted[0] - shape.place[0], predicted[1] - shape.place[1]);
            let reach = Shape::reach(shape.width);
            if x * x + y * y > reach * reach || image.camera != search.cameras[shape.variant] {
                continue;
            }
            self.waiting.push((number, shape));
            if self.waiting.len() == LANES {
                self.ask(&context, &input, &mut tell);
            }
        }
        self.ask(&context, &input, &mut tell);
    }

    /// Asks about the shapes that wait, and tells of those that move the point.
    fn ask(&mut self, context: &Context<'_>, input: &[Lane], tell: &mut impl FnMut(usize, [f64; 2])) {
        let Self { search, waiting, values, d_theta } = self;
        let [linear, px, py, pw] = search.parameters;
        let count = d_theta.len() / OUTPUTS;
        while !waiting.is_empty() {
            for (lane, own) in values.chunks_exact_mut(count).enumerate() {
                // The last one stands for those that are too few.
                let shape = waiting[lane.min(waiting.len() - 1)].1;
                own.copy_from_slice(&search.values[shape.variant]);
                (own[px], own[py], own[pw]) = (shape.place[0], shape.place[1], shape.width);
            }
            let thetas: [&[f64]; LANES] = std::array::from_fn(|lane| &values[lane * count..(lane + 1) * count]);
            let mut moved = [Lane::default(); OUTPUTS];
            let mut answer = Answer { out: &mut moved, d_input: None, d_theta: Some(&mut *d_theta) };
            if let Err(outside) =
                search.effect.eval_eight(&[*context; LANES], input, &Thetas::Own(&thetas), &mut answer)
            {
                waiting.remove(outside.min(waiting.len() - 1));
                continue;
            }
            for (lane, (number, _)) in waiting.drain(..).enumerate() {
                let d = [d_theta[linear][lane], d_theta[count + linear][lane]];
                if d != [0.0; OUTPUTS] {
                    tell(number, d);
                }
            }
        }
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
        let Measured { observation, predicted, interior, .. } = measured;
        let shapes = self.shapes.iter().copied().enumerate();
        Moves::new(self.search).each(observation, *predicted, interior, shapes, |column, d| {
            x.local(column, d[0]);
            y.local(column, d[1]);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::local_flaw::LocalFlaw;
    use crate::effects::{Descriptor, Effect, OutsideDomain};
    use crate::model::{EffectRef, Model};
    use crate::problem::Problem;
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    /// Least width of [`Narrow`], px.
    const LEAST: f64 = 300.0;

    /// A flaw that narrow ones are no part of.
    struct Narrow;

    impl Effect for Narrow {
        fn descriptor(&self) -> &Descriptor {
            LocalFlaw.descriptor()
        }

        fn eval(
            &self,
            context: &Context<'_>,
            input: &[f64],
            theta: &[f64],
            out: &mut [f64],
            d_input: Option<&mut [f64]>,
            d_theta: Option<&mut [f64]>,
        ) -> Result<(), OutsideDomain> {
            if theta[3] < LEAST {
                return Err(OutsideDomain);
            }
            LocalFlaw.eval(context, input, theta, out, d_input, d_theta)
        }
    }

    /// Shapes on the left half of a sensor of 4000 px by 3000 px, of three widths.
    fn shapes() -> Vec<Shape> {
        let place = |k: usize| [(k * 379 % 2000) as f64, (k * 631 % 3000) as f64];
        (0..150).map(|k| Shape { variant: k % 2, place: place(k), width: [200.0, 350.0, 500.0][k % 3] }).collect()
    }

    #[test]
    fn what_is_told_of_shapes_is_what_each_of_them_says_alone() {
        let scenario = Scenario::preset("mapping", &BTreeMap::from([("points".into(), 100.0)])).expect("a preset");
        let block = simulate(&scenario, 1).expect("a block").block;
        let problem = Problem::new(&block, &Model::default()).expect("a problem");
        let (observation, interior) = (&problem.observations[0], &problem.start.interiors[0]);
        let predicted = [1000.0, 1400.0];
        let context = Context {
            block: &problem.block_context,
            image: &problem.image_contexts[observation.image as usize],
            column_px: predicted[0],
            row_px: predicted[1],
            surveyed: None,
        };
        for (effect, least) in [(&LocalFlaw as &'static dyn Effect, 0.0), (&Narrow, LEAST)] {
            let search = Scan {
                problem: &problem,
                effect: EffectRef::Builtin(effect),
                variants: Vec::new(),
                parameters: [0, 1, 2, 3],
                cameras: vec![0; 2],
                values: [0.0, 1.0].map(|smooth| vec![0.0, 0.0, 0.0, 0.0, smooth]).to_vec(),
                sensor: [4000.0, 3000.0],
                widths: (200.0, 500.0),
            };
            let mut told = Vec::new();
            let mut moves = Moves::new(&search);
            moves.each(observation, predicted, interior, shapes().into_iter().enumerate(), |number, d| {
                told.push((number, d));
            });
            let mut input = [0.0; Stage::Image.inputs()];
            input[..OUTPUTS].copy_from_slice(&predicted);
            let alone = |(number, shape): (usize, Shape)| {
                let [x, y] = shape.place;
                let far = (x - predicted[0]).hypot(y - predicted[1]) > Shape::reach(shape.width);
                let theta = [0.0, x, y, shape.width, search.values[shape.variant][4]];
                let mut by_theta = [0.0; OUTPUTS * 5];
                let answered = effect.eval(&context, &input, &theta, &mut [0.0; OUTPUTS], None, Some(&mut by_theta));
                (!far && answered.is_ok()).then_some((number, [by_theta[0], by_theta[5]]))
            };
            let expected: Vec<(usize, [f64; 2])> = shapes().into_iter().enumerate().filter_map(alone).collect();
            assert_eq!(told, expected, "at least {least} px wide");
            let reaching = |width: f64| expected.iter().filter(|(number, _)| shapes()[*number].width == width).count();
            assert!(reaching(350.0) > LANES, "{expected:?}");
            assert_eq!(reaching(200.0) > 0, least == 0.0, "narrow ones");
        }
    }
}
