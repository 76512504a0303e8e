//! Surveyed positions beside those that the network of tie points gives.

use super::network::{Oriented, distance, way_to_cameras};
use super::surroundings::screened;
use crate::block::{Block, Measurement, Role};
use crate::camera::F;
use crate::evaluate::intersection::{Intersection, Intersections, Method, intersect_surveyed};
use crate::math::statistics::{mean, median, rms};
use crate::measure::Predictor;
use crate::mistakes::{BEYOND, Group, Member, Mistake, Subject, Survey};
use crate::run::FittedModel;
use crate::run::fit::Fit;
use nalgebra::{Matrix3, Vector3};

/// A block that tie points alone orient.
pub struct Network<'a> {
    /// The network.
    pub oriented: &'a Oriented,
    fitted: FittedModel<'a>,
    /// Images that took part and fit.
    took_part: Vec<bool>,
}

impl<'f> Network<'f> {
    /// `None` where predictions fail.
    pub fn new(oriented: &'f Oriented) -> Option<Self> {
        let fit = &oriented.fit;
        let fitted = FittedModel { predictor: Predictor::new(&fit.problem, &fit.solution.state).ok()? };
        let took_part = well_oriented(fit, &fitted.predictor);
        Some(Self { oriented, fitted, took_part })
    }

    /// Surveyed points from marks that are moved in the images that took part.
    pub fn intersected(&self, block: &Block, moved: impl Fn(&Measurement) -> [f64; 2]) -> Intersections {
        intersect_surveyed(&self.fitted, &self.seen(block, moved), Method::Image)
    }

    /// The block with marks in the images that took part alone.
    fn seen(&self, block: &Block, moved: impl Fn(&Measurement) -> [f64; 2]) -> Block {
        let marks = block.marks.iter().filter(|mark| self.took_part[mark.image.index()]);
        let marks = marks.map(|mark| {
            let [x, y] = moved(mark);
            Measurement { x, y, ..*mark }
        });
        block.with_measurements(Vec::new(), marks.collect())
    }

    /// What marks that fit leave, px: as stated, and what the ties of the network leave where that is more.
    pub fn usual_px(&self, block: &Block) -> f64 {
        let fit = &self.oriented.fit;
        let redundancy = fit.problem.redundancy().2 as f64;
        let ties = block.sigma.tie_px * (fit.chi_square() / redundancy).sqrt();
        [block.sigma.mark_px, ties].into_iter().filter(|own| own.is_finite()).fold(0.0, f64::max)
    }

    /// The surveyed groups beside the network, and what is wrong in them.
    pub fn screened(&self, block: &Block, alpha: f64) -> (Survey, Vec<Mistake>) {
        let seen = self.seen(block, |mark| [mark.x, mark.y]);
        let found = intersect_surveyed(&self.fitted, &seen, Method::Image);
        let mut survey = self.survey(&seen, &found);
        let mistakes = screened(&mut survey, &seen, self.oriented, &found, alpha);
        (survey, mistakes)
    }

    fn survey(&self, block: &Block, found: &Intersections) -> Survey {
        let Self { oriented: Oriented { fit, focal, .. }, fitted, took_part } = self;
        let places = places(block, found);
        // In metres as far as the approximate orientation is.
        let marked = |axis: usize| {
            let sigmas: Vec<f64> = found.points.iter().map(|point| point.covariance[(axis, axis)].sqrt()).collect();
            if sigmas.is_empty() { 0.0 } else { median(&sigmas) }
        };
        let mut groups = Vec::new();
        for (role, subject) in [(Role::Control, Subject::Control), (Role::Check, Subject::Check)] {
            let points = block.surveyed.iter().enumerate().filter(|(_, point)| point.role == role);
            let members: Vec<Member> = points
                .map(|(k, point)| Member {
                    name: point.name.clone(),
                    recorded: point.position + block.origin,
                    computed: places[k],
                    covariance: Matrix3::zeros(),
                    flight: 0,
                    time: None,
                })
                .collect();
            let sigma = [
                typical(block.surveyed.iter().map(|point| point.sigma_xy), block.sigma.control_xy_m).hypot(marked(0)),
                typical(block.surveyed.iter().map(|point| point.sigma_z), block.sigma.control_z_m).hypot(marked(2)),
            ];
            groups.extend((!members.is_empty()).then_some(Group { subject, sigma, members, flights: Vec::new() }));
        }
        let antennas = block.images.iter().enumerate().filter_map(|(k, image)| {
            Some(Member {
                name: image.name.clone(),
                recorded: image.gnss?.position + block.origin,
                computed: took_part[k].then(|| fitted.predictor.centre(k)),
                covariance: Matrix3::zeros(),
                flight: image.flight.index(),
                time: image.time_s,
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
        let distance = distance(fit);
        let lengths: Vec<f64> = fit.solution.state.interiors.iter().map(|interior| interior[F]).collect();
        let pixel = distance / mean(&lengths);
        Survey { groups, up: Vector3::z(), cameras: way_to_cameras(fit), distance, pixel, focal: *focal }
    }
}

/// Residuals below are rounding, px.
const LEAST_PX: f64 = 0.01;

/// Images most of whose measurements meet the network: one that is mirrored, or that has the measurements of another
/// image, stands anywhere.
fn well_oriented(fit: &Fit, predictor: &Predictor<'_>) -> Vec<bool> {
    let mut sizes: Vec<Vec<f64>> = vec![Vec::new(); fit.problem.image_names.len()];
    predictor.each_measurement(|_, row, predicted| {
        let off = predicted.map(|(at, _)| (at[0] - row.x).hypot(at[1] - row.y));
        sizes[row.image as usize].push(off.unwrap_or(f64::INFINITY));
    });
    let of_images: Vec<f64> = sizes.iter().map(|own| if own.is_empty() { f64::NAN } else { median(own) }).collect();
    let known: Vec<f64> = of_images.iter().copied().filter(|size| !size.is_nan()).collect();
    let usual = if known.is_empty() { 0.0 } else { median(&known) };
    // Not a number, of an image without a measurement, is not less.
    of_images.into_iter().map(|size| size < BEYOND * usual.max(LEAST_PX)).collect()
}

/// Typical residual of a point, px.
pub fn size_px(point: &Intersection) -> f64 {
    rms(&point.residuals.iter().map(|residual| residual.norm()).collect::<Vec<_>>())
}

/// Places of the surveyed points whose rays meet: marks on different points have none.
fn places(block: &Block, found: &Intersections) -> Vec<Option<Vector3<f64>>> {
    let sizes: Vec<f64> = found.points.iter().map(size_px).collect();
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
