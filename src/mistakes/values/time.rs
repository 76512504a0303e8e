//! Exposure times: identical, in another unit, or not in the order of the flight.

use super::flights::{self, Place, Source};
use super::tables::Tables;
use crate::block::edit::{Change, Edit};
use crate::math::statistics::{mad, median};
use crate::mistakes::Mistake;

/// Images of one camera that cannot be exposed at one instant; a pair may share a second.
const MANY: usize = 10;
/// Fewest legs of a path that a speed or an order is judged by.
const LEGS: usize = 10;
/// Units that times are given in instead of seconds, s: milliseconds and microseconds.
const UNITS: [(f64, &str); 2] = [(1e-3, "milliseconds"), (1e-6, "microseconds")];
/// How far, relative, a speed may differ from the stated velocity once the unit is right.
const SAME_SPEED: f64 = 0.2;
/// A flight is not slower than this, m/s; a person who takes pictures of a facade is at 0.05.
const SLOWEST: f64 = 0.02;
/// Distance between images from which they are no close range, m.
const SPACING_M: f64 = 3.0;
/// Speeds of platforms, m/s: what the right unit must give.
const SPEEDS: [f64; 2] = [0.5, 150.0];
/// Spread of the intervals as a share of their median, by which a flight is known from a tripod that is carried.
const REGULAR: f64 = 0.3;
/// Least ratio of the path's lengths in the order of time and in that of the file. A survey flies no path that another
/// order shortens so; times that were shuffled give three to seven.
const DETOUR: f64 = 3.0;

/// Mistakes in the times of a block.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    let same = identical(tables);
    if !same.is_empty() {
        return same;
    }
    let paths = flights::paths(tables, flights::source(tables));
    unit(&paths).into_iter().chain(order(tables)).collect()
}

/// Cameras of which all images have one time.
fn identical(tables: &Tables) -> Vec<Mistake> {
    let is_one = |camera: &usize| {
        let own = || tables.images.iter().filter(|image| image.camera == *camera);
        let times: Vec<f64> = own().filter_map(|image| image.time_s).collect();
        let moved = own().any(|image| own().next().is_some_and(|first| image.centre != first.centre));
        times.len() >= MANY && times.windows(2).all(|pair| pair[0] == pair[1]) && moved
    };
    let cameras: Vec<usize> = (0..tables.cameras.len()).filter(is_one).collect();
    if cameras.is_empty() {
        return Vec::new();
    }
    let all = cameras.len() == tables.cameras.len();
    let images = tables.images_of(&cameras);
    let time = tables.images.iter().find_map(|image| image.time_s.filter(|_| cameras.contains(&image.camera)));
    let sentence = format!(
        "Images: {} exposures have the same time ({} s); one camera takes one image at a time.",
        images.len(),
        time.unwrap_or(f64::NAN)
    );
    let remedy = "Give the exposure times, or leave the cells empty (time_s of images.csv).";
    let clear = Edit::all("images.csv", Change::Clear { columns: vec!["time_s".into()] });
    let names = if all { Vec::new() } else { images };
    let clear = if all { clear } else { clear.of("image", &names) };
    vec![Mistake::new("time", "images", sentence, remedy.into()).of(names).undone_by(vec![clear])]
}

/// Times in another unit than seconds.
fn unit(paths: &[Vec<Place>]) -> Option<Mistake> {
    let legs: Vec<[Place; 2]> = paths
        .iter()
        .flat_map(|path| flights::by_time(path).windows(2).map(|pair| [pair[0], pair[1]]).collect::<Vec<_>>())
        .filter(|[a, b]| b.time > a.time)
        .collect();
    if legs.len() < LEGS {
        return None;
    }
    let steps: Vec<f64> = legs.iter().map(|[a, b]| (b.position - a.position).norm()).collect();
    let intervals: Vec<f64> = legs.iter().map(|[a, b]| b.time - a.time).collect();
    let speed = median(&steps.iter().zip(&intervals).map(|(step, interval)| step / interval).collect::<Vec<_>>());
    let stated: Vec<f64> = legs.iter().filter_map(|[a, _]| Some(a.velocity?.norm())).filter(|v| *v > 0.0).collect();
    let fits = |seconds: f64| {
        let right = speed / seconds;
        if stated.len() >= LEGS {
            return (right / median(&stated) - 1.0).abs() < SAME_SPEED && (SPEEDS[0]..=SPEEDS[1]).contains(&right);
        }
        let regular = mad(&intervals) < REGULAR * median(&intervals);
        speed < SLOWEST && median(&steps) > SPACING_M && regular && (SPEEDS[0]..=SPEEDS[1]).contains(&right)
    };
    let (seconds, words) = UNITS.into_iter().find(|(seconds, _)| fits(*seconds))?;
    let sentence = format!(
        "Images: the times are in {words}; in seconds the camera would move at {speed:.2e} m/s, in {words} at {:.1} \
         m/s.",
        speed / seconds
    );
    let remedy = "Convert them to seconds (time_s of images.csv).";
    let mend = vec![Edit::all("images.csv", Change::times("time_s", seconds))];
    let found = Mistake::new("time", "images", sentence, remedy.into());
    Some(found.sized(1.0 / seconds, None, "1").undone_by(mend))
}

