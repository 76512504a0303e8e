//! The screening for mistakes before a diagnosis: the block oriented by its tie points alone, and its surveyed groups beside that.

use super::fit::Fit;
use super::outliers::{Outliers, Snooping, robust_fit};
use super::priors::{SHARES, with_priors};
use crate::adjust::Options;
use crate::block::{Block, ByPoint, Measurement, PointId, Role};
use crate::camera::F;
use crate::evaluate::intersection::{Intersections, Method, intersect_surveyed};
use crate::math::statistics::{median, rms};
use crate::measure::Predictor;
use crate::mistakes::set_aside::{self, Count, SetAside};
use crate::mistakes::{BEYOND, Group, Member, Mistake, Subject, Survey, screen};
use crate::model::{Datum, Model};
use crate::problem::MeasurementKind;
use crate::run::FittedModel;
use nalgebra::Vector3;
use std::collections::HashSet;

/// Tie points of each image that orient it: ten times as many as an orientation needs, over the sensor.
const POINTS_PER_IMAGE: usize = 60;

/// Mistakes in the surveyed groups of a block; none where they agree with the images, and none where the images cannot be oriented without a survey.
pub fn mistakes(block: &Block, model: &Model, significance: f64, options: &Options) -> Vec<Mistake> {
    let has_gnss = block.images.iter().any(|image| image.gnss.is_some());
    if !has_gnss && block.surveyed.is_empty() {
        return Vec::new();
    }
    survey(block, model, options).map_or_else(Vec::new, |survey| screen(&survey, significance))
}

/// The surveyed groups beside a free network of tie points.
fn survey(block: &Block, model: &Model, options: &Options) -> Option<Survey> {
    let fit = free_network(block, model, options)?;
    let fitted = FittedModel { predictor: Predictor::new(&fit.problem, &fit.solution.state).ok()? };
    let mut took_part = vec![false; block.images.len()];
    fit.problem.observations.iter().for_each(|row| took_part[row.image as usize] = true);
    let oriented: Vec<Measurement> = block.marks.iter().copied().filter(|mark| took_part[mark.image.index()]).collect();
    let places =
        places(block, &intersect_surveyed(&fitted, &block.with_measurements(Vec::new(), oriented), Method::Image));
    let mut groups = Vec::new();
    for (role, subject) in [(Role::Control, Subject::Control), (Role::Check, Subject::Check)] {
        let points = block.surveyed.iter().enumerate().filter(|(_, point)| point.role == role);
        let members: Vec<Member> = points
            .map(|(k, point)| Member {
                name: point.name.clone(),
                recorded: point.position + block.origin,
                computed: places[k],
                flight: 0,
            })
            .collect();
        let sigma = [
            typical(block.surveyed.iter().map(|point| point.sigma_xy), block.sigma.control_xy_m),
            typical(block.surveyed.iter().map(|point| point.sigma_z), block.sigma.control_z_m),
        ];
        groups.extend((!members.is_empty()).then_some(Group { subject, sigma, members, flights: Vec::new() }));
    }
    let antennas = block.images.iter().enumerate().filter_map(|(k, image)| {
        Some(Member {
            name: image.name.clone(),
            recorded: image.gnss?.position + block.origin,
            computed: took_part[k].then(|| fitted.predictor.centre(k)),
            flight: image.flight.index(),
        })
    });
    let members: Vec<Member> = antennas.collect();
    if !members.is_empty() {
        let gnss = || block.images.iter().filter_map(|image| image.gnss);
        let sigma = [
            typical(gnss().map(|gnss| gnss.sigma_xy), block.sigma.gnss_xy_m),
            typical(gnss().map(|gnss| gnss.sigma_z), block.sigma.gnss_z_m),
        ];
        groups.push(Group { subject: Subject::Gnss, sigma, members, flights: block.flights.clone() });
    }
    Some(Survey { groups, up: Vector3::z(), distance: distance(&fit), focal_share: SHARES[F] })
}

