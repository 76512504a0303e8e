//! What is common to all measurements of one image at a state: rotation, centre, interior orientation after its
//! effects, and the values of the effect parameters that hold there.

use super::MeasureError;
use super::interior_chain::InteriorChain;
use super::plain::PlainView;
use crate::camera::{Interior, PARAMETER_COUNT as COUNT};
use crate::effects::{Context, OutsideDomain, Role, Scope, Stage};
use crate::math::lane::{LANES, Lane};
use crate::math::rotation;
use crate::problem::{Problem, State};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

/// Numbers that an interior effect gets.
const INPUTS: usize = Stage::Interior.inputs();

/// Which effects act at which stage, and where their parameters stand in the local list of an image.
#[derive(Debug, Clone)]
pub struct Stages {
    /// Positions of effects in the problem, by stage.
    by_stage: [Vec<usize>; Stage::ALL.len()],
    /// Per effect: position of its first parameter in the local list.
    pub local_offset: Vec<usize>,
    /// Length of the local list: all parameters of all effects.
    pub local_len: usize,
    /// Per effect: whether its parameters have the same values in every image.
    pub alike: Vec<bool>,
    /// Positions in the local list of the parameters of exposure and ray effects, and behind them of
    /// [`Self::place_columns`].
    pub ray_locals: Vec<usize>,
    /// Per effect: where its parameters stand in [`Self::ray_locals`].
    pub ray_places: Vec<Range<usize>>,
    /// Per effect: whether it reads column and row of the place at which the chain ends.
    pub reads_place: Vec<[bool; 2]>,
    /// The axes of the place that any effect which acts in the image reads: 0 column, 1 row. The derivatives of the
    /// image point by them stand behind the local list.
    pub place_axes: Vec<usize>,
}

impl Stages {
    /// Sorts the problem's effects by stage.
    pub fn new(problem: &Problem) -> Self {
        let mut by_stage: [Vec<usize>; Stage::ALL.len()] = Default::default();
        let mut local_offset = Vec::new();
        let mut local_len = 0;
        let (mut alike, mut reads_place) = (Vec::new(), Vec::new());
        for (e, instance) in problem.effects.iter().enumerate() {
            by_stage[instance.effect.descriptor().stage as usize].push(e);
            alike.push(instance.slots.iter().all(|(scope, _)| *scope == Scope::Global));
            reads_place.push(instance.effect.reads_place());
            local_offset.push(local_len);
            local_len += instance.slots.len();
        }
        let (ray_locals, ray_places, place_axes) = (Vec::new(), Vec::new(), Vec::new());
        Self { by_stage, local_offset, local_len, alike, ray_locals, ray_places, reads_place, place_axes }
            .with_ray_places(problem)
    }

    /// Finds the parameters of exposure and ray effects, and what is read of the place.
    fn with_ray_places(mut self, problem: &Problem) -> Self {
        self.ray_locals.clear();
        self.ray_places.clear();
        for e in 0..problem.effects.len() {
            let acts = [Stage::Exposure, Stage::Ray].into_iter().any(|stage| self.of(stage).contains(&e));
            let (first, own) = (self.ray_locals.len(), self.locals(problem, e));
            self.ray_locals.extend(own.filter(|_| acts));
            self.ray_places.push(first..self.ray_locals.len());
        }
        let of_image = || [Stage::Exposure, Stage::Ray, Stage::Image].into_iter().flat_map(|stage| self.of(stage));
        let axes: Vec<usize> = (0..2).filter(|axis| of_image().any(|e| self.reads_place[*e][*axis])).collect();
        self.ray_locals.extend(self.local_len..self.local_len + axes.len());
        self.place_axes = axes;
        self
    }

    /// Where the derivatives by the place stand in [`Self::ray_locals`], in the order of [`Self::place_axes`].
    pub fn place_columns(&self) -> Range<usize> {
        let end = self.ray_locals.len();
        end - self.place_axes.len()..end
    }

    /// Length of the local list and of what stands behind it.
    pub fn row_len(&self) -> usize {
        self.local_len + self.place_axes.len()
    }

    /// The effects that change anything at a state: those of a null size are the identity there, and a diagnosis asks
    /// with dozens of them.
    pub fn acting(problem: &Problem, state: &State) -> Self {
        let mut acts = vec![false; problem.effects.len()];
        for (entry, value) in problem.theta.iter().zip(&state.theta) {
            let effect = &problem.effects[entry.effect as usize].effect;
            let parameter = &effect.descriptor().parameters[entry.parameter as usize];
            let is_size = matches!(parameter.role, Role::Estimated | Role::Random(_));
            acts[entry.effect as usize] |= is_size && *value != parameter.nominal;
        }
        Self::new(problem).only(problem, |effect| acts[effect])
    }

    /// Some effects alone, their parameters where they stand in the whole list: what is left out is taken to change
    /// nothing, and its derivatives are zero.
    pub fn only(&self, problem: &Problem, keep: impl Fn(usize) -> bool) -> Self {
        let by_stage = self.by_stage.each_ref().map(|effects| effects.iter().copied().filter(|e| keep(*e)).collect());
        Self { by_stage, ..self.clone() }.with_ray_places(problem)
    }