/// Times that send the camera to and fro where the order of the file is a path.
fn order(tables: &Tables) -> Option<Mistake> {
    let worst = |source: Source| {
        let ratios = flights::paths(tables, source).into_iter().filter_map(|path| {
            let sorted = flights::by_time(&path);
            let distinct = sorted.windows(2).all(|pair| pair[0].time < pair[1].time);
            let ratio = flights::length(&sorted) / flights::length(&path);
            (path.len() > LEGS && distinct && ratio > DETOUR && ratio.is_finite()).then_some(ratio)
        });
        ratios.max_by(f64::total_cmp)
    };
    // Approximate positions may be sorted by hand; those of the receiver stand beside their times.
    let ratio = worst(flights::source(tables))?;
    worst(Source::Approximate)?;
    let sentence = format!(
        "Images: the times are not in the order of the flight. In the order of time the path is {ratio:.0} times as \
         long as in that of images.csv."
    );
    let remedy = "Pair images and times again (time_s of images.csv).";
    Some(Mistake::new("time", "images", sentence, remedy.into()).sized(ratio, None, "1"))
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Image, made};
    use super::*;

    fn judged(change: impl Fn(usize, &mut Image)) -> Vec<Mistake> {
        let mut tables = made::with_images(made::images(40));
        tables.images.iter_mut().enumerate().for_each(|(k, image)| change(k, image));
        judge(&tables)
    }

    #[test]
    fn one_time_for_all() {
        let found = judged(|_, image| image.time_s = Some(12.0));
        assert_eq!((found.len(), found[0].names.len(), found[0].mend.len()), (1, 0, 1), "{found:?}");
        assert!(found[0].sentence.contains("same time"));
        // A tripod stays where it is.
        let still = judged(|_, image| (image.time_s, image.centre) = (Some(12.0), nalgebra::Vector3::zeros()));
        assert!(still.is_empty());
    }

    #[test]
    fn milliseconds_with_and_without_velocities() {
        let milliseconds = |image: &mut Image| image.time_s = image.time_s.map(|time| 1e3 * time);
        let with = judged(|_, image| milliseconds(image));
        assert_eq!((with.len(), with[0].value), (1, Some(1e3)), "{with:?}");
        assert_eq!(with[0].mend[0].change, Change::times("time_s", 1e-3));
        let without = judged(|_, image| {
            milliseconds(image);
            image.velocity = None;
        });
        assert_eq!((without.len(), without[0].value), (1, Some(1e3)), "{without:?}");
    }

    #[test]
    fn times_that_jump_to_and_fro() {
        let found = judged(|k, image| image.time_s = Some((17 * k % 41) as f64));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].sentence.contains("order"), "{}", found[0].sentence);
    }

    #[test]
    fn good_times_are_right() {
        assert!(judged(|_, _| ()).is_empty());
        assert!(judged(|_, image| image.time_s = None).is_empty());
        // A person at a facade: a metre in twenty seconds.
        assert!(
            judged(|k, image| {
                image.centre.x = k as f64;
                image.time_s = Some(20.0 * k as f64);
                image.velocity = None;
            })
            .is_empty()
        );
        // Back to front.
        assert!(judged(|k, image| image.time_s = Some(-2.0 * k as f64)).is_empty());
    }
}
