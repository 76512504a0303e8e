//! A block oriented by its tie points alone: its shape up to a similarity, whatever was surveyed.

use crate::adjust::native::Native;
use crate::adjust::{Covariance, CovarianceOf, Options, Solver};
use crate::block::{Block, ByPoint, PointId};
use crate::camera::F;
use crate::mistakes::Focal;
use crate::model::{Datum, Model};
use crate::problem::with_priors;
use crate::run::fit::Fit;
use crate::snooping::settle::{Settling, settle};
use crate::snooping::{Snooping, Strictness, robust_fit};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// Tie points of each image that orient it: ten times as many as an orientation needs, over the sensor.
const POINTS_PER_IMAGE: usize = 60;
/// What a focal length may move heights by to tell two height systems apart, m: a third of what these differ by at
/// least.
const TOLD_M: f64 = 10.0 / 3.0;
/// Variance factor with the camera held as stated, over that with a free one, up to which the ties allow the stated
/// one: residuals twice as large.
const AS_GOOD: f64 = 4.0;

/// The block by some of its tie points, with a loss that single false matches cannot bend. Where they do not tell the
/// focal length well enough for heights, the camera is held as stated if the ties allow that.
pub fn free_network(block: &Block, model: &Model, options: &Options) -> Option<Oriented> {
    let few = thinned(block);
    // What acts on surveyed coordinates alone has nothing to act on.
    let free = Model { datum: Datum::Free, effects: Vec::new(), ..model.clone() };
    let free = with_priors(&few, &Model { priors: model.priors.clone(), ..free }).ok()?;
    let mut search = Snooping::new(&few, &free);
    let free = Oriented::new(fit_of_most(&few, &mut search, &free, options)?, options);
    let meets = search.block(&few);
    let tells = matches!(free.focal, Focal::Determined(share) if share * distance(&free.fit) < TOLD_M);
    if tells {
        return Some(free);
    }
    let held = Model { free: [false; 12], priors: Vec::new(), ..free.fit.model.clone() };
    let held = robust_fit(&meets, &held, Some(&free.fit), options).ok();
    let variance = |fit: &Fit| fit.chi_square() / fit.problem.redundancy().2 as f64;
    match held.filter(|held| variance(held) < AS_GOOD * variance(&free.fit)) {
        Some(held) => Some(Oriented { focal: Focal::Stated, ..Oriented::new(held, options) }),
        None => Some(free),
    }
}

/// The block by some of its tie points and its GNSS positions, which hold it straight; the focal length as stated
/// where the ties do not tell it.
pub fn network_by_gnss(block: &Block, model: &Model, focal: Focal, options: &Options) -> Option<Fit> {
    let few = thinned(block);
    let mut model = Model { datum: Datum::Gnss, effects: Vec::new(), ..model.clone() };
    model.free[F] &= focal != Focal::Stated;
    let model = with_priors(&few, &model).ok()?;
    fit_of_most(&few, &mut Snooping::new(&few, &model), &model, options)
}

/// A robust fit; where an image that nothing holds keeps it from an end, or the rays of a point part, a fit without
/// what does not agree with the rest.
fn fit_of_most(block: &Block, search: &mut Snooping, model: &Model, options: &Options) -> Option<Fit> {
    if let Ok(fit) = robust_fit(&search.block(block), model, None, options) {
        return Some(fit);
    }
    let settling = Settling { options, snoop: true, tell: &|_| {} };
    settle(block, search, model, None, Strictness::Loose, &settling).ok()
}

/// A free network.
pub struct Oriented {
    /// The fit.
    pub fit: Fit,
    /// What it knows of the focal length.
    pub focal: Focal,
    /// Threads that it may be asked with.
    pub threads: usize,
}

impl Oriented {
    fn new(fit: Fit, options: &Options) -> Self {
        let threads = options.threads;
        let options = Options { covariance: CovarianceOf::Shared, may_stay_unconverged: true, ..options.clone() };
        let mut problem = fit.problem.clone();
        problem.start = fit.solution.state.clone();
        let solution = Native.solve(&problem, &options, &mut |_| ControlFlow::Continue(())).ok();
        let variance = (fit.chi_square() / problem.redundancy().2 as f64).max(1.0);
        let covariance = solution.and_then(|solution| solution.covariance);
        let share = |covariance: &Covariance| {
            let layout = problem.layout();
            let of = |(k, unknown): (usize, &usize)| {
                let (camera, parameter) = layout.camera_parameter(*unknown)?;
                let focal = fit.solution.state.interiors[camera][F];
                (parameter == F).then(|| (covariance.shared[(k, k)] * variance).sqrt() / focal)
            };
            covariance.shared_unknowns.iter().enumerate().filter_map(of).fold(0.0, f64::max)
        };
        let focal = covariance.as_ref().map_or(Focal::Stated, |covariance| Focal::Determined(share(covariance)));
        Self { fit, focal, threads }
    }
}

/// The block with so many tie points that each image keeps [`POINTS_PER_IMAGE`], and without marks.
fn thinned(block: &Block) -> Block {
    let by_point = ByPoint::new(&block.ties, block.tie_points.len());
    let mut seen = vec![0; block.images.len()];
    let mut kept = vec![false; block.tie_points.len()];
    // Many rays connect an image with many others.
    let mut order: Vec<PointId> = (0..by_point.points()).map(PointId::from).collect();
    order.sort_by_key(|point| std::cmp::Reverse(by_point.count(*point)));
    for point in order {
        let images = || by_point.of(point).map(|row| block.ties[row].image.index());
        if images().any(|image| seen[image] < POINTS_PER_IMAGE) {
            kept[point.index()] = true;
            images().for_each(|image| seen[image] += 1);
        }
    }
    let ties = block.ties.iter().copied().filter(|row| kept[row.point.index()]).collect();
    block.with_measurements(ties, Vec::new())
}

/// Mean distance from images to the points that they see.
pub fn distance(fit: &Fit) -> f64 {
    ways_to_cameras(fit).map(|way| way.norm()).sum::<f64>() / fit.problem.observations.len() as f64
}

/// Mean way from points to the images that see them.
pub fn way_to_cameras(fit: &Fit) -> Vector3<f64> {
    ways_to_cameras(fit).sum::<Vector3<f64>>() / fit.problem.observations.len() as f64
}

fn ways_to_cameras(fit: &Fit) -> impl Iterator<Item = Vector3<f64>> {
    let (problem, state) = (&fit.problem, &fit.solution.state);
    state.points.iter().enumerate().flat_map(move |(j, point)| {
        let rows = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
        rows.iter().map(move |row| state.poses[row.image as usize].centre - point)
    })
}
