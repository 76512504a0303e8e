//! The forward model of certificates: what is measured at a state, in extended precision. The chain of
//! `CONVENTIONS.md`, written a third time.

use super::laws::{self, Law, Mat3, Vec3};
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PPX, PPY};
use crate::effects::{Context, ImageContext, Stage, SurveyedKind};
use crate::math::DoubleDouble;
use crate::math::jet::{Jet, Real};
use crate::problem::{Problem, State};

/// A state in double-double. Rotations are matrices, which stay orthogonal to all digits.
#[derive(Debug, Clone)]
pub struct ExtendedState {
    /// Interior orientations, one per camera.
    pub interiors: Vec<[DoubleDouble; PARAMETER_COUNT]>,
    /// Effect parameters.
    pub theta: Vec<DoubleDouble>,
    /// Rotations, world to camera.
    pub rotations: Vec<Mat3<DoubleDouble>>,
    /// Projection centres, m.
    pub centres: Vec<Vec3<DoubleDouble>>,
    /// Points, m.
    pub points: Vec<Vec3<DoubleDouble>>,
}

impl From<&State> for ExtendedState {
    fn from(state: &State) -> Self {
        let wide = |v: [f64; 3]| v.map(DoubleDouble::from);
        Self {
            interiors: state.interiors.iter().map(|interior| interior.map(DoubleDouble::from)).collect(),
            theta: state.theta.iter().map(|value| DoubleDouble::from(*value)).collect(),
            rotations: state
                .poses
                .iter()
                .map(|pose| {
                    let q = pose.rotation.quaternion();
                    rotation_of([q.w, q.i, q.j, q.k].map(DoubleDouble::from))
                })
                .collect(),
            centres: state.poses.iter().map(|pose| wide(pose.centre.into())).collect(),
            points: state.points.iter().map(|point| wide((*point).into())).collect(),
        }
    }
}

/// The rotation of a quaternion (w, x, y, z) of any length.
fn rotation_of([w, x, y, z]: [DoubleDouble; 4]) -> Mat3<DoubleDouble> {
    let square = w * w + x * x + y * y + z * z;
    let twice = |a: DoubleDouble| a * 2.0 / square;
    let one = DoubleDouble::ONE;
    [
        [one - twice(y * y + z * z), twice(x * y - w * z), twice(x * z + w * y)],
        [twice(x * y + w * z), one - twice(x * x + z * z), twice(y * z - w * x)],
        [twice(x * z - w * y), twice(y * z + w * x), one - twice(x * x + y * y)],
    ]
}

/// Unknowns that one measurement can depend on before those of effects: interior orientation, pose, point.
pub const PLAIN: usize = PARAMETER_COUNT + 9;

/// A point appears in the row that it was exposed in to this, px: some units of the last digit of a double-double of
/// thousands.
const EXACT_PX: f64 = 1e-26;
/// Steps to there; where so many do not suffice, a row sees the point twice or never.
const STEPS: usize = 40;

/// What a measurement is predicted from: numbers, or numbers with derivatives.
pub struct Given<T> {
    /// Interior orientation of the camera.
    pub interior: [T; PARAMETER_COUNT],
    /// Rotation, world to camera.
    pub rotation: Mat3<T>,
    /// Projection centre, m.
    pub centre: Vec3<T>,
    /// Object point, m.
    pub point: Vec3<T>,
    /// Effect parameters that hold for the image, effect by effect.
    pub theta: Vec<T>,
}

/// The effects of a problem, sorted by stage.
pub struct Forward<'a> {
    problem: &'a Problem,
    laws: Vec<(Stage, Law, usize, usize)>,
    /// Length of the local list of effect parameters.
    pub local: usize,
}

/// An effect that certificates do not know.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("effect `{0}` has no formula for certificates, expected one of \
         {known}", known = Law::ALL.map(|(id, _)| id).join(", "))]
pub struct UnknownLaw(pub String);

impl<'a> Forward<'a> {
    /// Prepares the effects of a problem.
    ///
    /// # Errors
    /// An effect that has no formula here.
    pub fn new(problem: &'a Problem) -> Result<Self, UnknownLaw> {
        let mut laws = Vec::new();
        let mut local = 0;
        for instance in &problem.effects {
            let descriptor = instance.effect.descriptor();
            let law = Law::of(&descriptor.id).ok_or_else(|| UnknownLaw(descriptor.id.to_string()))?;
            laws.push((descriptor.stage, law, local, local + instance.slots.len()));
            local += instance.slots.len();
        }
        Ok(Self { problem, laws, local })
    }

    fn of(&self, stage: Stage) -> impl Iterator<Item = (Law, std::ops::Range<usize>)> {
        self.laws.iter().filter(move |law| law.0 == stage).map(|(_, law, from, to)| (*law, *from..*to))
    }

    fn context(&self, image: &'a ImageContext) -> Context<'a> {
        let block = &self.problem.block_context;
        Context { block, image, column_px: f64::NAN, row_px: f64::NAN, surveyed: None }
    }

    /// Positions in `theta` of the local list, for an image (or of what is global).
    pub fn theta_indices(&self, image: &ImageContext) -> Vec<usize> {
        let of = |instance: &'a crate::problem::EffectInstance| {
            (0..instance.slots.len()).map(move |p| instance.theta_index(p, image)).collect::<Vec<_>>()
        };
        self.problem.effects.iter().flat_map(of).collect()
    }

