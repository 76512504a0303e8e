//! Positions of another instant: the clock of the camera and that of the receiver differ.
//!
//! Each recorded position is that of the antenna some seconds after the exposure. Positions at the exposures are
//! interpolated between the recorded ones of the same flight, as far as these reach.

use super::align::{Aligned, align};
use super::survey::{Group, Member};
use crate::math::statistics::{median, rms};
use nalgebra::Vector3;

/// GPS time against UTC since 2017, s.
pub const GPS_AHEAD_OF_UTC: f64 = 18.0;
/// Time zones differ by whole and half hours, s, and by so many of them at most.
const HALF_HOUR: f64 = 1800.0;
const MOST_HALF_HOURS: u32 = 28;
/// Unknown differences that are tried, s: half a minute both ways.
const MOST_SECONDS: f64 = 30.0;
/// Trials within an interval between images: the correction of each reaches the next one.
const STEPS_PER_INTERVAL: f64 = 2.0;
/// Trials of unknown differences at the most, each way.
const MOST_TRIALS: f64 = 60.0;
/// Corrections of a trial: each leaves a tenth.
const CORRECTIONS: usize = 4;
/// Gaps of so many intervals lie between strips: nothing is interpolated across.
const GAP: f64 = 2.5;
/// A difference below this share of an interval is a delay of the receiver, which an effect describes.
const LEAST_SHARE: f64 = 0.2;
/// Standard deviation of a median of normal values over that of their mean: `sqrt(pi / 2)`.
const MEDIAN_OVER_MEAN: f64 = 1.253_314_137_315_500_3;

/// A difference of clocks under which positions agree with the images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Recorded positions are those so many seconds after the exposures.
    pub seconds: f64,
    /// Standard deviation, s.
    pub sigma: f64,
    /// Differences that were tried.
    pub tried: usize,
}

/// The difference under which the positions of a group agree best; `None` where images have no times, or positions are
/// `off` by too little for one as they are recorded, m.
pub fn best(group: &Group, off: Option<f64>) -> Option<Clock> {
    let flights = flights(group);
    let interval = interval(&flights)?;
    let path: Vec<f64> = flights.iter().flat_map(|flight| steps(group, flight)).map(|step| step.norm()).collect();
    if off.is_some_and(|off| off < LEAST_SHARE * median(&path)) {
        return None;
    }
    let differences = differences(interval, &flights);
    let tried = differences.len();
    let all = differences.into_iter().filter_map(|seconds| Some((seconds, Trial::new(group, seconds)?)));
    let (seconds, _) = all.min_by(|(_, a), (_, b)| a.variance().total_cmp(&b.variance()))?;
    let mut found = Clock { seconds, sigma: f64::NAN, tried };
    for _ in 0..CORRECTIONS {
        let Some((correction, sigma)) = Trial::new(group, found.seconds)?.correction(group, &flights) else { break };
        found = Clock { seconds: found.seconds + correction, sigma, tried };
    }
    (found.sigma.is_finite() && found.seconds.abs() > LEAST_SHARE * interval).then_some(found)
}

/// Differences that are tried, s, both ways: unknown ones on a grid, and known ones up to half of the longest
/// flight: beyond, few exposures keep a position, and these fit by chance.
fn differences(interval: f64, flights: &[Vec<(f64, usize)>]) -> Vec<f64> {
    let step = interval / STEPS_PER_INTERVAL;
    let count = (MOST_SECONDS / step).min(MOST_TRIALS) as i32;
    let grid = (1..=count).map(|k| f64::from(k) * step);
    let longest = flights.iter().filter_map(|flight| Some(flight.last()?.0 - flight.first()?.0)).fold(0.0, f64::max);
    let zones = (1..=MOST_HALF_HOURS).map(|k| f64::from(k) * HALF_HOUR);
    let known = std::iter::once(GPS_AHEAD_OF_UTC).chain(zones).filter(|seconds| *seconds < 0.5 * longest);
    grid.chain(known).flat_map(|seconds| [seconds, -seconds]).collect()
}

