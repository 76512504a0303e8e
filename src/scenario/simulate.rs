//! From the scenario to the block: points are drawn until enough images see them.

use super::description::Scenario;
use super::flight::{self, Flown};
use super::overlap::{Dropped, FlightOverlap, OverlapReport, of_flights};
use super::random::{Table, stream};
use super::terrain::{Ground, GroundPlace};
use super::visibility::Viewer;
use super::{Result, ScenarioError, Simulation};
use crate::block::{Block, ImageId, Measurement, PointId, Role, SurveyedPoint, TiePoint};
use nalgebra::Vector3;
use rand::RngExt;
use rayon::prelude::*;

/// Images in which a tie point is measured at least.
pub(super) const MIN_TIES: usize = 2;
/// Images in which a surveyed point is marked at least: two would leave a blunder unseen.
pub(super) const MIN_MARKS: usize = 3;
/// Places tried for one point before the scenario is refused.
const ATTEMPTS: usize = 1000;
/// Candidates per control point, among which the best distributed are chosen.
const CONTROL_CANDIDATES: usize = 50;
/// Tie points drawn at once: bounds the memory beside the block.
const TIE_CHUNK: usize = 1 << 16;

/// A point with what measured it.
struct Seen {
    position: Vector3<f64>,
    rays: Vec<(ImageId, [f64; 2])>,
}

/// Makes the error-free block of a scenario; the same seed gives the same bytes, whatever the number of threads.
///
/// # Errors
/// A value that cannot be used; points that no place on the terrain makes visible in enough images.
pub fn simulate(scenario: &Scenario, seed: u64) -> Result<Simulation> {
    scenario.validate()?;
    let Flown { images, strip } = flight::fly(scenario, seed);
    let mut block = Block {
        name: scenario.name.clone(),
        crs: scenario.crs.clone(),
        survey_crs: String::new(),
        sigma: scenario.sigma.into(),
        cameras: scenario.cameras.iter().map(Into::into).collect(),
        flights: scenario.image_sets().cloned().collect(),
        images,
        tie_points: Vec::new(),
        ties: Vec::new(),
        surveyed: Vec::new(),
        marks: Vec::new(),
        origin: nalgebra::Vector3::zeros(),
        extra_image_columns: Vec::new(),
    };
    let ground = Ground::new(&scenario.terrain, seed);
    let flights = of_flights(scenario, &block, &strip);
    refuse_gaps(scenario, &flights)?;
    let images = std::mem::take(&mut block.images);
    let field =
        Field { scenario, seed, ground: &ground, viewer: Viewer::new(&block.cameras, &images, ground.height_range()) };
    let (tie_points, ties) = field.tie_points()?;
    let mut surveyed = Vec::new();
    let mut marks = Vec::new();
    for (role, points) in [(Role::Control, field.control()?), (Role::Check, field.check()?)] {
        let prefix = if role == Role::Control { "gcp" } else { "chk" };
        for (number, seen) in points.into_iter().enumerate() {
            marks.extend(measurements(PointId::from(surveyed.len()), &seen));
            let name = format!("{prefix}{:04}", number + 1);
            surveyed.push(SurveyedPoint { name, position: seen.position, role, sigma_xy: None, sigma_z: None });
        }
    }
    drop(field);
    let block = Block { images, tie_points, ties, surveyed, marks, ..block };
    let report = OverlapReport { flights, ..OverlapReport::of_block(&block, Dropped::default()) };
    Ok(Simulation { truth: truth_of(&block), block, report })
}

/// Refuses a flight or route of which no image shares ground with the next one of its strip.
fn refuse_gaps(scenario: &Scenario, flights: &[FlightOverlap]) -> Result<()> {
    // Images of a ring look at its middle, and rings come last.
    let flown = &flights[..scenario.routes.len() + scenario.flights.len()];
    match flown.iter().find(|own| own.forward_overlap == Some(0.0)) {
        Some(FlightOverlap { flight, base_m, footprint_m, .. }) => Err(ScenarioError::Gaps {
            scenario: scenario.name.clone(),
            flight: flight.clone(),
            base_m: base_m.unwrap_or_default(),
            length_m: footprint_m[1],
        }),
        None => Ok(()),
    }
}

/// The block without its measurements.
pub(super) fn truth_of(block: &Block) -> Block {
    Block {
        name: block.name.clone(),
        crs: block.crs.clone(),
        survey_crs: String::new(),
        sigma: block.sigma,
        cameras: block.cameras.clone(),
        flights: block.flights.clone(),
        images: block.images.clone(),
        tie_points: block.tie_points.clone(),
        ties: Vec::new(),
        surveyed: block.surveyed.clone(),
        marks: Vec::new(),
        origin: nalgebra::Vector3::zeros(),
        extra_image_columns: Vec::new(),
    }
}