    /// Predicted image point, px. `None`: behind the camera, outside the domain of an effect, or in no row of its own.
    pub fn image_point<T: Real>(&self, image: usize, given: &Given<T>) -> Option<[T; 2]> {
        let context = self.context(&self.problem.image_contexts[image]);
        // The row in which the point appears is exposed at the pose that puts it there. Without the exposure stage no
        // row is asked for.
        let mut row = given.point[0].like(0.5 * context.image.height_px);
        let mut xy = self.in_row(&context, row, given)?;
        if self.of(Stage::Exposure).next().is_none() {
            return Some(xy);
        }
        // From row to row the point moves by nearly the same: with that slope each step gains a hundred thousand
        // times, of values and derivatives.
        let slope = (self.in_row(&context, row + row.like(1.0), given)?[1] - xy[1]).double();
        for _ in 0..STEPS {
            row = row + (xy[1] - row) / row.like(1.0 - slope);
            xy = self.in_row(&context, row, given)?;
            if (xy[1] - row).double().abs() <= EXACT_PX {
                return Some(xy);
            }
        }
        None
    }

    /// The image point that the pose of one row sees.
    fn in_row<T: Real>(&self, context: &Context<'_>, row: T, given: &Given<T>) -> Option<[T; 2]> {
        let (mut rotation, mut centre, mut point) = (given.rotation, given.centre, given.point);
        for (law, own) in self.of(Stage::Exposure) {
            laws::exposure(law, context, row, &given.theta[own], &mut rotation, &mut centre)?;
        }
        for (law, own) in self.of(Stage::Ray) {
            point = laws::ray(law, &given.theta[own], &rotation, &centre, &point)?;
        }
        let mut interior = given.interior;
        for (law, own) in self.of(Stage::Interior) {
            laws::interior(law, context, &given.theta[own], &given.rotation, &mut interior)?;
        }
        let seen = laws::times(&rotation, &laws::minus(&point, &centre));
        let mut xy = laws::camera(&interior, &seen)?;
        for (law, own) in self.of(Stage::Image) {
            xy = laws::image(law, &given.theta[own], &interior, xy)?;
        }
        Some(xy)
    }

    /// Predicted antenna position, m.
    pub fn antenna<T: Real>(&self, image: usize, given: &Given<T>) -> Option<Vec3<T>> {
        let mut context = self.context(&self.problem.image_contexts[image]);
        let mut antenna = given.centre;
        for (law, own) in self.of(Stage::Position) {
            antenna = laws::position(law, &context, &given.theta[own], &given.rotation, &antenna)?;
        }
        context.surveyed = Some(SurveyedKind::Antenna);
        self.in_frame(&context, antenna, &given.theta)
    }

    /// Predicted coordinates of a surveyed point, m.
    pub fn surveyed<T: Real>(&self, given: &Given<T>) -> Option<Vec3<T>> {
        if self.of(Stage::Control).next().is_some() {
            return None;
        }
        let nowhere = ImageContext::default();
        let block = &self.problem.block_context;
        let kind = Some(SurveyedKind::Point);
        let context = Context { block, image: &nowhere, column_px: f64::NAN, row_px: f64::NAN, surveyed: kind };
        self.in_frame(&context, given.point, &given.theta)
    }

    fn in_frame<T: Real>(&self, context: &Context<'_>, mut at: Vec3<T>, theta: &[T]) -> Option<Vec3<T>> {
        for (law, own) in self.of(Stage::Frame) {
            at = laws::frame(law, context, &theta[own], &at)?;
        }
        Some(at)
    }

    /// The numbers of a measurement of `point` in `image`. Either may be missing, where nothing depends on it.
    pub fn numbers(&self, state: &ExtendedState, image: Option<usize>, point: Option<usize>) -> Given<DoubleDouble> {
        let nowhere = ImageContext::default();
        let context = image.map_or(&nowhere, |image| &self.problem.image_contexts[image]);
        let mut interior = state.interiors[context.camera as usize];
        if self.problem.tie_dc_to_pp {
            (interior[DCX], interior[DCY]) = (interior[PPX], interior[PPY]);
        }
        let i = image.unwrap_or(0);
        Given {
            interior,
            rotation: state.rotations[i],
            centre: state.centres[i],
            point: state.points[point.unwrap_or(0)],
            theta: self.theta_indices(context).iter().map(|t| state.theta[*t]).collect(),
        }
    }

    /// The same with derivatives: by the interior orientation (0 to 11), the turn `w` and the centre of the pose, the
    /// point, and then the local list of effect parameters.
    pub fn jets<const N: usize>(&self, numbers: &Given<DoubleDouble>) -> Given<Jet<DoubleDouble, N>> {
        let mut interior: [Jet<DoubleDouble, N>; PARAMETER_COUNT] =
            std::array::from_fn(|k| Jet::unknown(numbers.interior[k], k));
        if self.problem.tie_dc_to_pp {
            (interior[DCX], interior[DCY]) = (interior[PPX], interior[PPY]);
        }
        let mut rotation = numbers.rotation.map(|row| row.map(Jet::constant));
        // d (exp([w]x) R) / d w_k = [e_k]x R.
        for j in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|i| numbers.rotation[i][j]);
            let column = [[DoubleDouble::ZERO, -c, b], [c, DoubleDouble::ZERO, -a], [-b, a, DoubleDouble::ZERO]];
            for (k, by_w) in column.into_iter().enumerate() {
                for (i, slope) in by_w.into_iter().enumerate() {
                    rotation[i][j].slope[PARAMETER_COUNT + k] = slope;
                }
            }
        }
        let from = |values: &Vec3<DoubleDouble>, first: usize| -> Vec3<Jet<DoubleDouble, N>> {
            std::array::from_fn(|k| Jet::unknown(values[k], first + k))
        };
        Given {
            interior,
            rotation,
            centre: from(&numbers.centre, PARAMETER_COUNT + 3),
            point: from(&numbers.point, PARAMETER_COUNT + 6),
            theta: numbers.theta.iter().enumerate().map(|(k, value)| Jet::unknown(*value, PLAIN + k)).collect(),
        }
    }
}