/// The block by some of its tie points, with a loss that single false matches cannot bend.
fn free_network(block: &Block, model: &Model, options: &Options) -> Option<Fit> {
    let few = thinned(block);
    // What acts on surveyed coordinates alone has nothing to act on.
    let free = Model { datum: Datum::Free, effects: Vec::new(), ..model.clone() };
    let free = with_priors(&few, &Model { priors: model.priors.clone(), ..free }).ok()?;
    let meets = Snooping::new(&few, &free).block(&few).into_owned();
    robust_fit(&meets, &free, None, options).ok()
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

/// Places of the surveyed points whose rays meet: marks on different points have none.
fn places(block: &Block, found: &Intersections) -> Vec<Option<Vector3<f64>>> {
    let size = |residuals: &[nalgebra::Vector2<f64>]| {
        rms(&residuals.iter().map(|residual| residual.norm()).collect::<Vec<_>>())
    };
    let sizes: Vec<f64> = found.points.iter().map(|point| size(&point.residuals)).collect();
    let usual = median(&sizes).max(block.sigma.mark_px.min(f64::MAX));
    let mut places = vec![None; block.surveyed.len()];
    for (point, size) in found.points.iter().zip(sizes) {
        if size < BEYOND * usual {
            places[point.point.index()] = Some(point.position);
        }
    }
    places
}

/// Median of the standard deviations of rows, those without one having the block's.
fn typical(rows: impl Iterator<Item = Option<f64>>, of_block: f64) -> f64 {
    /// Where nothing is stated.
    const CENTIMETRES: f64 = 0.03;
    let stated = if of_block.is_finite() && of_block > 0.0 { of_block } else { CENTIMETRES };
    let sigma = median(&rows.map(|sigma| sigma.unwrap_or(stated)).collect::<Vec<_>>());
    if sigma.is_finite() && sigma > 0.0 { sigma } else { stated }
}

/// Mean distance from images to the points that they see.
fn distance(fit: &Fit) -> f64 {
    let (problem, state) = (&fit.problem, &fit.solution.state);
    let mut sum = 0.0;
    for (j, point) in state.points.iter().enumerate() {
        for row in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            sum += (state.poses[row.image as usize].centre - point).norm();
        }
    }
    sum / problem.observations.len() as f64
}

/// The block and model to go on with: what is recorded wrongly takes no part. Control points become check points: they are compared and nothing more.
/// `None` where nothing is to be left out.
pub fn without(block: &Block, model: &Model, mistakes: &[Mistake]) -> Option<(Block, Model)> {
    let mut left = block.clone();
    for mistake in mistakes {
        let names: HashSet<&str> = mistake.names.iter().map(String::as_str).collect();
        let concerned = |name: &str| names.is_empty() || names.contains(name);
        match subject_left_out(block, mistake) {
            "gnss" => {
                left.images.iter_mut().filter(|image| concerned(&image.name)).for_each(|image| image.gnss = None);
            }
            "control" => {
                let points = left.surveyed.iter_mut().filter(|point| concerned(&point.name));
                points.for_each(|point| point.role = Role::Check);
            }
            _ => {}
        }
    }
    if left == *block {
        return None;
    }
    let control = left.count(Role::Control) > 0;
    let gnss = left.images.iter().any(|image| image.gnss.is_some());
    let datum = match (model.datum, control, gnss) {
        (_, false, false) => Datum::Free,
        (Datum::Control, false, true) => Datum::Gnss,
        (Datum::Gnss, true, false) => Datum::Control,
        (datum, ..) => datum,
    };
    Some((left, Model { datum, ..model.clone() }))
}

/// Where control and GNSS disagree and neither is known to be wrong, the diagnosis goes on with control.
fn subject_left_out<'a>(block: &Block, mistake: &'a Mistake) -> &'a str {
    let between = ["height-offset", "plan-offset", "other-frame", "rotation"].contains(&mistake.kind.as_str());
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    match mistake.subject.as_str() {
        "control" if between && gnss => "gnss",
        subject => subject,
    }
}

/// What was set aside of a block as a finding.
pub fn of_outliers(block: &Block, outliers: &Outliers, named: &[Mistake], significance: f64) -> Vec<Mistake> {
    let mut control: Vec<Count> = block.surveyed.iter().map(|point| of_name(&point.name)).collect();
    let mut images: Vec<Count> = block.images.iter().map(|image| of_name(&image.name)).collect();
    block.marks.iter().for_each(|mark| control[mark.point.index()].all += 1);
    block.ties.iter().for_each(|tie| images[tie.image.index()].all += 1);
    for rejected in &outliers.rejected {
        match rejected.kind {
            MeasurementKind::Mark => control[rejected.point.index()].aside += 1,
            MeasurementKind::Tie => images[rejected.image.index()].aside += 1,
        }
    }
    let is_control = |k: usize| block.surveyed[k].role == Role::Control;
    let control = control.into_iter().enumerate().filter(|(k, _)| is_control(*k)).map(|(_, count)| count).collect();
    let all = block.ties.len() + block.marks.iter().filter(|mark| is_control(mark.point.index())).count();
    let all = Count { aside: outliers.rejected.len(), all, ..Count::default() };
    let names: Vec<String> = named.iter().flat_map(|mistake| mistake.names.clone()).collect();
    set_aside::judge(&SetAside { control, images, all }, &names, significance)
}

fn of_name(name: &str) -> Count {
    Count { name: name.into(), ..Count::default() }
}