/// Positions under one difference.
struct Trial {
    members: Vec<usize>,
    aligned: Aligned,
}

impl Trial {
    fn new(group: &Group, seconds: f64) -> Option<Self> {
        let positions = at_exposures(group, seconds);
        let members: Vec<usize> =
            (0..positions.len()).filter(|k| positions[*k].is_some() && group.members[*k].computed.is_some()).collect();
        let source: Vec<_> = members.iter().filter_map(|k| group.members[*k].computed).collect();
        let target: Vec<_> = members.iter().filter_map(|k| positions[*k]).collect();
        Some(Self { aligned: align(&source, &target, group.sigma)?, members })
    }

    /// In the network, where all trials have one scale.
    fn variance(&self) -> f64 {
        self.aligned.variance * self.aligned.similarity.scale.powi(-2)
    }

    /// What the misfits along the path say of the difference, s, with its standard deviation.
    fn correction(&self, group: &Group, flights: &[Vec<(f64, usize)>]) -> Option<(f64, f64)> {
        let mut velocity = vec![None; group.members.len()];
        for flight in flights {
            for (pair, step) in flight.windows(2).zip(steps(group, flight)) {
                velocity[pair[0].1] = Some(step / (pair[1].0 - pair[0].0));
            }
        }
        let along = |(k, misfit): (&usize, &Vector3<f64>)| {
            let v = velocity[*k].filter(|v: &Vector3<f64>| v.norm() > 0.0)?;
            Some(misfit.dot(&v) / v.norm_squared())
        };
        let seconds: Vec<f64> = self.members.iter().zip(&self.aligned.misfits).filter_map(along).collect();
        if seconds.len() < 2 {
            return None;
        }
        let correction = median(&seconds);
        let off: Vec<f64> = seconds.iter().map(|own| own - correction).collect();
        Some((correction, MEDIAN_OVER_MEAN * rms(&off) / (off.len() as f64).sqrt()))
    }
}

/// Positions at the exposures, where recorded ones are those of so many seconds later; `None` of a member whose instant
/// lies between no two recorded ones.
pub fn at_exposures(group: &Group, seconds: f64) -> Vec<Option<Vector3<f64>>> {
    let mut positions = vec![None; group.members.len()];
    let flights = flights(group);
    let Some(interval) = interval(&flights) else { return positions };
    for flight in &flights {
        for &(time, k) in flight {
            // The exposure at whose record the antenna was where it was at this one.
            let sought = time - seconds;
            let next = flight.partition_point(|(other, _)| *other < sought);
            let (Some(&(after, b)), Some(&(before, a))) = (flight.get(next), flight.get(next.saturating_sub(1))) else {
                continue;
            };
            let [a, b] = [a, b].map(|k| group.members[k].recorded);
            if after == sought {
                positions[k] = Some(b);
            } else if before < sought && after - before < GAP * interval {
                positions[k] = Some(a + (b - a) * ((sought - before) / (after - before)));
            }
        }
    }
    positions
}

/// The usual time between two images of a flight, s.
fn interval(flights: &[Vec<(f64, usize)>]) -> Option<f64> {
    let steps: Vec<f64> =
        flights.iter().flat_map(|flight| flight.windows(2)).map(|pair| pair[1].0 - pair[0].0).collect();
    if steps.is_empty() { None } else { Some(median(&steps)).filter(|step| *step > 0.0) }
}

/// From each recorded position of a flight to the next.
fn steps<'a>(group: &'a Group, flight: &'a [(f64, usize)]) -> impl Iterator<Item = Vector3<f64>> + 'a {
    flight.windows(2).map(|pair| group.members[pair[1].1].recorded - group.members[pair[0].1].recorded)
}

