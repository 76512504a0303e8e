//! Tie points with coordinates of their own, at the orientation that came with them: both are one program's, so that
//! the points must be where its images see them.

use super::alternatives::{Alternative, alternatives};
use super::cause::{Cause, Table};
use super::compete::Found;
use super::meet::{Misfit, error};
use super::orientation::Orientation;
use super::same::same_rays;
use super::scene::Scene;
use crate::math::statistics::{median, rms};
use crate::mistakes::{BEYOND, Mistake};
use nalgebra::Vector3;

/// Tie points below which a median says nothing.
const FEWEST: usize = 10;
/// Measurements, as a share, that are looked at: programs keep false matches in their files.
const KEPT: f64 = 0.9;
/// Residuals of an adjustment beyond which nothing was adjusted rightly, px: matching is good to one.
const LARGEST_PX: f64 = 10.0;
/// How many times larger than reported residuals are another camera's or pose's: both are of the same measurements, and
/// differ by how the mean is taken and by rounding.
const TIMES: f64 = 3.0;
/// Below that, px, reported residuals say nothing: coordinates in a text have six digits.
const ROUNDING_PX: f64 = 1.0;
/// Alternatives within this factor of the best are as good.
const AS_GOOD: f64 = 2.0;

/// Poses that are read as `X_cam = R X + t`, and what is undone where they were written as something else. Of a pose
/// that is the camera's in the world, `t` is its place. Of an inverted `R` alone `t` is right, and the place that was
/// computed from both is wrong.
const POSES: [(&[Orientation], &str); 2] = [
    (
        &[Orientation::Inverse, Orientation::Translation],
        "the poses are camera to world, rotation and place of the camera",
    ),
    (
        &[Orientation::Inverse, Orientation::Translation, Orientation::Translation],
        "the rotations are camera to world, and places were computed with them",
    ),
];

/// What is wrong.
#[derive(Debug)]
pub enum Verdict {
    /// Another program's convention.
    Convention(Found),
    /// Whole poses, or nothing that is known.
    Told(Mistake),
}

/// Something that was undone.
struct Tried {
    alternative: Alternative,
    /// Of whole poses, what they are.
    says: Option<&'static str>,
    scene: Scene,
    px: f64,
}

/// Looks at how far tie points are missed; `None` where that is as it should be.
pub fn judge(scene: &Scene, places: &[Vector3<f64>], reported_px: Option<f64>) -> Option<Verdict> {
    let lengths = lengths(scene, places);
    if lengths.is_empty() || places.len() < FEWEST {
        return None;
    }
    let own = median(&lengths);
    let missed = rms(&kept(lengths));
    let reported = reported_px.filter(|px| px.is_finite() && *px > 0.0);
    let limit = reported.map_or(LARGEST_PX, |px| (TIMES * px).max(ROUNDING_PX));
    if missed <= limit {
        return None;
    }
    let tried = as_good(tried(scene, places));
    let Some((first, others)) = tried.split_first().filter(|(first, _)| own > BEYOND * first.px) else {
        return Some(Verdict::Told(unknown(missed, reported)));
    };
    if !others.iter().all(|other| same_rays(&first.scene, &other.scene)) {
        return Some(Verdict::Told(unknown(missed, reported)));
    }
    if let Some(says) = first.says {
        return Some(Verdict::Told(of_poses(says, own, first.px)));
    }
    let misfit = |px: f64| Misfit { px, angle: f64::NAN, share: f64::NAN };
    Some(Verdict::Convention(Found {
        alternative: first.alternative.clone(),
        own: misfit(own),
        undone: misfit(first.px),
        rivals: others.iter().map(|other| other.alternative.clone()).collect(),
    }))
}

/// Everything that can be undone, the most common first.
fn tried(scene: &Scene, places: &[Vector3<f64>]) -> Vec<Tried> {
    let single = alternatives(scene, Table::Ties).into_iter().map(|one| (one, None));
    let of_poses = POSES.iter().map(|(causes, says)| {
        let causes: Vec<Cause> = causes.iter().map(|one| Cause::Orientation(*one)).collect();
        (Alternative::new(&causes), Some(*says))
    });
    let undone = |(alternative, says): (Alternative, Option<&'static str>)| {
        let scene = alternative.undone(scene)?;
        let lengths = lengths(&scene, places);
        let px = if lengths.is_empty() { f64::INFINITY } else { median(&lengths) };
        Some(Tried { alternative, says, scene, px })
    };
    single.chain(of_poses).filter_map(undone).collect()
}

/// Those that are about as good as the best.
fn as_good(mut tried: Vec<Tried>) -> Vec<Tried> {
    let best = tried.iter().map(|one| one.px).fold(f64::INFINITY, f64::min);
    tried.retain(|one| one.px <= AS_GOOD * best);
    tried
}

/// Distances between measured and projected, px.
fn lengths(scene: &Scene, places: &[Vector3<f64>]) -> Vec<f64> {
    let of = |(sights, place): (&Vec<super::Sight>, &Vector3<f64>)| {
        sights.iter().map(|sight| error(scene, sight, place)).collect::<Vec<f64>>()
    };
    scene.points.iter().zip(places).flat_map(of).filter(|length| !length.is_nan()).collect()
}

/// All but the largest.
fn kept(mut lengths: Vec<f64>) -> Vec<f64> {
    lengths.sort_by(f64::total_cmp);
    lengths.truncate(((KEPT * lengths.len() as f64).ceil() as usize).max(1));
    lengths
}

