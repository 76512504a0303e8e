//! Velocities of the platform: measured ones, or those that projection centres and times give.
//!
//! The centres are those that the adjustment starts from. Where it follows another one, they are adjusted ones, and the
//! images know them to centimetres where a receiver or a tag in a file has half a metre. They have errors still, and an
//! effect that multiplies a noisy velocity is estimated too small with too small a standard deviation (errors in
//! variables). So each strip has a smoothing spline, whose stiffness the restricted likelihood of its flight decides.
//! Turns between strips are no part of one.

use crate::block::{Block, Image};
use crate::math::smoothing_spline::{Curve, Slopes, slopes};
use nalgebra::Vector3;

/// Two legs of a path whose velocities differ by more than this share of the larger are of two strips: the platform
/// turned between them (by more than 41 degrees), or waited and came back.
const TURN: f64 = 0.7;
/// Images of a strip at the most: a spline costs their third power.
const MOST: usize = 64;

/// A velocity and its standard deviation in each coordinate, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derived {
    /// World axes.
    pub velocity: Vector3<f64>,
    /// NaN where all strips of the flight have two positions alone.
    pub sigma: f64,
    /// Errors of a strip are alike, and taken as independent from image to image they need a larger standard deviation:
    /// that with which their mean along the strip varies as it does.
    pub independent_sigma: f64,
}

/// Measured velocities; where a block lacks them, those that the projection centres (of every image) of the same flight
/// give, NaN where neither is possible. With them the standard deviations of derived ones if their errors are taken as
/// independent, NaN beside measured ones.
pub fn velocities(block: &Block, centres: &[Vector3<f64>]) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let of = |(image, derived): (&Image, Option<Derived>)| match image.velocity {
        Some(velocity) => (velocity, f64::NAN),
        None => derived.map_or((Vector3::repeat(f64::NAN), f64::NAN), |own| (own.velocity, own.independent_sigma)),
    };
    block.images.iter().zip(derived(block, centres)).map(of).unzip()
}

/// Velocities of the images that have none, where projection centres (of every image) and times give one.
pub fn derived(block: &Block, centres: &[Vector3<f64>]) -> Vec<Option<Derived>> {
    let mut all = vec![None; block.images.len()];
    for flight in 0..block.flights.len() {
        let of_flight = |(_, image): &(usize, &Image)| image.flight.index() == flight;
        let images = block.images.iter().enumerate().filter(of_flight);
        let place = |(image, own): (usize, &Image)| Some(Place { time: own.time_s?, image, centre: centres[image] });
        let mut timed: Vec<Place> = images.filter_map(place).collect();
        timed.sort_by(|a, b| a.time.total_cmp(&b.time));
        timed.dedup_by(|a, b| a.time == b.time);
        if timed.iter().any(|place| block.images[place.image].velocity.is_none()) {
            of_flight_at(&timed, &mut all);
        }
    }
    for (own, image) in all.iter_mut().zip(&block.images) {
        if image.velocity.is_some() {
            *own = None;
        }
    }
    all
}

/// Where an image was at its time.
#[derive(Clone, Copy)]
struct Place {
    time: f64,
    image: usize,
    centre: Vector3<f64>,
}

impl Place {
    fn leg(&self, next: &Self) -> Vector3<f64> {
        (next.centre - self.centre) / (next.time - self.time)
    }
}

