//! Alternatives of a whole group: what people do to the coordinates of a list, and how it is undone.

use super::clock::{self, Clock};
use super::survey::{Group, Subject};
use nalgebra::Vector3;

/// One foot (international), m.
pub const FOOT: f64 = 0.3048;
/// Mean radius of the Earth, m; a group spans too little to feel its flattening.
const EARTH_M: f64 = 6_371_000.0;

/// What was done to all coordinates of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// Nothing.
    None,
    /// Heights in another unit: metres of one.
    HeightUnit(f64),
    /// Two axes exchanged.
    Exchanged(usize, usize),
    /// One axis of the wrong sign.
    Reversed(usize),
    /// Degrees; is the latitude first?
    Degrees(bool),
    /// Each has the position of the one so many places further on.
    Shifted(isize),
    /// Each has the position of another instant.
    Clock(Clock),
}

/// Units of length that lists mix up with metres, m: foot, millimetre, centimetre, and metres taken for feet.
pub const UNITS: [f64; 4] = [FOOT, 1e-3, 1e-2, 1.0 / FOOT];

impl Change {
    /// Alternatives for a group.
    pub fn all(group: &Group) -> Vec<Self> {
        let mut all = vec![Self::None];
        all.extend(UNITS.map(Self::HeightUnit));
        all.extend([Self::Exchanged(0, 1), Self::Exchanged(0, 2), Self::Exchanged(1, 2)]);
        all.extend([Self::Reversed(2), Self::Reversed(0), Self::Reversed(1)]);
        let degrees = |axis: usize, most: f64| group.members.iter().all(|m| m.recorded[axis].abs() <= most);
        // A list that spans more than a degree is no flight.
        let narrow = |axis: usize| {
            let values = || group.members.iter().map(|member| member.recorded[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min) < 1.0
        };
        if narrow(0) && narrow(1) {
            all.extend((degrees(0, 90.0) && degrees(1, 180.0)).then_some(Self::Degrees(true)));
            all.extend((degrees(0, 180.0) && degrees(1, 90.0)).then_some(Self::Degrees(false)));
        }
        all.extend([1, -1, 2, -2].map(Self::Shifted));
        all
    }

    /// Alternatives of the same kind.
    pub fn alternatives(self) -> usize {
        match self {
            Self::None => 1,
            Self::HeightUnit(_) => UNITS.len(),
            Self::Exchanged(..) | Self::Reversed(_) => 3,
            Self::Degrees(_) => 2,
            Self::Shifted(_) => 4,
            Self::Clock(clock) => clock.tried,
        }
    }

    /// Its kind.
    pub fn kind(self, subject: Subject) -> &'static str {
        match self {
            Self::None => "",
            Self::HeightUnit(_) => "height-scale",
            Self::Exchanged(..) => "axes-exchanged",
            Self::Reversed(_) => "axis-reversed",
            Self::Degrees(_) => "geographic",
            Self::Shifted(_) if subject == Subject::Gnss => "paired-with-neighbour",
            Self::Shifted(_) => "exchanged",
            Self::Clock(_) => "clock-offset",
        }
    }

    /// The positions without it, in the order of the members; `None` of a member that has none then.
    pub fn undone(self, group: &Group) -> Vec<Option<Vector3<f64>>> {
        let members = &group.members;
        let each =
            |undo: &dyn Fn(Vector3<f64>) -> Vector3<f64>| members.iter().map(|m| Some(undo(m.recorded))).collect();
        match self {
            Self::None => each(&|p| p),
            Self::HeightUnit(metres) => each(&|p| Vector3::new(p.x, p.y, p.z * metres)),
            Self::Exchanged(a, b) => each(&|mut p| {
                p.swap_rows(a, b);
                p
            }),
            Self::Reversed(axis) => each(&|mut p| {
                p[axis] = -p[axis];
                p
            }),
            Self::Degrees(latitude_first) => {
                let latitude = |p: &Vector3<f64>| if latitude_first { p.x } else { p.y };
                let mean = members.iter().map(|m| latitude(&m.recorded)).sum::<f64>() / members.len() as f64;
                let east = EARTH_M * mean.to_radians().cos();
                each(&|p| {
                    let longitude = if latitude_first { p.y } else { p.x };
                    Vector3::new(east * longitude.to_radians(), EARTH_M * latitude(&p).to_radians(), p.z)
                })
            }
            Self::Clock(clock) => clock::at_exposures(group, clock.seconds),
            Self::Shifted(by) => (0..members.len() as isize)
                .map(|k| {
                    let other = members.get(usize::try_from(k - by).ok()?)?;
                    (other.flight == members[k as usize].flight).then_some(other.recorded)
                })
                .collect(),
        }
    }

    /// The known value behind it, and its unit.
    pub fn value(self) -> Option<(f64, &'static str)> {
        match self {
            Self::HeightUnit(metres) => Some((1.0 / metres, "1")),
            Self::Shifted(by) => Some((by as f64, "places")),
            Self::Clock(clock) => Some((clock.seconds, "s")),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::survey::Member;
    use super::*;

    fn group(positions: &[[f64; 3]]) -> Group {
        let member = |(k, p): (usize, &[f64; 3])| Member {
            name: k.to_string(),
            recorded: Vector3::from(*p),
            computed: None,
            covariance: nalgebra::Matrix3::zeros(),
            flight: 0,
            time: None,
        };
        let members = positions.iter().enumerate().map(member).collect();
        Group { subject: Subject::Gnss, sigma: [0.03, 0.05], members, flights: vec!["a".into()] }
    }

    #[test]
    fn changes_are_undone() {
        let list = group(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        let first = |change: Change| change.undone(&list)[0];
        assert_eq!(first(Change::Exchanged(0, 2)), Some(Vector3::new(3.0, 2.0, 1.0)));
        assert_eq!(first(Change::Reversed(2)), Some(Vector3::new(1.0, 2.0, -3.0)));
        assert_eq!(first(Change::HeightUnit(FOOT)), Some(Vector3::new(1.0, 2.0, 3.0 * FOOT)));
        // The first has what belongs to the second, which nobody has; the second's own stands with the third.
        assert_eq!(Change::Shifted(1).undone(&list), [None, Some(Vector3::new(1.0, 2.0, 3.0))]);
    }

    #[test]
    fn degrees_become_metres_and_are_asked_only_where_they_can_be() {
        let list = group(&[[48.0, 11.0, 500.0], [48.001, 11.001, 500.0]]);
        let [Some(a), Some(b)] = Change::Degrees(true).undone(&list)[..] else { panic!("two positions") };
        assert!((b.y - a.y - 111.19).abs() < 0.01 && (b.x - a.x - 74.40).abs() < 0.01, "{a} {b}");
        assert!(Change::all(&list).contains(&Change::Degrees(true)));
        assert!(!Change::all(&group(&[[400.0, 11.0, 0.0]])).iter().any(|c| matches!(c, Change::Degrees(_))));
    }
}
