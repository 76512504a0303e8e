//! Residuals against image, flight, time, temperature, row, radius, depth and viewing direction.
//!
//! A mean residual that changes with time is of little use: the pose absorbs it. What a slow change leaves are patterns over the sensor
//! that change with it, so smooth patterns ([`super::place::patterns`]) times functions of the quantity are tested.

use super::columns::{Columns, Entry};
use super::pictures::{ImageValue, Profile, ProfileBin};
use super::place::{LINEAR_PATTERNS, PATTERNS, Place, Span, legendre, patterns};
use super::{Context, Found, joint_or_worst};
use crate::math::statistics::normal_two_sided;
use std::f64::consts::{PI, TAU};

/// Images up to which shift and scale are tested for each; beyond it the scale alone.
const IMAGES_IN_FULL: usize = 600;
/// Images beyond which they are not tested one by one.
const MOST_IMAGES: usize = 2000;
/// Bins of the profiles.
const ROW_BINS: usize = 16;
const RADIUS_BINS: usize = 12;
const DEPTH_BINS: usize = 12;
const DIRECTION_BINS: usize = 8;
/// Most columns of the test against the flight.
const MOST_COLUMNS: usize = 1500;

pub(super) fn test(context: &Context<'_>, found: &mut Found) {
    image(context, found);
    flight(context, found);
    let contexts = &context.base.problem.image_contexts;
    let time = Span::of(contexts.iter().map(|image| image.time_s));
    smooth(context, found, "time", time, 3, |place| contexts[place.image].time_s);
    let temperature = Span::of(contexts.iter().map(|image| image.temperature_c));
    smooth(context, found, "temperature", temperature, 2, |place| contexts[place.image].temperature_c);
    row(context, found);
    radius(context, found);
    height(context, found);
    direction(context, found);
}

fn run(context: &Context<'_>, found: &mut Found, against: &'static str, columns: &Columns, description: String) {
    let score = context.base.score(columns);
    let all: Vec<usize> = (0..columns.count).collect();
    found.push(against, context.test(&score, &all), description);
}

fn entry(column: usize, [x, y]: [f64; 2]) -> Entry {
    Entry { column: column as u32, x, y }
}

