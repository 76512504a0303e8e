//! Velocities in another unit, or with other axes, than the positions and times of the same table.

use super::flights::{self, Place, Source};
use super::tables::Tables;
use crate::block::edit::{Change, Edit};
use crate::math::statistics::median;
use crate::mistakes::Mistake;
use nalgebra::Vector3;

/// Fewest images whose velocity is compared.
const FEWEST: usize = 10;
/// Legs before and after an image that differ by more than this share are a turn, and no velocity.
const TURN: f64 = 0.3;
/// The same of their intervals.
const INTERVALS: f64 = 2.0;
/// Speed below which noise of positions decides, m/s.
const SLOWEST: f64 = 0.5;
/// Relative misfit, median, that an alternative must reach...
const FITS: f64 = 0.1;
/// ... and that the velocities as stated must exceed: half the speed is no noise of a receiver.
const WRONG: f64 = 0.5;
/// How near the median ratio of the speeds must be to that of a unit: half of what parts km/h from ft/s.
const NEAR: f64 = 0.045;

/// What people give in place of metres per second, and its size in m/s.
const UNITS: [(f64, &str); 7] = [
    (1.0 / 3.6, "in km/h"),
    (0.3048, "in ft/s"),
    (1852.0 / 3600.0, "in knots"),
    (0.447_04, "in miles per hour"),
    (0.1, "in dm/s"),
    (0.01, "in cm/s"),
    (1.0 / 0.3048, "too small by 0.3048, as feet that were taken for metres in the positions, or converted twice"),
];

/// What was done to velocities.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Alternative {
    Unit(f64, &'static str),
    Negated,
    Exchanged,
}

impl Alternative {
    /// The right velocity.
    fn undo(self, v: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Unit(factor, _) => v * factor,
            Self::Negated => -v,
            Self::Exchanged => Vector3::new(v.y, v.x, v.z),
        }
    }

    fn changes(self) -> Vec<Change> {
        match self {
            Self::Unit(factor, _) => ["vx", "vy", "vz"].map(|column| Change::times(column, factor)).into(),
            Self::Negated => ["vx", "vy", "vz"].map(|column| Change::times(column, -1.0)).into(),
            Self::Exchanged => vec![Change::ExchangeColumns { columns: ["vx".into(), "vy".into()] }],
        }
    }
}

/// A velocity beside that of the path.
struct Pair {
    stated: Vector3<f64>,
    derived: Vector3<f64>,
}

/// Velocities of straight parts of a path, by central differences.
fn pairs(path: &[Place]) -> Vec<Pair> {
    let derived = |triple: &[Place]| {
        let [a, b, c] = triple else { return None };
        let (before, after) = (b.time - a.time, c.time - b.time);
        let even = before > 0.0 && after > 0.0 && before.max(after) <= INTERVALS * before.min(after);
        let [one, two] = [(b.position - a.position) / before, (c.position - b.position) / after];
        let straight = (one - two).norm() <= TURN * one.norm().max(two.norm());
        let velocity = (c.position - a.position) / (c.time - a.time);
        let stated = b.velocity.filter(|v| v.norm() > 0.0)?;
        (even && straight && velocity.norm() > SLOWEST).then_some(Pair { stated, derived: velocity })
    };
    flights::by_time(path).windows(3).filter_map(derived).collect()
}

