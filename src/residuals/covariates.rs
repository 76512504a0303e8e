//! Residuals against flight, time, temperature, row, radius, depth and viewing direction.
//!
//! A mean residual that changes with time is of little use: the pose absorbs it. What a slow change leaves are patterns
//! over the sensor that change with it, so smooth patterns ([`super::place::patterns`]) times functions of the quantity
//! are tested.

use super::columns::{Family, Writer};
use super::context::Context;
use super::found::Found;
use super::pictures::{Profile, ProfileBin};
use super::place::{LINEAR_PATTERNS, PATTERNS, Place, Span, legendre, patterns};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Bins of the profiles.
const ROW_BINS: usize = 16;
const RADIUS_BINS: usize = 12;
const DEPTH_BINS: usize = 12;
const DIRECTION_BINS: usize = 8;
/// Most columns of the test against the flight.
const MOST_COLUMNS: usize = 1500;

/// A quantity that residuals are held against.
pub(super) struct Covariate<'a> {
    pub family: Family<'a>,
    pub description: String,
    profiles: Vec<Binned<'a>>,
}

/// Component of a residual (px) at a place.
type Component<'a> = Box<dyn Fn(&Place, [f64; 2]) -> f64 + Sync + 'a>;
/// Function of a measurement.
type Key<'a> = Box<dyn Fn(&Place) -> f64 + Sync + 'a>;

struct Binned<'a> {
    component: &'static str,
    unit: &'static str,
    span: Span,
    bins: usize,
    key: Key<'a>,
    value: Component<'a>,
}

/// How far places reach.
struct Extent {
    depth: Option<Span>,
    radius: f64,
    nadir: f64,
}

impl Extent {
    fn of(context: &Context<'_>) -> Self {
        let pieces = context.in_pieces(|places| {
            let (mut depths, mut radius, mut nadir) = (Vec::new(), 0.0f64, 0.0f64);
            for (place, _) in places {
                (radius, nadir) = (radius.max(place.radius), nadir.max(place.nadir));
                depths.push(place.depth);
            }
            (depths, radius, nadir)
        });
        Self {
            depth: Span::of(pieces.iter().flat_map(|(depths, ..)| depths).copied()),
            radius: pieces.iter().fold(0.0, |most, (_, radius, _)| radius.max(most)),
            nadir: pieces.iter().fold(0.0, |most, (.., nadir)| nadir.max(most)),
        }
    }
}

/// Every covariate that the block has.
pub(super) fn all<'a>(context: &Context<'a>, found: &mut Found) -> Vec<Covariate<'a>> {
    let problem = context.problem;
    let Extent { depth, radius, nadir } = Extent::of(context);
    let [radius, nadir] = [radius, nadir].map(|most| Span::of([0.0, most].into_iter()));
    let mut list = Vec::new();
    let mut take = |against: &'static str, covariate: Option<Covariate<'a>>, why: &str| match covariate {
        Some(covariate) => list.push(covariate),
        None => found.skip(against, why),
    };
    let flights = problem.block_context.counts[1] as usize;
    take("flight", flight(flights), "one flight, or too many to test each");
    let unknown = "not known for every image, or the same in all";
    let images = problem.image_contexts.iter();
    let times = images.clone().map(|image| image.time_s).collect();
    take("time", smooth("time", "s", times, 3), unknown);
    let temperatures = images.map(|image| image.temperature_c).collect();
    take("temperature", smooth("temperature", "degrees Celsius", temperatures, 2), unknown);
    take("row", Span::of([-1.0, 1.0].into_iter()).map(row), "");
    take("radius", radius.map(self::radius), "all measurements lie in the centre");
    take("height", depth.map(height), "every point has the same depth");
    take("direction", nadir.map(direction), "all rays point straight down");
    list
}

