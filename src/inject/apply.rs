//! Measures a block anew under the injected errors, and reports what that changed.

use super::observe::Observer;
use super::{Action, Dropped, Injection, Loss, Observations, Random, Setting, World, registry};
use crate::block::{Block, Measurement};
use anyhow::{Context, Result};
use serde::Serialize;
use std::borrow::Cow;

/// A block with errors.
#[derive(Debug, Clone)]
pub struct Injected {
    /// The block as it would have been measured.
    pub block: Block,
    /// What was done.
    pub report: Report,
}

/// What was done to a block. Changes are against the error-free measurements of the truth.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Measurements made anew, ties and marks.
    pub measurements: usize,
    /// Measurements that are no longer there, by reason.
    pub dropped: Dropped,
    /// Names of tie points that went with them.
    pub dropped_tie_points: Vec<String>,
    /// RMS per coordinate of what the block's ties and marks had against the error-free ones, px: the noise and errors
    /// that were replaced.
    pub replaced_rms_px: f64,
    /// RMS per coordinate of the new errors of ties and marks, px.
    pub change_rms_px: f64,
    /// Largest new error of a tie or mark, px.
    pub change_max_px: f64,
    /// Largest new error of a GNSS position, m.
    pub gnss_change_max_m: f64,
    /// Largest new error of a surveyed point, m.
    pub survey_change_max_m: f64,
    /// Tie-point measurements that were made outliers, those since dropped too: image and point.
    pub outliers: Vec<(String, String)>,
    /// The causes, in the order in which they acted.
    pub applied: Vec<Applied>,
}

/// One cause as it acted.
#[derive(Debug, Clone, Serialize)]
pub struct Applied {
    /// Its id.
    pub id: Cow<'static, str>,
    /// Its parameters, as text; those not given and without default are left out.
    pub parameters: Vec<(Cow<'static, str>, String)>,
    /// What it drew at random or derived, with units.
    pub notes: Vec<(String, String)>,
    /// Whose formula it is, where it is one that the estimator has too: finding it again proves the formula's use, not
    /// its truth. `None` for every cause of the [`registry`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shared_formula: Option<String>,
}

/// An action from elsewhere, and what the report says of it.
pub type Other = (Applied, Box<dyn Action>);

/// Measures `block` anew in the world of `truth` under `injections`; see the module's front page.
///
/// `truth` has the true poses, cameras, tie-point and surveyed coordinates and antenna positions, found by name. The
/// same `seed` gives the same block on every machine.
///
/// # Errors
/// A truth that lacks a name of the block, a parameter out of its range, a block without what a cause needs.
pub fn apply(block: &Block, truth: &Block, injections: &[Injection], seed: u64) -> Result<Injected> {
    apply_with(block, truth, injections, Vec::new(), seed)
}

/// [`apply`] with actions from elsewhere, which act before those of the registry: outliers and noise come last.
///
/// # Errors
/// As [`apply`].
pub fn apply_with(
    block: &Block,
    truth: &Block,
    injections: &[Injection],
    others: Vec<Other>,
    seed: u64,
) -> Result<Injected> {
    let world = World::new(block, truth)?;
    let mut actions: Vec<Box<dyn Action>> = Vec::new();
    let mut applied: Vec<(Applied, Option<usize>)> = Vec::new();
    for (own, action) in others {
        applied.push((own, Some(actions.len())));
        actions.push(action);
    }
    for cause in registry() {
        let same = injections.iter().filter(|injection| injection.cause.id() == cause.id());
        for (occurrence, injection) in same.enumerate() {
            let random = Random::new(seed, cause.id(), occurrence as u64);
            let mut setting = Setting { values: &injection.values, world: &world, random };
            let action = cause.prepare(&mut setting).with_context(|| format!("error `{}`", cause.id()))?;
            let parameters = injection.values.iter().map(|(name, value)| (name.into(), value.to_string()));
            let parameters = parameters.filter(|(_, value): &(_, String)| !value.is_empty()).collect();
            let index = action.is_some().then_some(actions.len());
            let id = cause.id().into();
            applied.push((Applied { id, parameters, notes: Vec::new(), shared_formula: None }, index));
            actions.extend(action);
        }
    }

    let mut observations = Observer::new(&world, &actions).observe();
    for action in &mut actions {
        action.measured(&world, &mut observations);
    }
    // Before anything is dropped: the lists still run parallel to the world's.
    let mut recorded = block.clone();
    actions.iter().for_each(|action| action.record(&mut recorded));
    let mut injected = write(recorded, &world, observations);
    let outliers = actions.iter().flat_map(|action| action.outliers());
    injected.report.outliers = outliers
        .map(|tie| {
            let tie = &world.ties[*tie];
            let image = world.images[tie.image.index()].name.clone();
            (image, world.tie_point_names[tie.point.index()].clone())
        })
        .collect();
    injected.report.applied = applied
        .into_iter()
        .map(|(applied, index)| Applied { notes: index.map_or(Vec::new(), |index| actions[index].notes()), ..applied })
        .collect();
    Ok(injected)
}

/// The block with the observations in the place of what was measured before.
fn write(mut block: Block, world: &World, observations: Observations) -> Injected {
    let mut report = Report::default();
    let mut change = Change::default();
    let mut replaced = Change::default();
    let mut fill = |measurements: &mut Vec<Measurement>, seen: Vec<Result<[f64; 2], Loss>>, surveyed: bool| {
        let mut kept = Vec::with_capacity(measurements.len());
        for (measurement, seen) in measurements.iter().zip(seen) {
            let (image, point) = (measurement.image.index(), measurement.point.index());
            match seen.and_then(|xy| on_sensor(world, image, xy)) {
                Ok([x, y]) => {
                    let position = if surveyed { world.surveyed[point].position } else { world.tie_points[point] };
                    if let Some(exact) = world.exact(image, &position) {
                        change.add([x - exact[0], y - exact[1]]);
                        replaced.add([measurement.x - exact[0], measurement.y - exact[1]]);
                    }
                    kept.push(Measurement { x, y, ..*measurement });
                }
                Err(loss) => report.dropped.count(loss),
            }
        }
        *measurements = kept;
    };
    let rays_before = rays(&block);
    fill(&mut block.ties, observations.ties, false);
    fill(&mut block.marks, observations.marks, true);
    report.measurements = block.ties.len() + block.marks.len();
    (report.change_rms_px, report.change_max_px) = (change.rms(), change.max);
    report.replaced_rms_px = replaced.rms();
    drop_lonely_points(&mut block, &rays_before, &mut report);

    for (index, antenna) in observations.antennas.iter().enumerate() {
        if let (Some(gnss), Some(antenna), Some(truth)) =
            (block.images[index].gnss.as_mut(), antenna, world.images[index].gnss)
        {
            gnss.position = *antenna;
            report.gnss_change_max_m = report.gnss_change_max_m.max((antenna - truth.position).norm());
        }
    }
    for ((point, truth), position) in block.surveyed.iter_mut().zip(&world.surveyed).zip(observations.surveyed) {
        point.position = position;
        report.survey_change_max_m = report.survey_change_max_m.max((position - truth.position).norm());
    }
    Injected { block, report }
}

/// Sum of squares and largest length of image displacements.
#[derive(Default)]
struct Change {
    squares: f64,
    count: usize,
    max: f64,
}

impl Change {
    fn add(&mut self, [dx, dy]: [f64; 2]) {
        self.squares += dx * dx + dy * dy;
        self.count += 1;
        self.max = self.max.max(dx.hypot(dy));
    }

