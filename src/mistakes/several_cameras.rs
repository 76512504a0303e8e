//! Two cameras under one name: the focal lengths or principal points of single images form two groups.

use super::Mistake;
use super::parts::{Test, apart, divided, tested};
use crate::block::edit::{Change, Edit};
use nalgebra::Matrix2;
use std::collections::BTreeMap;

/// Images of each camera at least: the median distance of fewer from their own middle says little of how far they
/// spread.
const FEWEST: usize = 5;
/// And at least this share of the images: fewer are single images with a mistake of their own.
pub const FEWEST_SHARE: f64 = 0.1;
/// Principal points of two cameras differ by more than this, px; those of one camera by less.
pub const POINTS_APART_PX: f64 = 10.0;
/// Focal lengths of two cameras differ by more than this, px: an autofocus reaches it (the range of `focal-image`).
pub const FOCALS_APART_PX: f64 = 20.0;

/// Quantity that is estimated for each image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Own {
    /// Its principal point.
    PrincipalPoint,
    /// Its focal length; the second coordinate is zero.
    FocalLength,
}

/// Images under the name of one camera.
pub struct Images<'a> {
    /// The name.
    pub camera: &'a str,
    /// Names of all cameras.
    pub cameras: Vec<&'a str>,
    /// Images whose value is known.
    pub names: Vec<&'a str>,
    /// Values of these, px.
    pub values: Vec<[f64; 2]>,
    /// Their covariances, up to a common factor.
    pub covariances: Vec<Matrix2<f64>>,
    /// Are these all images of the camera?
    pub are_all: bool,
    /// Flights of the images whose value antenna positions tell; empty where these take no part.
    pub flights: Vec<usize>,
}

impl Images<'_> {
    /// Does each of several flights lie in one part? Heights of a flight's antennas that are off look the same.
    fn divides_by_flight(&self, second: &[bool]) -> bool {
        let mut part_of: BTreeMap<usize, bool> = BTreeMap::new();
        let is_whole = |(flight, part): (&usize, &bool)| *part_of.entry(*flight).or_insert(*part) == *part;
        let all_whole = self.flights.iter().zip(second).all(is_whole);
        all_whole && part_of.len() > 1
    }
}

/// Two cameras under one name, at a level `alpha`.
pub fn judge(images: &Images<'_>, own: Own, alpha: f64) -> Option<Mistake> {
    let (least, dimensions) = match own {
        Own::PrincipalPoint => (POINTS_APART_PX, 2),
        Own::FocalLength => (FOCALS_APART_PX, 1),
    };
    let second = divided(&images.values, least)?;
    if images.divides_by_flight(&second) {
        return None;
    }
    let test = tested(&images.values, &images.covariances, &second, dimensions)?;
    // The part that is named is the smaller one.
    let part = images.names.iter().zip(&second).filter(|(_, second)| **second);
    let names: Vec<String> = part.map(|(name, _)| (*name).to_owned()).collect();
    let is_enough = names.len() >= FEWEST && names.len() as f64 >= FEWEST_SHARE * images.names.len() as f64;
    let is_two = is_enough && test.ln_p < alpha.ln();
    is_two.then(|| said(images, own, names, apart(&images.values, &second), &test))
}

fn said(images: &Images<'_>, own: Own, names: Vec<String>, [dx, dy]: [f64; 2], test: &Test) -> Mistake {
    let (camera, count) = (images.camera, names.len());
    let sentence = match own {
        Own::PrincipalPoint => format!(
            "The images of camera {camera} have two principal points: that of {count} images lies {:.1}, {:.1} px (x, \
             y) beside that of the others. These are two cameras under one name, or the lens was moved between the \
             images.",
            -dx, -dy
        ),
        Own::FocalLength => format!(
            "The images of camera {camera} have two focal lengths: that of {count} images is {:.1} px {} than that of \
             the others. These are two cameras under one name, or the focus was changed between the images.",
            dx.abs(),
            if dx > 0.0 { "longer" } else { "shorter" }
        ),
    };
    let remedy = "Give these images their own camera (camera of images.csv, [[camera]] of block.toml).".into();
    let edits = if images.are_all { second_camera(images, &names) } else { Vec::new() };
    let found = Mistake::new("several-cameras", "camera", sentence, remedy).of(names).undone_by(edits);
    found.tested(test.drop, test.ln_p).sized(dx.hypot(dy), Some(test.sigma), "px")
}

/// The camera once more, under a free name, for these images.
fn second_camera(images: &Images<'_>, names: &[String]) -> Vec<Edit> {
    let free = (2..).map(|k| format!("{}-{k}", images.camera)).find(|id| !images.cameras.contains(&id.as_str()));
    let Some(id) = free else { return Vec::new() };
    let set = Change::Set { column: "camera".into(), value: id.clone() };
    vec![
        Edit::all("block.toml", Change::Copy { id }).of("id", &[images.camera.to_owned()]),
        Edit::all("images.csv", set).of("image", names),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 12] = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"];

    fn judged(focal: impl Fn(usize) -> f64, are_all: bool) -> Option<Mistake> {
        in_flights(focal, are_all, vec![0; NAMES.len()])
    }

    fn in_flights(focal: impl Fn(usize) -> f64, are_all: bool, flights: Vec<usize>) -> Option<Mistake> {
        let images = Images {
            camera: "cam",
            cameras: vec!["cam", "cam-2"],
            names: NAMES.to_vec(),
            values: (0..NAMES.len()).map(|k| [focal(k), 0.0]).collect(),
            covariances: vec![Matrix2::identity(); NAMES.len()],
            are_all,
            flights,
        };
        judge(&images, Own::FocalLength, 1e-3)
    }

    fn hunting(k: usize) -> f64 {
        (2.3 * (k * k) as f64).sin()
    }

    #[test]
    fn two_focal_lengths_are_two_cameras() {
        let two = |k: usize| hunting(k) + if k >= 7 { 90.0 } else { 0.0 };
        let found = judged(two, true).expect("two cameras");
        assert_eq!(
            (&*found.kind, &*found.subject, &found.names[..]),
            ("several-cameras", "camera", &NAMES.map(String::from)[7..])
        );
        assert!((found.value.expect("px") - 90.0).abs() < 2.0 && found.sentence.contains("longer"), "{found:?}");
        let [copy, set] = &found.mend[..] else { panic!("{found:?}") };
        assert_eq!(copy.change, Change::Copy { id: "cam-3".into() }, "an id that no camera has");
        assert_eq!(set.rows[0].values, found.names);
        assert!(judged(two, false).expect("two cameras").mend.is_empty(), "some images are not known");
    }

    #[test]
    fn a_flight_with_heights_of_its_own_is_no_second_camera() {
        let two = |k: usize| hunting(k) + if k >= 7 { 90.0 } else { 0.0 };
        let flights = |first: usize| (0..NAMES.len()).map(|k| usize::from(k >= first)).collect();
        assert!(in_flights(two, true, flights(7)).is_none());
        assert!(in_flights(two, true, flights(5)).is_some(), "the second flight has both");
    }

    #[test]
    fn hunting_refocused_and_single_images_are_one_camera() {
        assert!(judged(|k| 40.0 * hunting(k), true).is_none());
        assert!(judged(|k| hunting(k) + if k >= 7 { 15.0 } else { 0.0 }, true).is_none(), "an autofocus");
        assert!(judged(|k| hunting(k) + if k >= 9 { 90.0 } else { 0.0 }, true).is_none(), "three images");
    }
}