/// Mean residuals over the bins of each quantity.
pub(super) fn draw(context: &Context<'_>, covariates: &[Covariate<'_>], found: &mut Found) {
    let wanted: Vec<(&'static str, &Binned<'_>)> = covariates
        .iter()
        .flat_map(|covariate| covariate.profiles.iter().map(|profile| (covariate.family.against, profile)))
        .collect();
    let none: Vec<Vec<(usize, f64, f64)>> = wanted.iter().map(|(_, binned)| vec![(0, 0.0, 0.0); binned.bins]).collect();
    let pieces = context.in_pieces(|places| {
        let mut sums = none.clone();
        for (place, residual) in places {
            for ((_, binned), sums) in wanted.iter().zip(&mut sums) {
                let value = (binned.value)(&place, residual);
                let bin = &mut sums[binned.span.bin((binned.key)(&place), binned.bins)];
                *bin = (bin.0 + 1, bin.1 + value, bin.2 + value * value);
            }
        }
        sums
    });
    let mut sums = none;
    for piece in pieces {
        for (to, of_piece) in sums.iter_mut().flatten().zip(piece.iter().flatten()) {
            *to = (to.0 + of_piece.0, to.1 + of_piece.1, to.2 + of_piece.2);
        }
    }
    for ((against, binned), sums) in wanted.into_iter().zip(sums) {
        let filled = sums.into_iter().enumerate().filter(|(_, (n, ..))| *n > 1);
        let bin = |(bin, (n, sum, squares)): (usize, (usize, f64, f64))| {
            let count = n as f64;
            let mean = sum / count;
            let variance = ((squares - count * mean * mean) / (count - 1.0)).max(0.0);
            ProfileBin { x: binned.span.middle_of(bin, binned.bins), n, mean, sigma: (variance / count).sqrt() }
        };
        let bins = filled.map(bin).collect();
        found.pictures.profiles.push(Profile { against, component: binned.component, unit: binned.unit, bins });
    }
}

fn covariate<'a>(
    against: &'static str,
    count: usize,
    local: bool,
    description: String,
    fill: impl Fn(&Place, &mut Writer<'_>) + Sync + 'a,
) -> Covariate<'a> {
    let family = Family { against, count, local, fill: Box::new(fill), coordinates: None };
    Covariate { family, description, profiles: Vec::new() }
}

impl<'a> Covariate<'a> {
    fn profile(
        mut self,
        (component, unit): (&'static str, &'static str),
        (span, bins): (Span, usize),
        key: impl Fn(&Place) -> f64 + Sync + 'a,
        value: impl Fn(&Place, [f64; 2]) -> f64 + Sync + 'a,
    ) -> Self {
        self.profiles.push(Binned { component, unit, span, bins, key: Box::new(key), value: Box::new(value) });
        self
    }
}

