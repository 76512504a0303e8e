//! The focal length at which rays meet best: one parameter, searched.

use super::alternatives::Alternative;
use super::cause::Cause;
use super::lens::Lens;
use super::meet::{Misfit, misfit};
use super::scene::Scene;

/// Factors that are no lens of another kind: what is nearer is left to the adjustment, which finds it from there.
const NEAR: [f64; 2] = [0.7, 1.4];
/// Factors that are searched: from a fisheye to a long lens.
const RANGE: [f64; 2] = [0.15, 7.0];
/// Step of the search: rays that meet at one factor meet half as well at the next.
const STEP: f64 = 1.12;
/// Halvings of the step about the best factor: to one part in a thousand.
const HALVINGS: usize = 7;
/// How many times rays meet better. Less than for other mistakes: a wrong focal length bends rays continuously, poses
/// that are off by a third of a degree leave no factor of ten, and at a right focal length no other one lets rays meet
/// twice as well.
pub const BEYOND: f64 = 5.0;

/// The focal length that fits best, where it is far from the recorded one.
pub fn estimated(scene: &Scene, own: &Misfit) -> Option<Alternative> {
    let of = |factor: f64| Alternative::new(&[Cause::Lens(Lens::Focal(factor))]);
    let times = |factor: f64| -> f64 {
        let undone = of(factor).undone(scene).and_then(|scene| misfit(&scene));
        undone.map_or(0.0, |undone| own.times(&undone))
    };
    let steps = (RANGE[1] / RANGE[0]).ln() / STEP.ln();
    let factors = (0..=steps as i32).map(|step| RANGE[0] * STEP.powi(step));
    let mut best = factors.map(|factor| (times(factor), factor)).max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let mut step = STEP;
    for _ in 0..HALVINGS {
        step = step.sqrt();
        for factor in [best.1 / step, best.1 * step] {
            let trial = (times(factor), factor);
            best = if trial.0 > best.0 { trial } else { best };
        }
    }
    let is_far = !(NEAR[0]..=NEAR[1]).contains(&best.1);
    (is_far && best.0 > 1.0).then(|| of(best.1))
}