/// Times and members of each flight, by time.
fn flights(group: &Group) -> Vec<Vec<(f64, usize)>> {
    let mut flights: Vec<Vec<(f64, usize)>> = vec![Vec::new(); group.flights.len()];
    let timed = |(k, member): (usize, &Member)| Some((member.flight, member.time?, k));
    for (flight, time, k) in group.members.iter().enumerate().filter_map(timed) {
        if let Some(rows) = flights.get_mut(flight).filter(|_| time.is_finite()) {
            rows.push((time, k));
        }
    }
    for rows in &mut flights {
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        rows.dedup_by(|next, own| next.0 == own.0);
    }
    flights
}

#[cfg(test)]
mod tests {
    use super::super::survey::Subject;
    use super::*;
    use nalgebra::Matrix3;

    /// Where a drone is that flies strips to and fro at 7 m/s, 36 s each, and turns in 12 s.
    fn path(time: f64) -> Vector3<f64> {
        let strip = (time / 48.0).floor();
        let within = time - 48.0 * strip;
        let (along, turn) = (7.0 * within.min(36.0), (within - 36.0).max(0.0) / 12.0);
        let x = if strip as i64 % 2 == 0 { along } else { 252.0 - along };
        Vector3::new(x, 20.0 * (strip + turn), 80.0 + (0.1 * time).sin())
    }

    fn flight(seconds: f64) -> Group {
        flight_of(seconds, 4, 12)
    }

    /// So many strips of 36 s, and images in each.
    fn flight_of(seconds: f64, strips: usize, images: usize) -> Group {
        let member = |k: usize| {
            let time = 48.0 * (k / images) as f64 + 36.0 / images as f64 * (k % images) as f64;
            Member {
                name: k.to_string(),
                recorded: path(time + seconds),
                computed: Some(0.5 * path(time)),
                covariance: Matrix3::zeros(),
                flight: 0,
                time: Some(time),
            }
        };
        let members = (0..strips * images).map(member).collect();
        Group { subject: Subject::Gnss, sigma: [0.03, 0.05], members, flights: vec!["a".into()] }
    }

    fn off(group: &Group) -> Option<f64> {
        let of = |own: &dyn Fn(&Member) -> Vector3<f64>| group.members.iter().map(own).collect::<Vec<_>>();
        let aligned = align(&of(&|member| member.computed.unwrap()), &of(&|member| member.recorded), group.sigma)?;
        Some(median(&aligned.misfits.iter().map(Vector3::norm).collect::<Vec<_>>()))
    }

    #[test]
    fn clocks_that_differ_are_found_with_their_difference() {
        for seconds in [5.0, -18.0, 11.3] {
            let group = flight(seconds);
            let found = best(&group, off(&group)).expect("a difference");
            assert!((found.seconds - seconds).abs() < 0.2, "{seconds}: {found:?}");
        }
    }

    #[test]
    fn known_differences_are_tried_beyond_the_grid() {
        // Images every 0.4 s: the grid ends at 12 s.
        let group = flight_of(GPS_AHEAD_OF_UTC, 2, 90);
        let found = best(&group, off(&group)).expect("a difference");
        assert!((found.seconds - GPS_AHEAD_OF_UTC).abs() < 0.2, "{found:?}");
        // The grid and 18 s, both ways; a flight of two minutes holds no half hour.
        assert_eq!(found.tried, 122);
        let long = [(0..3_u32).map(|k| (f64::from(k) * 2000.0, k as usize)).collect::<Vec<_>>()];
        let known = differences(3.0, &long);
        assert_eq!(&known[known.len() - 4..], [18.0, -18.0, 1800.0, -1800.0]);
    }

    #[test]
    fn a_delay_of_the_receiver_and_images_without_times_are_left_alone() {
        let group = flight(0.1);
        assert_eq!(best(&group, off(&group)), None);
        let mut group = flight(5.0);
        group.members.iter_mut().for_each(|member| member.time = None);
        assert_eq!(best(&group, None), None);
    }
}