    /// Effects of a stage, in the order in which they act.
    pub fn of(&self, stage: Stage) -> &[usize] {
        &self.by_stage[stage as usize]
    }

    /// Where the parameters of an effect stand in the local list.
    pub fn locals(&self, problem: &Problem, effect: usize) -> Range<usize> {
        let first = self.local_offset[effect];
        first..first + problem.effects[effect].slots.len()
    }

    /// Positions in the local list of what image points depend on before the image effect number `position`.
    pub fn before(&self, problem: &Problem, position: usize) -> impl Iterator<Item = usize> {
        let effects = &self.of(Stage::Image)[..position];
        self.ray_locals.iter().copied().chain(effects.iter().flat_map(|e| self.locals(problem, *e)))
    }

    /// Nothing acts between the plain camera and the image point.
    pub fn plain_image(&self) -> bool {
        [Stage::Exposure, Stage::Ray, Stage::Interior, Stage::Image].iter().all(|stage| self.of(*stage).is_empty())
    }

    /// Rays are straight from the object point to the projection centre of their image: nothing acts on exposure and
    /// ray.
    pub fn straight(&self) -> bool {
        [Stage::Exposure, Stage::Ray].iter().all(|stage| self.of(*stage).is_empty())
    }

    /// Positions in `theta` of the local list of an image.
    pub fn theta_indices(&self, problem: &Problem, image: usize) -> Vec<usize> {
        let context = &problem.image_contexts[image];
        problem
            .effects
            .iter()
            .flat_map(|instance| (0..instance.slots.len()).map(move |p| instance.theta_index(p, context)))
            .collect()
    }
}

/// One image at a state.
#[derive(Debug, Clone)]
pub struct Frame {
    /// `R`, world to camera.
    pub rotation: Matrix3<f64>,
    /// Projection centre, m.
    pub centre: Vector3<f64>,
    /// Rotation vector of `R`.
    pub rotation_vector: Vector3<f64>,
    /// `d rotation_vector / d w`.
    pub d_rotation_vector: Matrix3<f64>,
    /// The left Jacobian there, its inverse.
    pub left_jacobian: Matrix3<f64>,
    /// Interior orientation after the interior effects.
    pub interior: Interior,
    /// Its derivatives; `None` where no interior effect acts (identity).
    pub interior_chain: Option<Box<InteriorChain>>,
    /// Local list of effect parameters.
    pub theta: Vec<f64>,
    /// The numbers that measurements side by side are given once more, together: first rotation by rows, projection
    /// centre and rotation vector, then from the third lane on the interior orientation, and what [`Self::adds_few`]
    /// says.
    pub numbers: [Lane; 4],
    /// In all images that are prepared together the interior effects add to the interior orientation, and the
    /// derivatives by their parameters, in the order of [`InteriorChain::places`], are few enough to stand behind it in
    /// [`Self::numbers`].
    pub adds_few: bool,
}

/// How many that is.
const FEW: usize = 2 * LANES - COUNT;

impl Frame {
    /// Prepares image `image`. Errors: an interior effect outside its domain.
    pub fn new(problem: &Problem, stages: &Stages, state: &State, image: usize) -> Result<Self, OutsideDomain> {
        let pose = &state.poses[image];
        let context = &problem.image_contexts[image];
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let theta: Vec<f64> = stages.theta_indices(problem, image).iter().map(|t| state.theta[*t]).collect();
        let mut frame = Frame {
            rotation,
            centre: pose.centre,
            rotation_vector: Vector3::zeros(),
            d_rotation_vector: Matrix3::identity(),
            left_jacobian: Matrix3::identity(),
            interior: state.interiors[context.camera as usize],
            interior_chain: None,
            theta,
            numbers: [Lane::default(); 4],
            adds_few: false,
        };
        if !problem.effects.is_empty() {
            frame.rotation_vector = rotation::log(&rotation);
            frame.d_rotation_vector = rotation::left_jacobian_inverse(&frame.rotation_vector);
            frame.left_jacobian = rotation::left_jacobian(&frame.rotation_vector);
        }
        if !stages.of(Stage::Interior).is_empty() {
            frame.apply_interior_effects(problem, stages, image)?;
        }
        frame.put_together();
        Ok(frame)
    }

    /// Fills [`Self::numbers`].
    fn put_together(&mut self) {
        let by_rows = self.rotation.transpose();
        let of_image: Vec<f64> = by_rows.iter().chain(&self.centre).chain(&self.rotation_vector).copied().collect();
        for (lanes, numbers) in self.numbers.chunks_exact_mut(2).zip([&*of_image, &self.interior]) {
            for (lane, numbers) in lanes.iter_mut().zip(numbers.chunks(LANES)) {
                lane[..numbers.len()].copy_from_slice(numbers);
            }
        }
    }

