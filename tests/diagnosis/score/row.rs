//! A rolling shutter in noise: its expected score is zero, however many measurements there are. With the measured row
//! in its column the score is that of noise with itself, and grows with their number.

use super::blocks::{everything_free, fitted, options, preset, with_noise};
use super::in_turn::in_turn;
use misclosure::block::Block;
use misclosure::effects::find;
use misclosure::model::{Datum, EffectRef, EffectTerm};
use misclosure::null_model::{Columns, Entries, Measured, NullModel};
use misclosure::problem::{Problem, State};

/// Blocks with noise alone.
const BLOCKS: u64 = 12;
/// Of each.
const POINTS: f64 = 4000.0;
const NOISE_PX: f64 = 0.6;
/// What a mean may be off, in its own standard deviations: one of ten thousand is by chance, and the seeds are fixed.
const MOST_SIGMA: f64 = 4.0;

/// What the readout does to a plain camera, told with the row that was measured.
struct OfMeasuredRow<'a> {
    problem: &'a Problem,
    state: &'a State,
}

impl Columns for OfMeasuredRow<'_> {
    fn dense(&self) -> usize {
        1
    }

    fn local(&self) -> usize {
        0
    }

    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        let Measured { observation, point, interior, .. } = *measured;
        let image = observation.image as usize;
        let (pose, context) = (&self.state.poses[image], &self.problem.image_contexts[image]);
        let seen = pose.rotation * (self.state.points[point] - pose.centre);
        let moved = pose.rotation * context.velocity * -(observation.y / context.height_px - 0.5);
        let of = |k: usize| interior[0] * (moved[k] - seen[k] / seen.z * moved.z) / seen.z;
        x.dense(0, of(0));
        y.dense(0, of(1));
    }
}

/// Score of the readout time over its standard deviation at the fit without it: of the effect, and with the row that
/// was measured.
fn t_values(block: &Block) -> [f64; 2] {
    let fit = fitted(block, &everything_free());
    let sigma0 = (fit.chi_square() / fit.problem.redundancy().2 as f64).sqrt();
    let effect = EffectRef::Builtin(find("rolling-shutter").expect("an effect"));
    let term = EffectTerm { effect, values: Default::default(), held: vec!["t".into()] };
    let (problem, state) = fit
        .problem
        .with_effects(block, Datum::All, &[term], &fit.solution.state)
        .expect("the problem with a candidate");
    let unknown = problem.layout().theta(0);
    let null = NullModel::new(problem, state, vec![unknown], options().threads).expect("a null model");
    let columns = OfMeasuredRow { problem: null.problem(), state: null.state() };
    let system = null.test(&columns).expect("scores");
    [0, 1].map(|k| system.score[k] / system.information[(k, k)].sqrt() / sigma0)
}

#[test]
fn of_noise_alone_is_that_of_chance() {
    let mut block = preset("mapping", &[("points", POINTS)]);
    (block.sigma.tie_px, block.sigma.mark_px) = (NOISE_PX, NOISE_PX);
    let seeds: Vec<u64> = (1..=BLOCKS).collect();
    let each = in_turn(&seeds, |seed| t_values(&with_noise(&block, *seed)));
    let n = each.len() as f64;
    let mean = |k: usize, power: i32| each.iter().map(|t| t[k].powi(power)).sum::<f64>() / n;
    println!("t-values {each:.2?}, means {:.2} and {:.2}, mean square {:.2}", mean(0, 1), mean(1, 1), mean(0, 2));
    assert!(mean(0, 1).abs() * n.sqrt() < MOST_SIGMA, "mean {} of {n}", mean(0, 1));
    // That of n squares is 1 with the standard deviation of sqrt(2 / n).
    assert!((mean(0, 2) - 1.0).abs() < MOST_SIGMA * (2.0 / n).sqrt(), "mean square {} of {n}", mean(0, 2));
    assert!(mean(1, 1) * n.sqrt() > MOST_SIGMA, "a row that is measured shows in these blocks: mean {}", mean(1, 1));
}
