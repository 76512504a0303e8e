//! Observed positions: antennas (GNSS) and control coordinates, through their effects.

use super::frame::{Frame, Stages};
use crate::effects::{Context, ImageContext, Stage, SurveyedKind};
use crate::problem::Problem;
use nalgebra::{SMatrix, Vector3};

/// Predicted position and its derivatives.
#[derive(Debug, Clone)]
pub struct PositionPrediction {
    /// Predicted, m.
    pub position: Vector3<f64>,
    /// 3x6: by rotation `w` and projection centre (antenna), or by the point in the last three columns (control).
    pub derivative: SMatrix<f64, 3, 6>,
    /// By the local list of effect parameters, 3 each.
    pub d_theta: Vec<[f64; 3]>,
}

impl PositionPrediction {
    fn identity(position: Vector3<f64>, local_len: usize) -> Self {
        let mut derivative = SMatrix::<f64, 3, 6>::zeros();
        derivative.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        Self { position, derivative, d_theta: vec![[0.0; 3]; local_len] }
    }

    /// Chains one effect: `by_position` (3x3) of what it was given, own derivatives (3 x count, row-major).
    fn chain(&mut self, by_position: &SMatrix<f64, 3, 3>, own: &[f64], offset: usize, count: usize) {
        self.derivative = by_position * self.derivative;
        for column in &mut self.d_theta {
            *column = (by_position * Vector3::from(*column)).into();
        }
        for p in 0..count {
            for i in 0..3 {
                self.d_theta[offset + p][i] += own[count * i + p];
            }
        }
    }
}

/// Antenna position of an image: the projection centre, moved by the position effects one after the other.
pub fn predict_antenna(problem: &Problem, stages: &Stages, frame: &Frame, image: usize) -> Option<PositionPrediction> {
    let context = Context {
        block: &problem.block_context,
        image: &problem.image_contexts[image],
        column_px: f64::NAN,
        row_px: f64::NAN,
        surveyed: None,
    };
    let mut prediction = PositionPrediction::identity(frame.centre, stages.local_len);
    for &e in stages.of(Stage::Position) {
        let (offset, count) = (stages.local_offset[e], problem.effects[e].slots.len());
        let theta = &frame.theta[offset..offset + count];
        let mut input = [0.0; 6];
        input[..3].copy_from_slice(frame.rotation_vector.as_slice());
        input[3..].copy_from_slice(prediction.position.as_slice());
        let mut next = [0.0; 3];
        let mut d_in = [0.0; 18];
        let mut d_own = vec![0.0; 3 * count];
        let effect = &problem.effects[e].effect;
        effect.eval(&context, &input, theta, &mut next, Some(&mut d_in), Some(&mut d_own)).ok()?;
        let d_in = SMatrix::<f64, 3, 6>::from_row_slice(&d_in);
        prediction.chain(&d_in.fixed_view::<3, 3>(0, 3).into_owned(), &d_own, offset, count);
        let turned = d_in.fixed_view::<3, 3>(0, 0) * frame.d_rotation_vector;
        for i in 0..3 {
            for k in 0..3 {
                prediction.derivative[(i, k)] += turned[(i, k)];
            }
        }
        prediction.position = Vector3::from(next);
    }
    let context = Context { surveyed: Some(SurveyedKind::Antenna), ..context };
    let own = |e: usize| frame.theta[stages.local_offset[e]..][..problem.effects[e].slots.len()].to_vec();
    move_coordinate(problem, stages, Stage::Frame, &context, own, &mut prediction)?;
    Some(prediction)
}

/// Surveyed coordinates of a point, moved by the control effects and then by those of the frame, one after the other.
pub fn predict_surveyed(
    problem: &Problem,
    stages: &Stages,
    theta: &[f64],
    point: &Vector3<f64>,
) -> Option<PositionPrediction> {
    let image = ImageContext::default();
    let (block, column_px, row_px) = (&problem.block_context, f64::NAN, f64::NAN);
    let context = Context { block, image: &image, column_px, row_px, surveyed: None };
    let mut prediction = PositionPrediction::identity(*point, stages.local_len);
    let own = |e: usize| {
        let instance = &problem.effects[e];
        (0..instance.slots.len()).map(|p| theta[instance.theta_index(p, &image)]).collect()
    };
    move_coordinate(problem, stages, Stage::Control, &context, own, &mut prediction)?;
    let context = Context { surveyed: Some(SurveyedKind::Point), ..context };
    move_coordinate(problem, stages, Stage::Frame, &context, own, &mut prediction)?;
    Some(prediction)
}

/// Chains the effects of a stage whose only input is a coordinate; `own` gives an effect's parameters.
fn move_coordinate(
    problem: &Problem,
    stages: &Stages,
    stage: Stage,
    context: &Context<'_>,
    own: impl Fn(usize) -> Vec<f64>,
    prediction: &mut PositionPrediction,
) -> Option<()> {
    for &e in stages.of(stage) {
        let instance = &problem.effects[e];
        let (offset, count) = (stages.local_offset[e], instance.slots.len());
        let input = prediction.position;
        let mut next = [0.0; 3];
        let mut d_in = [0.0; 9];
        let mut d_own = vec![0.0; 3 * count];
        instance.effect.eval(context, input.as_slice(), &own(e), &mut next, Some(&mut d_in), Some(&mut d_own)).ok()?;
        prediction.chain(&SMatrix::<f64, 3, 3>::from_row_slice(&d_in), &d_own, offset, count);
        prediction.position = Vector3::from(next);
    }
    Some(())
}