    /// Puts the derivatives of its chain, which are few, behind the interior orientation.
    fn add_few(&mut self) {
        let derivatives = self.interior_chain.iter().flat_map(|chain| &chain.d_theta);
        for (k, value) in (COUNT..).zip(derivatives) {
            self.numbers[2 + k / LANES][k % LANES] = *value;
        }
        self.adds_few = true;
    }

    /// `(r, C)`.
    pub fn pose(&self) -> [f64; 6] {
        let [r, c] = [&self.rotation_vector, &self.centre];
        [r[0], r[1], r[2], c[0], c[1], c[2]]
    }

    /// A point as the plain camera sees it in this image.
    pub fn view(&self, object: &Vector3<f64>) -> PlainView<f64> {
        PlainView {
            rotation: by_rows(&self.rotation),
            centre: self.centre.into(),
            object: (*object).into(),
            interior: self.interior,
        }
    }

    fn apply_interior_effects(
        &mut self,
        problem: &Problem,
        stages: &Stages,
        image: usize,
    ) -> Result<(), OutsideDomain> {
        let context = Context {
            block: &problem.block_context,
            image: &problem.image_contexts[image],
            column_px: f64::NAN,
            row_px: f64::NAN,
            surveyed: None,
        };
        let mut d_interior = SMatrix::<f64, COUNT, COUNT>::identity();
        let mut d_rotation = SMatrix::<f64, COUNT, 3>::zeros();
        let mut d_theta = vec![[0.0; COUNT]; stages.local_len];
        let mut input = [0.0; INPUTS];
        input[COUNT..].copy_from_slice(self.rotation_vector.as_slice());
        let mut out = [0.0; COUNT];
        let mut d_in = [0.0; COUNT * INPUTS];
        for &e in stages.of(Stage::Interior) {
            let effect = &problem.effects[e].effect;
            let (offset, count) = (stages.local_offset[e], problem.effects[e].slots.len());
            let theta = &self.theta[offset..offset + count];
            input[..COUNT].copy_from_slice(&self.interior);
            let mut d_own = vec![0.0; COUNT * count];
            effect.eval(&context, &input, theta, &mut out, Some(&mut d_in), Some(&mut d_own))?;
            self.interior = out;
            let by_interior = SMatrix::<f64, COUNT, COUNT>::from_fn(|i, j| d_in[INPUTS * i + j]);
            let by_vector = SMatrix::<f64, COUNT, 3>::from_fn(|i, j| d_in[INPUTS * i + COUNT + j]);
            d_interior = by_interior * d_interior;
            d_rotation = by_interior * d_rotation + by_vector * self.d_rotation_vector;
            for column in d_theta.iter_mut().filter(|column| column.iter().any(|value| *value != 0.0)) {
                let moved = by_interior * SMatrix::<f64, COUNT, 1>::from_column_slice(column);
                column.copy_from_slice(moved.as_slice());
            }
            for p in 0..count {
                for i in 0..COUNT {
                    d_theta[offset + p][i] += d_own[count * i + p];
                }
            }
        }
        let (places, d_theta): (Vec<_>, Vec<f64>) = d_theta
            .iter()
            .enumerate()
            .flat_map(|(local, column)| {
                let entries = column.iter().enumerate().filter(|(_, value)| **value != 0.0);
                entries.map(move |(entry, value)| ((local, entry), *value))
            })
            .unzip();
        self.interior_chain = Some(Box::new(InteriorChain {
            d_interior: (d_interior != SMatrix::<f64, COUNT, COUNT>::identity()).then(|| Box::new(d_interior)),
            d_rotation: (d_rotation != SMatrix::<f64, COUNT, 3>::zeros()).then(|| Box::new(d_rotation)),
            places: places.into(),
            d_theta,
        }));
        Ok(())
    }
}

pub(super) fn by_rows(rotation: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|k| rotation[(i, k)]))
}

/// Prepares every image. Errors: the first image (in order) that cannot be prepared.
pub fn frames(problem: &Problem, stages: &Stages, state: &State) -> Result<Vec<Frame>, MeasureError> {
    let frame =
        |image: usize| Frame::new(problem, stages, state, image).map_err(|_| MeasureError::interior(problem, image));
    let mut frames: Vec<Frame> = (0..state.poses.len()).map(frame).collect::<Result<_, _>>()?;
    let chains = || frames.iter().filter_map(|frame| frame.interior_chain.as_deref());
    let all: BTreeSet<(usize, usize)> = chains().flat_map(|chain| chain.places.iter().copied()).collect();
    let all: Arc<[(usize, usize)]> = all.into_iter().collect();
    frames.iter_mut().filter_map(|frame| frame.interior_chain.as_mut()).for_each(|chain| chain.at_places(&all));
    let adds = |frame: &Frame| frame.interior_chain.as_ref().is_some_and(|chain| chain.adds());
    if all.len() <= FEW && frames.iter().all(adds) {
        frames.iter_mut().for_each(Frame::add_few);
    }
    Ok(frames)
}