fn measurements(point: PointId, seen: &Seen) -> impl Iterator<Item = Measurement> {
    seen.rays.iter().map(move |&(image, [x, y])| Measurement { image, point, x, y, sigma: None })
}

/// What points are drawn from.
struct Field<'a> {
    scenario: &'a Scenario,
    seed: u64,
    ground: &'a Ground<'a>,
    viewer: Viewer<'a>,
}

impl Field<'_> {
    fn tie_points(&self) -> Result<(Vec<TiePoint>, Vec<Measurement>)> {
        let count = self.scenario.tie_count();
        let digits = count.to_string().len();
        let mut points = Vec::with_capacity(count);
        let mut ties = Vec::new();
        for start in (0..count).step_by(TIE_CHUNK) {
            let chunk: Vec<Seen> = (start..count.min(start + TIE_CHUNK))
                .into_par_iter()
                .map(|index| self.tie_point(index))
                .collect::<Option<_>>()
                .ok_or_else(|| self.unseen("a tie point", MIN_TIES))?;
            for seen in chunk {
                ties.extend(measurements(PointId::from(points.len()), &seen));
                let name = format!("t{:0digits$}", points.len() + 1);
                points.push(TiePoint { name, position: Some(seen.position) });
            }
        }
        Ok((points, ties))
    }

    /// Draws a place and how distinctive it is, until enough of the images that see it find it too.
    fn tie_point(&self, index: usize) -> Option<Seen> {
        let mut rng = stream(self.seed, Table::Tie, index);
        let detection = self.scenario.ties.detection;
        (0..ATTEMPTS).find_map(|_| {
            let GroundPlace { position, normal } = self.ground.draw(&mut rng, true);
            let probability = detection.best * rng.random::<f64>().powf(detection.decay);
            let mut rays = self.viewer.seen_by(&GroundPlace { position, normal });
            rays.retain(|_| rng.random::<f64>() < probability);
            (rays.len() >= MIN_TIES).then_some(Seen { position, rays })
        })
    }

    /// Draws places until enough images see one; at most `max_marks` of them, chosen at random, mark it.
    fn surveyed_point(&self, table: Table, index: usize, max_marks: Option<usize>) -> Option<Seen> {
        let mut rng = stream(self.seed, table, index);
        let mut seen = (0..ATTEMPTS).find_map(|_| {
            let place = self.ground.draw(&mut rng, false);
            let rays = self.viewer.seen_by(&place);
            (rays.len() >= MIN_MARKS).then_some(Seen { position: place.position, rays })
        })?;
        while max_marks.is_some_and(|max| seen.rays.len() > max) {
            let dropped = rng.random_range(0..seen.rays.len());
            seen.rays.remove(dropped);
        }
        Some(seen)
    }

    fn check(&self) -> Result<Vec<Seen>> {
        let points = &self.scenario.surveyed.check;
        (0..points.count)
            .into_par_iter()
            .map(|index| self.surveyed_point(Table::Check, index, points.max_marks))
            .collect::<Option<_>>()
            .ok_or_else(|| self.unseen("a check point", MIN_MARKS))
    }

    /// Control points: of many candidates first the one furthest from their centroid, then again and again the one
    /// furthest from all chosen.
    fn control(&self) -> Result<Vec<Seen>> {
        let points = &self.scenario.surveyed.control;
        if points.count == 0 {
            return Ok(Vec::new());
        }
        let mut candidates: Vec<Seen> = (0..points.count * CONTROL_CANDIDATES)
            .into_par_iter()
            .map(|index| self.surveyed_point(Table::Control, index, points.max_marks))
            .collect::<Option<_>>()
            .ok_or_else(|| self.unseen("a control point", MIN_MARKS))?;
        let centroid = candidates.iter().map(|c| c.position).sum::<Vector3<f64>>() / candidates.len() as f64;
        let mut distance: Vec<f64> = candidates.iter().map(|c| (c.position - centroid).norm()).collect();
        let mut chosen: Vec<Seen> = Vec::with_capacity(points.count);
        while chosen.len() < points.count {
            let best = (0..candidates.len()).max_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
            let next = candidates.swap_remove(best);
            distance.swap_remove(best);
            for (distance, candidate) in distance.iter_mut().zip(&candidates) {
                let gap = (candidate.position - next.position).norm();
                // The first point is chosen by another measure, which ends with it.
                *distance = if chosen.is_empty() { gap } else { distance.min(gap) };
            }
            chosen.push(next);
        }
        Ok(chosen)
    }

    fn unseen(&self, what: &'static str, images: usize) -> ScenarioError {
        ScenarioError::Unseen { scenario: self.scenario.name.clone(), what, attempts: ATTEMPTS, images }
    }
}