fn of_poses(says: &str, own: f64, undone: f64) -> Mistake {
    let sentence = format!(
        "Approximate orientation: {says}. Once that is undone, tie points are missed by {undone:.1} px instead of \
         {own:.0} px (median)."
    );
    let remedy = "Write the poses world to camera, X_cam = R X + t, and import the files again.";
    Mistake::new("inverse-rotation", "images", sentence, remedy.into()).tested(f64::NAN, f64::NEG_INFINITY)
}

fn unknown(missed: f64, reported: Option<f64>) -> Mistake {
    let says = reported.map_or(String::new(), |px| format!("; the other program reports {px:.2} px"));
    let sentence = format!(
        "Tie points: at the camera and the poses of the files, their coordinates miss the measurements by {missed:.1} \
         px (RMS of the best {:.0} %){says}. No convention of another program that is known explains it.",
        100.0 * KEPT
    );
    let remedy = "Look at the camera (size of the images, principal point, distortion) and at the poses: were they \
                  exported together (block.toml, images.csv, points.csv)?";
    Mistake::new("reprojection", "ties", sentence, remedy.into())
        .sized(missed, None, "px")
        .tested(f64::NAN, f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::super::made;
    use super::super::meet::intersect;
    use super::*;

    fn places(scene: &Scene) -> Vec<Vector3<f64>> {
        scene.points.iter().map(|sights| intersect(scene, sights).expect("rays that meet")).collect()
    }

    #[test]
    fn right_files_are_met() {
        let scene = made::scene();
        let places = places(&scene);
        assert!(judge(&scene, &places, None).is_none());
        assert!(judge(&scene, &places, Some(0.4)).is_none());
        // As they report themselves.
        let moved: Vec<Vector3<f64>> = places.iter().map(|place| place + Vector3::new(1.0, 0.0, 0.0)).collect();
        assert!(judge(&scene, &moved, None).is_some());
        assert!(judge(&scene, &moved[..9], None).is_none(), "too few to tell");
        assert!(judge(&scene, &moved, Some(50.0)).is_none());
    }

    #[test]
    fn what_the_files_report_is_the_measure() {
        let scene = made::scene();
        let places = places(&scene);
        assert!(judge(&scene, &places, Some(0.05)).is_none(), "a pixel is rounding");
        // By two pixels from 60 m.
        let moved: Vec<Vector3<f64>> = places.iter().map(|place| place + Vector3::new(0.04, 0.0, 0.0)).collect();
        assert!(judge(&scene, &moved, None).is_none(), "less than an adjustment may leave");
        assert!(judge(&scene, &moved, Some(1.0)).is_none(), "about what is reported");
        for no_number in [f64::NAN, -1.0, 0.0] {
            assert!(judge(&scene, &moved, Some(no_number)).is_none(), "{no_number} reports nothing");
        }
        let Some(Verdict::Told(mistake)) = judge(&scene, &moved, Some(0.4)) else { panic!("nothing told") };
        assert_eq!((mistake.kind.as_str(), mistake.subject.as_str()), ("reprojection", "ties"));
        assert!(mistake.sentence.contains("the other program reports 0.40 px"), "{}", mistake.sentence);
    }

    #[test]
    fn rotations_the_wrong_way_round_are_told() {
        let mut scene = made::scene();
        let places = places(&scene);
        scene.views.iter_mut().for_each(|view| view.pose.rotation = view.pose.rotation.inverse());
        let Some(Verdict::Convention(found)) = judge(&scene, &places, None) else { panic!("no convention") };
        assert_eq!(found.alternative.causes, [Cause::Orientation(Orientation::Inverse)]);
        assert!(found.undone.px < 1.0 && found.own.px > 100.0, "{found:?}");
    }

    /// As they are written by a program, and read as `R` and `t`.
    #[test]
    fn poses_of_the_camera_in_the_world_are_told() {
        let right = made::scene();
        let places = places(&right);
        let read = |written: &dyn Fn(&crate::block::Pose) -> crate::block::Pose| {
            let mut scene = right.clone();
            // As if the coordinates were those of the file.
            scene.origin = Vector3::zeros();
            scene.views.iter_mut().for_each(|view| view.pose = written(&view.pose));
            match judge(&scene, &places, None) {
                Some(Verdict::Told(mistake)) => (mistake.kind, mistake.sentence),
                other => panic!("{other:?}"),
            }
        };
        let pose = |rotation: nalgebra::UnitQuaternion<f64>, t: Vector3<f64>| crate::block::Pose {
            rotation,
            centre: -(rotation.inverse() * t),
        };
        let (kind, sentence) = read(&|own| pose(own.rotation.inverse(), own.centre));
        assert!(kind == "inverse-rotation" && sentence.contains("rotation and place of the camera"), "{sentence}");
        let (kind, sentence) = read(&|own| pose(own.rotation.inverse(), -(own.rotation * own.centre)));
        assert!(kind == "inverse-rotation" && sentence.contains("places were computed with them"), "{sentence}");
    }

    #[test]
    fn what_no_convention_explains_is_said() {
        let mut scene = made::scene();
        let places = places(&scene);
        scene.cameras[0].interior[crate::camera::PPX] += 60.0;
        let Some(Verdict::Told(mistake)) = judge(&scene, &places, Some(0.3)) else { panic!("nothing, or more") };
        assert_eq!((mistake.kind.as_str(), mistake.subject.as_str()), ("reprojection", "ties"));
        assert!(mistake.sentence.contains("reports 0.30 px"), "{}", mistake.sentence);
        assert!((mistake.value.expect("px") - 60.0).abs() < 5.0, "{:?}", mistake.value);
    }
}
