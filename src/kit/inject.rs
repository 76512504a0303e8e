//! An effect of one's own as an error of a simulated block.
//!
//! The errors of [`crate::inject`] simulate causes and know no formula of the estimator. What a plug-in injects is its
//! own formula, which the estimator takes out again: such a block shows that the kit works and what a block can tell,
//! never that the formula is that of nature. Whatever is made from it says so ([`Applied::shared_formula`]).

use crate::block::{Block, Role};
use crate::effects::Role as ParameterRole;
use crate::inject::{Action, Applied, Loss, Observations, Random, World};
use crate::measure::Predictor;
use crate::model::{Datum, EffectTerm, Model};
use crate::problem::{Problem, State};
use anyhow::{Context as _, Result, ensure};
use nalgebra::Vector3;
use rayon::prelude::*;

/// An effect at work in a world by its formula.
pub struct ByFormula {
    problem: Problem,
    state: State,
    drawn: Vec<(String, String)>,
}

impl ByFormula {
    /// Prepares `term` in the world of a block and its truth; values of random parameters are drawn from `seed`. With
    /// it comes its line in the report.
    ///
    /// # Errors
    /// A size that is not given, a need that the block does not meet, a place where the effect gives no values.
    pub fn new(block: &Block, truth: &Block, term: &EffectTerm, seed: u64) -> Result<(Applied, Self)> {
        let descriptor = term.effect.descriptor();
        let id = descriptor.id.to_string();
        let of_size = |role: &ParameterRole| matches!(role, ParameterRole::Estimated | ParameterRole::Random(_));
        let sized = |p: &&crate::effects::Parameter| {
            let random = matches!(p.role, ParameterRole::Random(_));
            let own = |key: &String| key.split('[').next() == Some(p.name.as_ref());
            random || of_size(&p.role) && term.values.iter().any(|(key, value)| own(key) && *value != p.nominal)
        };
        let example = descriptor.parameters.iter().find(|p| of_size(&p.role));
        ensure!(
            descriptor.parameters.iter().any(|p| sized(&p)),
            "error `{id}`: no size is given, so nothing would happen: give one, as {}",
            example.map_or_else(String::new, |p| format!("{id}:{}={}", p.name, p.typical))
        );
        let world = World::new(block, truth)?;
        let mut actual = block.clone();
        actual.cameras.clone_from(&world.cameras);
        actual.images.clone_from(&world.images);
        actual.surveyed.clone_from(&world.surveyed);
        for (point, position) in actual.tie_points.iter_mut().zip(&world.tie_points) {
            point.position = Some(*position);
        }
        let observed = actual.images.iter().any(|image| image.gnss.is_some()) || actual.count(Role::Control) > 0;
        let datum = if observed { Datum::All } else { Datum::Free };
        let model = Model { datum, effects: vec![term.clone()], ..Model::default() };
        let problem = Problem::new(&actual, &model).with_context(|| format!("error `{id}`"))?;
        // What the problem made of the block to start from is not the truth.
        let mut state = problem.start.clone();
        state.poses = actual.images.iter().map(|image| image.pose).collect();
        state.interiors = actual.cameras.iter().map(|camera| camera.interior).collect();
        let mut random = Random::new(seed, &id, 0);
        let mut drawn = Vec::new();
        for (value, entry) in state.theta.iter_mut().zip(&problem.theta) {
            if let (ParameterRole::Random(_), Some(sigma)) =
                (&descriptor.parameters[entry.parameter as usize].role, entry.prior_sigma)
            {
                *value = sigma * random.normal();
                drawn.push((entry.short_name(&id).to_string(), value.to_string()));
            }
        }
        Predictor::new(&problem, &state).with_context(|| format!("error `{id}`"))?;
        let parameters = term.values.iter().map(|(name, value)| (name.clone().into(), value.to_string())).collect();
        let shared_formula = Some(match term.effect.origin() {
            Some(origin) => format!("plug-in {}, SHA-256 {}", origin.path.display(), origin.sha256),
            None => "an effect of the library's user".into(),
        });
        let applied = Applied { id: id.into(), parameters, notes: Vec::new(), shared_formula };
        Ok((applied, Self { problem, state, drawn }))
    }
}

impl Action for ByFormula {
    fn measured(&mut self, world: &World, observations: &mut Observations) {
        // It was made once already.
        let Ok(predictor) = Predictor::new(&self.problem, &self.state) else { return };
        let displaced = |image: usize, position: &Vector3<f64>, seen: [f64; 2]| -> Result<[f64; 2], Loss> {
            let exact = world.exact(image, position).ok_or(Loss::Behind)?;
            let ([x, y], _) = predictor.image_point(image, position).ok_or(Loss::NoSolution)?;
            Ok([seen[0] + x - exact[0], seen[1] + y - exact[1]])
        };
        let Observations { ties, marks, antennas, surveyed } = observations;
        ties.par_iter_mut().zip(&world.ties).for_each(|(seen, tie)| {
            let point = &world.tie_points[tie.point.index()];
            *seen = seen.and_then(|xy| displaced(tie.image.index(), point, xy));
        });
        marks.par_iter_mut().zip(&world.marks).for_each(|(seen, mark)| {
            let point = &world.surveyed[mark.point.index()].position;
            *seen = seen.and_then(|xy| displaced(mark.image.index(), point, xy));
        });
        for (image, antenna) in antennas.iter_mut().enumerate() {
            if let (Some(antenna), Some(with)) = (antenna, predictor.antenna(image)) {
                *antenna += with - world.images[image].pose.centre;
            }
        }
        for (position, point) in surveyed.iter_mut().zip(&world.surveyed) {
            if let Some(with) = predictor.surveyed(&point.position) {
                *position += with - point.position;
            }
        }
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.drawn.clone()
    }
}