/// Median of the misfit once something is undone, relative to the speed.
fn misfit(pairs: &[Pair], undo: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> f64 {
    let one = |pair: &Pair| (undo(&pair.stated) - pair.derived).norm() / pair.derived.norm();
    median(&pairs.iter().map(one).collect::<Vec<_>>())
}

fn alternative(tables: &Tables, source: Source) -> Option<Alternative> {
    let pairs: Vec<Pair> = flights::paths(tables, source).iter().flat_map(|path| pairs(path)).collect();
    // False for NaN, too.
    let wrong = misfit(&pairs, |v| *v) > WRONG;
    if pairs.len() < FEWEST || !wrong {
        return None;
    }
    let ratio = |pair: &Pair| pair.derived.dot(&pair.stated) / pair.stated.norm_squared();
    let ratio = median(&pairs.iter().map(ratio).collect::<Vec<_>>());
    let away = |(factor, _): &(f64, &str)| (ratio / factor).ln().abs();
    let unit = UNITS.into_iter().filter(|unit| away(unit) < NEAR).min_by(|a, b| away(a).total_cmp(&away(b)));
    let unit = unit.map(|(factor, words)| Alternative::Unit(factor, words));
    let mut all = [Some(Alternative::Negated), Some(Alternative::Exchanged), unit].into_iter().flatten();
    all.find(|one| misfit(&pairs, |v| one.undo(v)) < FITS)
}

/// Velocities that contradict times and positions.
pub fn judge(tables: &Tables) -> Option<Mistake> {
    // Where the receiver and the approximate orientation disagree, the positions may be at fault.
    let found = alternative(tables, Source::Approximate)?;
    if flights::source(tables) == Source::Gnss && alternative(tables, Source::Gnss) != Some(found) {
        return None;
    }
    let what = match found {
        Alternative::Unit(_, words) => format!("are {words}"),
        Alternative::Negated => "have the opposite sign".into(),
        Alternative::Exchanged => "have vx and vy exchanged".into(),
    };
    let sentence = format!("Images: the velocities {what}, against positions and times of the same images.");
    let remedy = "Convert them to m/s in the axes of the block (vx, vy, vz of images.csv).";
    let mend = found.changes().into_iter().map(|change| Edit::all("images.csv", change)).collect();
    let mistake = Mistake::new("velocity-unit", "images", sentence, remedy.into()).undone_by(mend);
    Some(match found {
        Alternative::Unit(factor, _) => mistake.sized(1.0 / factor, None, "1"),
        Alternative::Negated => mistake.sized(-1.0, None, "1"),
        Alternative::Exchanged => mistake,
    })
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Image, made};
    use super::*;

    fn judged(change: impl Fn(&mut Image)) -> Option<Mistake> {
        let mut tables = made::with_images(made::images(40));
        tables.images.iter_mut().for_each(change);
        judge(&tables)
    }

    fn velocities(change: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Option<Mistake> {
        judged(|image| image.velocity = image.velocity.map(&change))
    }

    #[test]
    fn other_units_are_named() {
        for (factor, words) in UNITS {
            let found = velocities(|v| v / factor).expect(words);
            assert!((found.value.expect("a factor") * factor - 1.0).abs() < 1e-12, "{found:?}");
            assert!(found.sentence.contains(words));
            assert_eq!(found.mend[2].change, Change::times("vz", factor));
        }
    }

    #[test]
    fn signs_and_axes_are_named() {
        assert_eq!(velocities(|v| -v).and_then(|found| found.value), Some(-1.0));
        let exchanged = velocities(|v| Vector3::new(v.y, v.x, v.z)).expect("exchanged");
        assert_eq!((exchanged.kind.as_str(), exchanged.mend.len()), ("velocity-unit", 1));
    }

    #[test]
    fn good_and_doubtful_velocities_are_left_alone() {
        assert!(velocities(|v| v).is_none());
        assert!(velocities(|v| 1.3 * v).is_none(), "a wind, or a poor receiver");
        assert!(velocities(|v| 2.6 * v).is_none(), "no unit");
        assert!(velocities(|_| Vector3::zeros()).is_none());
        assert!(judged(|image| image.velocity = None).is_none());
        assert!(judged(|image| image.time_s = None).is_none());
    }

    #[test]
    fn positions_of_two_sources_must_agree() {
        let feet = |image: &mut Image| image.gnss = Some(image.centre / 0.3048);
        assert!(judged(feet).is_none());
        let kilometres = |image: &mut Image| {
            image.gnss = Some(image.centre);
            image.velocity = image.velocity.map(|v| 3.6 * v);
        };
        assert!(judged(kilometres).is_some());
    }
}