/// Velocities along a flight whose images are in the order of time.
fn of_flight_at(timed: &[Place], all: &mut [Option<Derived>]) {
    let strips = strips(timed);
    let curve = |strip: &&[Place]| Curve {
        times: strip.iter().map(|place| place.time).collect(),
        values: (0..3).map(|axis| strip.iter().map(|place| place.centre[axis]).collect()).collect(),
    };
    let (long, short): (Vec<&[Place]>, Vec<&[Place]>) = strips.into_iter().partition(|strip| strip.len() > 2);
    let curves: Vec<Curve> = long.iter().map(curve).collect();
    let slopes = slopes(&curves);
    let noise = slopes.first().map_or(f64::NAN, |own| own.noise);
    // What belongs to a longer strip as well is known better there.
    for strip in short {
        let [a, b] = [&strip[0], &strip[1]];
        let sigma = noise * 2f64.sqrt() / (b.time - a.time);
        for place in [a, b] {
            let independent_sigma = sigma * 2f64.sqrt();
            all[place.image] = Some(Derived { velocity: a.leg(b), sigma, independent_sigma });
        }
    }
    for (strip, Slopes { values, sigmas, mean_sigma, .. }) in long.iter().zip(slopes) {
        let of_mean = mean_sigma * (strip.len() as f64).sqrt();
        for (k, place) in strip.iter().enumerate() {
            let velocity = Vector3::new(values[0][k], values[1][k], values[2][k]);
            let sigma = sigmas[k];
            all[place.image] = Some(Derived { velocity, sigma, independent_sigma: sigma.max(of_mean) });
        }
    }
}

/// Straight parts of a path, of two places at least. A leg that connects two strips is a part of its own.
fn strips(timed: &[Place]) -> Vec<&[Place]> {
    let legs: Vec<Vector3<f64>> = timed.windows(2).map(|pair| pair[0].leg(&pair[1])).collect();
    let turns = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm() >= TURN * a.norm().max(b.norm());
    let mut strips = Vec::new();
    let mut first = 0;
    for next in 1..=legs.len() {
        let ends = next == legs.len() || turns(&legs[next - 1], &legs[next]) || next - first >= MOST - 1;
        if ends {
            strips.push(&timed[first..=next]);
            first = next;
        }
    }
    strips
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// Two strips of six images and a turn between them.
    fn flight() -> Vec<Place> {
        let place = |k: usize| {
            let along = if k < 6 { 10.0 * k as f64 } else { 50.0 - 10.0 * (k - 6) as f64 };
            let across = if k < 6 { 0.0 } else { 20.0 };
            Place { time: 2.0 * k as f64, image: k, centre: Vector3::new(along, across, 40.0) }
        };
        (0..12).map(place).collect()
    }

    #[test]
    fn a_turn_is_no_part_of_a_strip() {
        let flight = flight();
        let lengths: Vec<usize> = strips(&flight).iter().map(|strip| strip.len()).collect();
        assert_eq!(lengths, [6, 2, 6]);
        let mut all = vec![None; 12];
        of_flight_at(&flight, &mut all);
        for (k, own) in all.into_iter().enumerate() {
            let expected = if k < 6 { 5.0 } else { -5.0 };
            let Derived { velocity, .. } = own.expect("a velocity");
            assert!((velocity - Vector3::new(expected, 0.0, 0.0)).norm() < 1e-9, "{k}: {velocity}");
        }
    }

    #[test]
    fn a_slow_leg_in_the_direction_of_the_strip_is_a_turn_too() {
        let mut flight = flight();
        for place in &mut flight[6..] {
            // The next strip goes back from 3 m further on, half a minute later.
            place.time += 30.0;
            place.centre += Vector3::new(3.0, -20.0, 0.0);
        }
        assert_eq!(strips(&flight).iter().map(|strip| strip.len()).collect::<Vec<_>>(), [6, 2, 6]);
    }

    #[test]
    fn errors_of_positions_are_smoothed() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let noise = Normal::new(0.0, 0.5).expect("a distribution");
        let (mut smooth, mut differences) = (0.0, 0.0);
        for _ in 0..20 {
            let mut flight = flight();
            flight.iter_mut().for_each(|place| place.centre.x += noise.sample(&mut random));
            let mut all = vec![None; 12];
            of_flight_at(&flight, &mut all);
            for k in (1..5).chain(7..11) {
                let expected = if k < 6 { 5.0 } else { -5.0 };
                let Derived { velocity, sigma, .. } = all[k].expect("a velocity");
                assert!(sigma > 0.0 && sigma < 0.5, "{sigma}");
                smooth += (velocity.x - expected).powi(2);
                differences += ((flight[k + 1].centre.x - flight[k - 1].centre.x) / 4.0 - expected).powi(2);
            }
        }
        assert!(smooth < 0.5 * differences, "{smooth} for {differences}");
    }
}
