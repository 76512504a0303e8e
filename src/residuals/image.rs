//! Shift and scale of each image.

use super::asked::{Asked, joint_or_worst};
use super::columns::{Family, Writer};
use super::context::Context;
use super::found::Found;
use super::pictures::ImageValue;
use super::place::Place;
use crate::math::probability::p_is;
use crate::math::statistics::normal_two_sided;

/// Images up to which shift and scale are tested for each; beyond it the scale alone.
const IMAGES_IN_FULL: usize = 600;
/// Images beyond which they are not tested one by one.
pub(super) const MOST_IMAGES: usize = 2000;

/// Columns of an image: scale, and shifts where there are few images.
fn each(images: usize) -> usize {
    if images <= IMAGES_IN_FULL { 3 } else { 1 }
}

pub(super) fn family<'a>(images: usize) -> Family<'a> {
    let each = each(images);
    let fill = move |place: &Place, to: &mut Writer<'_>| {
        let first = each * place.image;
        to.entry(first, [place.u, place.v]);
        if each == 3 {
            to.entry(first + 1, [1.0, 0.0]);
            to.entry(first + 2, [0.0, 1.0]);
        }
    };
    Family { against: "image", count: each * images, local: true, fill: Box::new(fill), coordinates: None }
}

/// Sums over the measurements of an image.
#[derive(Clone, Default)]
struct Sums {
    n: usize,
    residual: [f64; 2],
    rotation: f64,
    /// Squares of what a rotation turns by.
    turning: f64,
}

impl Sums {
    fn add(&mut self, place: &Place, [x, y]: [f64; 2]) {
        self.n += 1;
        self.residual[0] += x;
        self.residual[1] += y;
        self.rotation += place.u * y - place.v * x;
        self.turning += place.u * place.u + place.v * place.v;
    }
}

/// Means of every image's residuals.
pub(super) fn values(context: &Context<'_>) -> Vec<ImageValue> {
    let contexts = &context.problem.image_contexts;
    let none: Vec<ImageValue> = contexts
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
    let pieces = context.in_pieces(|places| {
        let mut sums = vec![Sums::default(); contexts.len()];
        places.for_each(|(place, residual)| sums[place.image].add(&place, residual));
        sums
    });
    let (mut values, mut turning) = (none, vec![0.0; contexts.len()]);
    for (image, sums) in pieces.iter().flat_map(|sums| sums.iter().enumerate()) {
        let value = &mut values[image];
        value.n += sums.n;
        (0..2).for_each(|axis| value.mean[axis] += sums.residual[axis]);
        value.rotation += sums.rotation;
        turning[image] += sums.turning;
    }
    for (value, turning) in values.iter_mut().zip(&turning).filter(|(value, _)| value.n > 0) {
        value.mean = value.mean.map(|sum| sum / value.n as f64);
        value.rotation /= turning;
    }
    values
}

pub(super) fn judge(context: &Context<'_>, values: &mut [ImageValue], asked: &Asked<'_>, found: &mut Found) {
    let images = values.len();
    let each = each(images);
    let all: Vec<usize> = (0..each * images).collect();
    let sigma = (asked.variance() * asked.design_effect(&all)).sqrt();
    for value in values.iter_mut().filter(|value| value.n > 0) {
        if let Some((scale, unit)) = asked.alone(each * value.image) {
            (value.scale, value.scale_sigma) = (scale, unit * sigma);
        }
    }
    let worst = values
        .iter()
        .filter(|value| value.scale_sigma > 0.0)
        .max_by(|a, b| (a.scale / a.scale_sigma).abs().total_cmp(&(b.scale / b.scale_sigma).abs()));
    let description = worst.map_or(String::new(), |worst| {
        format!(
            "shift and scale of each of {images} images; largest scale residual {:.3} px at half the diagonal in image \
             {} ({} alone)",
            worst.scale,
            context.problem.image_names[worst.image],
            p_is(normal_two_sided(worst.scale / worst.scale_sigma))
        )
    });
    let single = worst.and_then(|worst| asked.test(&[each * worst.image]));
    let scales = values.iter().filter(|value| value.scale_sigma > 0.0).count();
    found.push("image", joint_or_worst(asked.test(&all), single, scales), description);
}