/// Mean of a component of the residuals over bins of a quantity.
fn profile(
    context: &Context<'_>,
    (against, component, unit): (&'static str, &'static str, &'static str),
    (span, bins): (Span, usize),
    key: impl Fn(&Place) -> f64,
    value: impl Fn(&Place, [f64; 2]) -> f64,
) -> Profile {
    let mut sums = vec![(0usize, 0.0, 0.0); bins];
    for (k, place) in context.places.iter().enumerate() {
        let value = value(place, context.base.residual[k]);
        let bin = &mut sums[span.bin(key(place), bins)];
        *bin = (bin.0 + 1, bin.1 + value, bin.2 + value * value);
    }
    let filled = sums.iter().enumerate().filter(|(_, (n, ..))| *n > 1);
    let bins = filled
        .map(|(bin, (n, sum, squares))| {
            let count = *n as f64;
            let mean = sum / count;
            let variance = ((squares - count * mean * mean) / (count - 1.0)).max(0.0);
            ProfileBin { x: span.middle_of(bin, bins), n: *n, mean, sigma: (variance / count).sqrt() }
        })
        .collect();
    Profile { against, component, unit, bins }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// A quarter turn, from x towards y.
fn turned([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}

fn image(context: &Context<'_>, found: &mut Found) {
    let problem = context.base.problem;
    let images = problem.image_contexts.len();
    let mut values: Vec<ImageValue> = problem
        .image_contexts
        .iter()
        .enumerate()
        .map(|(image, constants)| ImageValue {
            image,
            flight: constants.flight as usize,
            time_s: constants.time_s,
            n: 0,
            mean: [0.0; 2],
            scale: f64::NAN,
            scale_sigma: f64::NAN,
            rotation: 0.0,
        })
        .collect();
    let mut turning = vec![0.0; images];
    for (place, residual) in context.places.iter().zip(&context.base.residual) {
        let value = &mut values[place.image];
        value.n += 1;
        value.mean[0] += residual[0];
        value.mean[1] += residual[1];
        value.rotation += dot([-place.v, place.u], *residual);
        turning[place.image] += place.u * place.u + place.v * place.v;
    }
    for (value, turning) in values.iter_mut().zip(&turning).filter(|(value, _)| value.n > 0) {
        value.mean = value.mean.map(|sum| sum / value.n as f64);
        value.rotation /= turning;
    }
    if images > MOST_IMAGES {
        found.skip("image", "too many images to test each");
    } else {
        let shifts = images <= IMAGES_IN_FULL;
        let each = if shifts { 3 } else { 1 };
        let columns = context.columns(each * images, |k, entries| {
            let place = &context.places[k];
            let first = each * place.image;
            entries.push(entry(first, [place.u, place.v]));
            if shifts {
                entries.extend([entry(first + 1, [1.0, 0.0]), entry(first + 2, [0.0, 1.0])]);
            }
        });
        let score = context.base.score(&columns);
        let all: Vec<usize> = (0..columns.count).collect();
        let sigma = (context.base.variance() * score.design_effect(&all, context.base.variance())).sqrt();
        for value in values.iter_mut().filter(|value| value.n > 0) {
            if let Some((scale, unit)) = score.alone(each * value.image) {
                (value.scale, value.scale_sigma) = (scale, unit * sigma);
            }
        }
        let worst = values
            .iter()
            .filter(|value| value.scale_sigma > 0.0)
            .max_by(|a, b| (a.scale / a.scale_sigma).abs().total_cmp(&(b.scale / b.scale_sigma).abs()));
        let description = worst.map_or(String::new(), |worst| {
            format!(
                "shift and scale of each of {images} images; largest scale residual {:.3} px at half the diagonal in image {} (p = {:.1e} alone)",
                worst.scale,
                problem.image_names[worst.image],
                normal_two_sided(worst.scale / worst.scale_sigma)
            )
        });
        let single = worst.and_then(|worst| context.test(&score, &[each * worst.image]));
        let scales = values.iter().filter(|value| value.scale_sigma > 0.0).count();
        found.push("image", joint_or_worst(context.test(&score, &all), single, scales), description);
    }
    found.pictures.images = values.into_iter().filter(|value| value.n > 0).collect();
}

fn flight(context: &Context<'_>, found: &mut Found) {
    let flights = context.base.problem.block_context.counts[1] as usize;
    if flights < 2 {
        return found.skip("flight", "one flight");
    }
    let count = (flights - 1) * PATTERNS;
    if count > MOST_COLUMNS {
        return found.skip("flight", "too many flights to test each");
    }
    let columns = context.columns(count, |k, entries| {
        let place = &context.places[k];
        if place.flight > 0 {
            let first = (place.flight - 1) * PATTERNS;
            entries.extend(patterns(place.u, place.v).into_iter().enumerate().map(|(p, d)| entry(first + p, d)));
        }
    });
    let description = format!("{PATTERNS} smooth patterns over the sensor that differ between {flights} flights");
    run(context, found, "flight", &columns, description);
}

fn smooth(
    context: &Context<'_>,
    found: &mut Found,
    against: &'static str,
    span: Option<Span>,
    degrees: usize,
    key: impl Fn(&Place) -> f64,
) {
    let Some(span) = span else {
        return found.skip(against, "not known for every image, or the same in all");
    };
    let columns = context.columns(PATTERNS + (degrees - 1) * LINEAR_PATTERNS, |k, entries| {
        let place = &context.places[k];
        let factors = legendre(span.scale(key(place)));
        let patterns = patterns(place.u, place.v);
        entries.extend(patterns.iter().enumerate().map(|(p, d)| entry(p, d.map(|value| value * factors[0]))));
        for (degree, factor) in factors.iter().enumerate().take(degrees).skip(1) {
            let first = PATTERNS + (degree - 1) * LINEAR_PATTERNS;
            let linear = patterns.iter().take(LINEAR_PATTERNS);
            entries.extend(linear.enumerate().map(|(p, d)| entry(first + p, d.map(|value| value * factor))));
        }
    });
    let unit = if against == "time" { "s" } else { "degrees Celsius" };
    found
        .pictures
        .profiles
        .push(profile(context, (against, "radial", unit), (span, DEPTH_BINS), &key, |place, r| dot(place.radial, r)));
    let description = format!(
        "{PATTERNS} smooth patterns over the sensor that change evenly with {against}, {LINEAR_PATTERNS} with its powers up to {degrees}"
    );
    run(context, found, against, &columns, description);
}

fn row(context: &Context<'_>, found: &mut Found) {
    let span = Span::of([-1.0, 1.0].into_iter());
    let Some(span) = span else { return };
    let columns = context.columns(2 * ROW_BINS + 4, |k, entries| {
        let place = &context.places[k];
        let bin = span.bin(place.row, ROW_BINS);
        entries.extend([entry(2 * bin, [1.0, 0.0]), entry(2 * bin + 1, [0.0, 1.0])]);
        // A shutter moves the image along the motion, which points elsewhere in every strip.
        let [first, second, _] = legendre(place.row);
        let across = turned(place.along);
        let last = 2 * ROW_BINS;
        let moved = [(first, place.along), (second, place.along), (first, across), (second, across)];
        entries.extend(moved.iter().enumerate().map(|(c, (factor, d))| entry(last + c, d.map(|d| d * factor))));
    });
    for (component, k) in [("x", 0), ("y", 1)] {
        let key = |place: &Place| place.row;
        found.pictures.profiles.push(profile(
            context,
            ("row", component, "half heights"),
            (span, ROW_BINS),
            key,
            |_, r| r[k],
        ));
    }
    let description =
        format!("means of {ROW_BINS} bands of rows; slope and curvature over the rows along and across the motion");
    run(context, found, "row", &columns, description);
}

fn radius(context: &Context<'_>, found: &mut Found) {
    let largest = context.places.iter().map(|place| place.radius).fold(0.0, f64::max);
    let Some(span) = Span::of([0.0, largest].into_iter()) else {
        return found.skip("radius", "all measurements lie in the centre");
    };
    let columns = context.columns(2 * RADIUS_BINS, |k, entries| {
        let place = &context.places[k];
        let bin = span.bin(place.radius, RADIUS_BINS);
        entries.extend([entry(2 * bin, place.radial), entry(2 * bin + 1, turned(place.radial))]);
    });
    for (component, turn) in [("radial", false), ("tangential", true)] {
        let value = |place: &Place, r| dot(if turn { turned(place.radial) } else { place.radial }, r);
        found.pictures.profiles.push(profile(
            context,
            ("radius", component, "px"),
            (span, RADIUS_BINS),
            |place| place.radius,
            value,
        ));
    }
    let description = format!("radial and tangential means of {RADIUS_BINS} rings");
    run(context, found, "radius", &columns, description);
}

fn height(context: &Context<'_>, found: &mut Found) {
    let Some(span) = Span::of(context.places.iter().map(|place| place.depth)) else {
        return found.skip("height", "every point has the same depth");
    };
    let columns = context.columns(8, |k, entries| {
        let place = &context.places[k];
        let [first, second, _] = legendre(span.scale(place.depth));
        let r2 = place.u * place.u + place.v * place.v;
        let shapes = [[1.0, 0.0], [0.0, 1.0], [place.u, place.v], [r2 * place.u, r2 * place.v]];
        for (degree, factor) in [first, second].into_iter().enumerate() {
            entries.extend(shapes.iter().enumerate().map(|(p, d)| entry(4 * degree + p, d.map(|d| d * factor))));
        }
    });
    found.pictures.profiles.push(profile(
        context,
        ("height", "radial", "m of depth"),
        (span, DEPTH_BINS),
        |place| place.depth,
        |place, r| dot(place.radial, r),
    ));
    run(
        context,
        found,
        "height",
        &columns,
        "shift and radial patterns that change with the depth below the camera".into(),
    );
}

fn direction(context: &Context<'_>, found: &mut Found) {
    let largest = context.places.iter().map(|place| place.nadir).fold(0.0, f64::max);
    let Some(span) = Span::of([0.0, largest].into_iter()) else {
        return found.skip("direction", "all rays point straight down");
    };
    let columns = context.columns(3 * DIRECTION_BINS, |k, entries| {
        let place = &context.places[k];
        let nadir = span.bin(place.nadir, DIRECTION_BINS);
        let azimuth = (((place.azimuth + PI) / TAU * DIRECTION_BINS as f64) as usize).min(DIRECTION_BINS - 1);
        entries.extend([
            entry(nadir, place.outward),
            entry(DIRECTION_BINS + 2 * azimuth, place.outward),
            entry(DIRECTION_BINS + 2 * azimuth + 1, turned(place.outward)),
        ]);
    });
    let degrees = |place: &Place| place.nadir.to_degrees();
    if let Some(span) = Span::of([0.0, largest.to_degrees()].into_iter()) {
        let about = ("direction", "outward", "degrees from the nadir");
        found
            .pictures
            .profiles
            .push(profile(context, about, (span, RADIUS_BINS), degrees, |place, r| dot(place.outward, r)));
    }
    let description =
        format!("away from the nadir and across, over {DIRECTION_BINS} nadir angles and {DIRECTION_BINS} azimuths");
    run(context, found, "direction", &columns, description);
}