    fn rms(&self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.squares / (2.0 * self.count as f64)).sqrt() }
    }
}

fn on_sensor(world: &World, image: usize, xy: [f64; 2]) -> Result<[f64; 2], Loss> {
    let camera = world.camera_of(image);
    let inside = |value: f64, size: u32| (0.0..=f64::from(size)).contains(&value);
    if inside(xy[0], camera.width_px) && inside(xy[1], camera.height_px) { Ok(xy) } else { Err(Loss::OffSensor) }
}

/// Number of measurements of each tie point.
fn rays(block: &Block) -> Vec<usize> {
    let mut rays = vec![0; block.tie_points.len()];
    block.ties.iter().for_each(|tie| rays[tie.point.index()] += 1);
    rays
}

/// Removes the tie points that lost measurements and have fewer than two left: nothing fixes their position any more.
fn drop_lonely_points(block: &mut Block, rays_before: &[usize], report: &mut Report) {
    let rays = rays(block);
    let lonely = |point: usize| rays[point] < 2 && rays[point] < rays_before[point];
    let mut renumbered = Vec::with_capacity(rays.len());
    let mut kept = 0_usize;
    for point in 0..rays.len() {
        renumbered.push(kept);
        kept += usize::from(!lonely(point));
    }
    if kept == rays.len() {
        return;
    }
    let before = block.ties.len();
    block.ties.retain(|tie| !lonely(tie.point.index()));
    report.dropped.left_alone = before - block.ties.len();
    report.measurements -= report.dropped.left_alone;
    for tie in &mut block.ties {
        tie.point = renumbered[tie.point.index()].into();
    }
    let mut index = 0;
    block.tie_points.retain(|point| {
        let gone = lonely(index);
        index += 1;
        if gone {
            report.dropped_tie_points.push(point.name.clone());
        }
        !gone
    });
}
