//! Cameras that look down and lie below everything that they see.

use super::placed;
use super::tables::Tables;
use crate::block::edit::Change;
use crate::math::statistics::median;
use crate::mistakes::Mistake;
use crate::mistakes::survey::Subject;

/// Surveyed points, and cameras, below which nothing is said.
const FEWEST: usize = 3;
/// Upward part of a viewing direction that looks down: within 60 degrees of straight down. Who photographs a ceiling,
/// a cliff or a façade from below looks up or ahead.
const DOWN: f64 = -0.5;

/// All cameras below all surveyed points.
pub fn judge(tables: &Tables) -> Option<Mistake> {
    let views: Vec<f64> = tables.images.iter().map(|image| image.view.z).collect();
    let look_down = !views.is_empty() && median(&views) < DOWN;
    // In a system of their own poses have no vertical.
    let surveyed = tables.taking_part();
    if surveyed.len() < FEWEST || !look_down || !placed::poses(tables) {
        return None;
    }
    let received: Vec<f64> = tables.images.iter().filter_map(|image| Some(image.gnss?.z)).collect();
    let by_gnss = received.len() >= FEWEST;
    let cameras = if by_gnss { received } else { tables.images.iter().map(|image| image.centre.z).collect() };
    let points: Vec<f64> = surveyed.iter().map(|(point, _)| point.position.z).collect();
    let highest = cameras.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = points.iter().copied().fold(f64::INFINITY, f64::min);
    if cameras.len() < FEWEST || highest >= lowest {
        return None;
    }
    // Heights in the system of the files: a sign is one against its zero.
    let recorded = |height: &f64| height + tables.origin.z;
    let is_negative = cameras.iter().all(|height| recorded(height) < 0.0);
    let turned = cameras.iter().map(|height| -recorded(height)).fold(f64::INFINITY, f64::min);
    let above = points.iter().map(recorded).fold(f64::NEG_INFINITY, f64::max) < turned;
    let depth = median(&points) - median(&cameras);
    let found =
        if by_gnss && is_negative && above { reversed(depth) } else { offset(surveyed[0].0.subject, by_gnss, depth) };
    Some(found.tested(f64::NAN, f64::NEG_INFINITY))
}

fn reversed(depth: f64) -> Mistake {
    let sentence = format!(
        "GNSS positions: the heights have the wrong sign. They are all negative, and the cameras look down on surveyed \
         points that are {depth:.0} m higher."
    );
    let remedy = "Change the sign of gnss_z of images.csv (EXIF: GPSAltitudeRef says below sea level).";
    Mistake::new("axis-reversed", Subject::Gnss.key(), sentence, remedy.into())
        .undone_by(vec![Subject::Gnss.edit(Change::times(Subject::Gnss.columns()[2], -1.0))])
}

fn offset(subject: Subject, by_gnss: bool, depth: f64) -> Mistake {
    let who = if by_gnss { "GNSS positions" } else { "approximate positions" };
    let sentence = format!(
        "{} lie {depth:.0} m above the {who} of cameras that look down on them: heights of two systems or units, or of \
         the wrong sign.",
        subject.words()
    );
    let remedy = format!("Take both to one height system ({}; z and gnss_z of images.csv).", subject.place());
    Mistake::new("height-offset", subject.key(), sentence, remedy).sized(depth, None, "m")
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    const POINTS: [[f64; 3]; 3] = [[0.0, 0.0, 1.0], [80.0, 5.0, 2.0], [10.0, 15.0, 0.0]];

    #[test]
    fn cameras_below_their_points_are_named() {
        assert!(judge(&made::surveyed(&POINTS)).is_none());
        let found = judge(&made::surveyed(&POINTS.map(|[x, y, z]| [x, y, z + 160.0]))).expect("below");
        assert_eq!((found.kind.as_str(), found.subject.as_str(), found.mend.len()), ("height-offset", "control", 0));
        let mut reversed = made::surveyed(&POINTS);
        for image in &mut reversed.images {
            image.gnss.iter_mut().for_each(|at| at.z = -at.z);
        }
        let found = judge(&reversed).expect("below");
        assert_eq!((found.kind.as_str(), found.subject.as_str(), found.mend.len()), ("axis-reversed", "gnss", 1));
    }

    #[test]
    fn who_looks_up_may_be_below() {
        let mut tables = made::surveyed(&POINTS.map(|[x, y, z]| [x, y, z + 160.0]));
        tables.images.iter_mut().for_each(|image| image.view = -image.view);
        assert!(judge(&tables).is_none());
        // In a system of their own poses have no vertical.
        let mut tables = made::surveyed(&POINTS.map(|[x, y, z]| [x, y, z + 160.0]));
        tables.images.iter_mut().for_each(|image| image.gnss = None);
        assert!(judge(&tables).is_none());
    }
}
