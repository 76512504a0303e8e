//! Places on the sensor that a single measurement holds. A shape that jumps at its centre can put the jump where one
//! measurement lies, and fits that one whatever it says: a cusp of the sum of squares, of which a fit sees neither how
//! it came there nor the way out.

use crate::adjust::AdjustError;
use crate::adjust::native::pool::Pool;
use crate::effects::Stage;
use crate::measure::{MeasureError, Prediction, Stages, frames, predict};
use crate::problem::{Problem, State};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Share of the information of a searched parameter from which one measurement knows more of it than all others
/// together.
const HELD: f64 = 0.5;

/// Points whose measurements are summed by one thread at a time.
const POINTS: usize = 1024;

/// Effects of the image with a searched parameter that one measurement holds.
///
/// # Errors
/// A state at which predictions fail.
pub(super) fn effects(problem: &Problem, state: &State, threads: usize) -> Result<BTreeSet<u32>, AdjustError> {
    let of_image = |t: &usize| {
        let effect = &problem.effects[problem.theta[*t].effect as usize].effect;
        effect.descriptor().stage == Stage::Image
    };
    let searched: Vec<usize> = problem.searched().into_iter().filter(of_image).collect();
    if searched.is_empty() {
        return Ok(BTreeSet::new());
    }
    let stages = Stages::acting(problem, state);
    let frames = frames(problem, &stages, state)?;
    // Of each image: where a searched parameter stands in its local list, and in the list of those.
    let places = |image: usize| -> Vec<(usize, usize)> {
        let thetas = stages.theta_indices(problem, image).into_iter().enumerate();
        thetas.filter_map(|(local, t)| Some((local, searched.iter().position(|s| *s == t)?))).collect()
    };
    let places: Vec<Vec<(usize, usize)>> = (0..frames.len()).map(places).collect();
    let sums = |first: usize| -> Result<Vec<Information>, MeasureError> {
        let mut sums = vec![Information::default(); searched.len()];
        let mut prediction = Prediction::default();
        for point in first..(first + POINTS).min(state.points.len()) {
            for observation in &problem.observations[problem.point_start[point]..problem.point_start[point + 1]] {
                let image = observation.image as usize;
                predict(problem, &stages, &frames[image], image, &state.points[point], &mut prediction)
                    .ok_or_else(|| MeasureError::image_point(problem, point, image))?;
                for (local, place) in &places[image] {
                    let [x, y] = [0, 1].map(|i| prediction.d_theta[i][*local] * observation.inverse_sigma);
                    sums[*place].add(x * x + y * y);
                }
            }
        }
        Ok(sums)
    };
    let firsts: Vec<usize> = (0..state.points.len()).step_by(POINTS).collect();
    let parts: Result<Vec<_>, _> = Pool::new(threads)?.install(|| firsts.into_par_iter().map(sums).collect());
    let mut all = vec![Information::default(); searched.len()];
    for part in parts? {
        all.iter_mut().zip(part).for_each(|(all, part)| all.join(part));
    }
    let held = searched.into_iter().zip(all).filter(|(_, of)| of.largest > HELD * of.sum);
    Ok(held.map(|(t, _)| problem.theta[t].effect).collect())
}

/// What measurements know of a parameter.
#[derive(Clone, Copy, Default)]
struct Information {
    sum: f64,
    /// Of one measurement.
    largest: f64,
}

impl Information {
    fn add(&mut self, of_one: f64) {
        self.join(Self { sum: of_one, largest: of_one });
    }

    fn join(&mut self, other: Self) {
        self.sum += other.sum;
        self.largest = self.largest.max(other.largest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{EffectRef, EffectTerm, Model};
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn a_sharp_spot_centred_on_a_measurement_is_held_by_it() {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 300.0)])).expect("a preset");
        let block = simulate(&scenario, 1).expect("a block").block;
        let at = &block.ties[100];
        let held = |off: f64, smooth: f64| {
            let values = [
                ("lambda", 0.5),
                ("centre_x", at.x + off),
                ("centre_y", at.y + off),
                ("sigma", 600.0),
                ("smooth", smooth),
            ];
            let values = values.map(|(name, value)| (name.to_string(), value)).into();
            let effect = EffectRef::Builtin(crate::effects::find("local-flaw").expect("an effect"));
            let effects = vec![EffectTerm { effect, values, held: vec![] }];
            let problem = Problem::new(&block, &Model { effects, ..Model::default() }).expect("a problem");
            super::effects(&problem, &problem.start, 1).expect("predictions")
        };
        assert_eq!(held(0.01, 0.0), BTreeSet::from([0]));
        assert!(held(0.01, 1.0).is_empty(), "a smooth one has no jump");
        let nearest = |off: f64| {
            let rows = block.ties.iter().chain(&block.marks);
            rows.map(|row| (row.x - at.x - off).hypot(row.y - at.y - off)).fold(f64::INFINITY, f64::min)
        };
        let far = (10..200).map(f64::from).find(|off| nearest(*off) > 30.0).expect("a gap between measurements");
        assert!(held(far, 0.0).is_empty(), "as far from one as from others");
    }
}