fn times(displacement: [f64; 2], factor: f64) -> [f64; 2] {
    displacement.map(|d| d * factor)
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// A quarter turn, from x towards y.
fn turned([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}

fn flight<'a>(flights: usize) -> Option<Covariate<'a>> {
    let count = flights.saturating_sub(1) * PATTERNS;
    if count == 0 || count > MOST_COLUMNS {
        return None;
    }
    let description = format!("{PATTERNS} smooth patterns over the sensor that differ between {flights} flights");
    Some(covariate("flight", count, false, description, |place, to| {
        if place.flight > 0 {
            let first = (place.flight - 1) * PATTERNS;
            patterns(place.u, place.v).into_iter().enumerate().for_each(|(p, d)| to.entry(first + p, d));
        }
    }))
}

/// Of a value that every image has; `None` where one is not known, or all are the same.
fn smooth<'a>(against: &'static str, unit: &'static str, of_images: Vec<f64>, degrees: usize) -> Option<Covariate<'a>> {
    let span = Span::of(of_images.iter().copied())?;
    let of_images: Arc<[f64]> = of_images.into();
    let own = of_images.clone();
    let description = format!(
        "{PATTERNS} smooth patterns over the sensor that change evenly with {against}, {LINEAR_PATTERNS} with its \
         powers up to {degrees}"
    );
    let count = PATTERNS + (degrees - 1) * LINEAR_PATTERNS;
    let made = covariate(against, count, false, description, move |place, to| {
        let factors = legendre(span.scale(own[place.image]));
        let patterns = patterns(place.u, place.v);
        patterns.iter().enumerate().for_each(|(p, d)| to.entry(p, times(*d, factors[0])));
        for (degree, factor) in factors.iter().enumerate().take(degrees).skip(1) {
            let first = PATTERNS + (degree - 1) * LINEAR_PATTERNS;
            let linear = patterns.iter().take(LINEAR_PATTERNS).enumerate();
            linear.for_each(|(p, d)| to.entry(first + p, times(*d, *factor)));
        }
    });
    let key = move |place: &Place| of_images[place.image];
    Some(made.profile(("radial", unit), (span, DEPTH_BINS), key, |place, r| dot(place.radial, r)))
}

fn row<'a>(span: Span) -> Covariate<'a> {
    let description =
        format!("means of {ROW_BINS} bands of rows; slope and curvature over the rows along and across the motion");
    covariate("row", 2 * ROW_BINS + 4, false, description, move |place, to| {
        let bin = span.bin(place.row, ROW_BINS);
        to.entry(2 * bin, [1.0, 0.0]);
        to.entry(2 * bin + 1, [0.0, 1.0]);
        // A shutter moves the image along the motion, which points elsewhere in every strip.
        let [first, second, _] = legendre(place.row);
        let across = turned(place.along);
        let moved = [(first, place.along), (second, place.along), (first, across), (second, across)];
        let last = 2 * ROW_BINS;
        moved.iter().enumerate().for_each(|(c, (factor, d))| to.entry(last + c, times(*d, *factor)));
    })
    .profile(("x", "half heights"), (span, ROW_BINS), |place| place.row, |_, r| r[0])
    .profile(("y", "half heights"), (span, ROW_BINS), |place| place.row, |_, r| r[1])
}

fn radius<'a>(span: Span) -> Covariate<'a> {
    let description = format!("radial and tangential means of {RADIUS_BINS} rings");
    covariate("radius", 2 * RADIUS_BINS, false, description, move |place, to| {
        let bin = span.bin(place.radius, RADIUS_BINS);
        to.entry(2 * bin, place.radial);
        to.entry(2 * bin + 1, turned(place.radial));
    })
    .profile(("radial", "px"), (span, RADIUS_BINS), |place| place.radius, |place, r| dot(place.radial, r))
    .profile(
        ("tangential", "px"),
        (span, RADIUS_BINS),
        |place| place.radius,
        |place, r| dot(turned(place.radial), r),
    )
}

fn height<'a>(span: Span) -> Covariate<'a> {
    let description = "shift and radial patterns that change with the depth below the camera".to_string();
    covariate("height", 8, false, description, move |place, to| {
        let [first, second, _] = legendre(span.scale(place.depth));
        let r2 = place.u * place.u + place.v * place.v;
        let shapes = [[1.0, 0.0], [0.0, 1.0], [place.u, place.v], [r2 * place.u, r2 * place.v]];
        for (degree, factor) in [first, second].into_iter().enumerate() {
            shapes.iter().enumerate().for_each(|(p, d)| to.entry(4 * degree + p, times(*d, factor)));
        }
    })
    .profile(("radial", "m of depth"), (span, DEPTH_BINS), |place| place.depth, |place, r| dot(place.radial, r))
}

fn direction<'a>(span: Span) -> Covariate<'a> {
    let description =
        format!("away from the nadir and across, over {DIRECTION_BINS} nadir angles and {DIRECTION_BINS} azimuths");
    let made = covariate("direction", 3 * DIRECTION_BINS, false, description, move |place, to| {
        let nadir = span.bin(place.nadir, DIRECTION_BINS);
        let azimuth = (((place.azimuth + PI) / TAU * DIRECTION_BINS as f64) as usize).min(DIRECTION_BINS - 1);
        to.entry(nadir, place.outward);
        to.entry(DIRECTION_BINS + 2 * azimuth, place.outward);
        to.entry(DIRECTION_BINS + 2 * azimuth + 1, turned(place.outward));
    });
    let degrees = Span::of([0.0, span.middle_of(1, 1).to_degrees() * 2.0].into_iter()).unwrap_or(span);
    let key = |place: &Place| place.nadir.to_degrees();
    made.profile(("outward", "degrees from the nadir"), (degrees, RADIUS_BINS), key, |place, r| dot(place.outward, r))
}
