//! Surveyed positions far from the cameras: another coordinate system, or latitude and longitude exchanged.

use super::placed;
use super::tables::Tables;
use crate::block::edit::{Change, Edit};
use crate::math::statistics::median;
use crate::mistakes::survey::Subject;
use crate::mistakes::{BEYOND, Mistake};
use nalgebra::Vector3;

/// Farther than that, m, no camera sees a point: aircraft fly below 15 km, and haze ends the view from the ground.
const FAR_M: f64 = 20_000.0;
/// Nearer than that, m, it may be something else: receivers in telephones are off by 100 m, national datums by 400 m.
const LEAST_M: f64 = 500.0;
/// Positions of receivers that stand for the cameras: fewer may all be wrong.
const FEWEST: usize = 3;

/// Positions of the cameras in the system of the survey.
struct Cameras {
    /// By image.
    at: Vec<Option<Vector3<f64>>>,
    /// m.
    extent: f64,
    /// Distance beyond which no surveyed point lies, m.
    limit: f64,
}

impl Cameras {
    fn new(at: Vec<Option<Vector3<f64>>>, tables: &Tables) -> Option<Self> {
        let known: Vec<Vector3<f64>> = at.iter().flatten().copied().collect();
        if known.len() < FEWEST.min(tables.images.len()).max(1) {
            return None;
        }
        let extent = placed::extent(&known);
        // Where nothing places the poses, their unit is unknown, and so is the distance of tie points.
        let reach = tables.reach.filter(|reach| reach.is_finite() && placed::poses(tables));
        let limit = reach.map_or(FAR_M, |reach| (BEYOND * (extent + reach)).clamp(LEAST_M, FAR_M));
        Some(Self { at, extent, limit })
    }

    /// By the approximate poses, where these are in the block's system.
    fn by_poses(tables: &Tables) -> Option<Self> {
        if !tables.is_local && !placed::poses(tables) {
            return None;
        }
        Self::new(tables.images.iter().map(|image| Some(image.centre)).collect(), tables)
    }

    /// By the receiver.
    fn by_gnss(tables: &Tables) -> Option<Self> {
        Self::new(tables.images.iter().map(|image| image.gnss).collect(), tables)
    }

    /// From the nearest camera of some, or of all, to a place.
    fn offset(&self, images: &[usize], place: &Vector3<f64>) -> Option<Vector3<f64>> {
        let of = |list: &mut dyn Iterator<Item = &Vector3<f64>>| {
            list.map(|at| place - at).min_by(|a, b| a.norm().total_cmp(&b.norm()))
        };
        let seeing = of(&mut images.iter().filter_map(|image| self.at.get(*image)?.as_ref()));
        seeing.or_else(|| of(&mut self.at.iter().flatten()))
    }
}

/// A recorded position beside the cameras.
struct Member {
    name: String,
    /// From the camera to the position, m.
    offset: Vector3<f64>,
    /// The position with latitude and longitude exchanged, and its distance from the camera, m.
    exchanged: Option<(Vector3<f64>, f64)>,
}

/// Groups that lie far from the cameras.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    let mut found = Vec::new();
    if let Some(poses) = Cameras::by_poses(tables) {
        found.extend(finding(Subject::Gnss, &receivers(tables, &poses), &poses, tables));
    }
    let cameras = if found.is_empty() { Cameras::by_gnss(tables) } else { None };
    let Some(cameras) = cameras.or_else(|| Cameras::by_poses(tables)) else { return found };
    let all = tables.taking_part();
    for subject in [Subject::Control, Subject::Check] {
        let points = all.iter().filter(|(point, _)| point.subject == subject);
        let member = |(point, images): &(&super::Surveyed, Vec<usize>)| {
            let distance = |place: &Vector3<f64>| Some(cameras.offset(images, place)?.norm());
            let exchanged = point.exchanged.and_then(|place| Some((place, distance(&place)?)));
            Some(Member { name: point.name.clone(), offset: cameras.offset(images, &point.position)?, exchanged })
        };
        found.extend(finding(subject, &points.filter_map(member).collect::<Vec<_>>(), &cameras, tables));
    }
    found
}

fn receivers(tables: &Tables, poses: &Cameras) -> Vec<Member> {
    let member = |(k, image): (usize, &super::Image)| {
        let distance = |place: &Vector3<f64>| Some(poses.offset(&[k], place)?.norm());
        let exchanged = image.gnss_exchanged.and_then(|place| Some((place, distance(&place)?)));
        Some(Member { name: image.name.clone(), offset: poses.offset(&[k], &image.gnss?)?, exchanged })
    };
    tables.images.iter().enumerate().filter_map(member).collect()
}

fn finding(subject: Subject, members: &[Member], cameras: &Cameras, tables: &Tables) -> Option<Mistake> {
    let offsets: Vec<f64> = members.iter().map(|member| member.offset.norm()).collect();
    let distance = median(&offsets);
    if members.is_empty() || distance.is_nan() || distance <= cameras.limit {
        return None;
    }
    let exchanged: Option<Vec<f64>> = members.iter().map(|member| Some(member.exchanged?.1)).collect();
    let near = exchanged.map(|distances| median(&distances)).filter(|distance| *distance <= cameras.limit);
    let found = match near {
        Some(near) => geographic(subject, members, [distance, near], &tables.origin),
        None => other_frame(subject, members, distance, cameras),
    };
    Some(found.sized(distance, None, "m").tested(f64::NAN, f64::NEG_INFINITY))
}

fn geographic(subject: Subject, members: &[Member], [distance, near]: [f64; 2], origin: &Vector3<f64>) -> Mistake {
    let sentence = format!(
        "{}: latitude and longitude are exchanged. They lie {} from the cameras, and {} once that is undone.",
        subject.words(),
        length(distance),
        length(near)
    );
    let remedy = format!(
        "Exchange latitude and longitude in the list of positions and import it again, or convert {}.",
        subject.place()
    );
    let column = if subject == Subject::Gnss { "image" } else { "point" };
    let edits = members.iter().flat_map(|member| {
        let place = member.exchanged.map(|(place, _)| place + origin);
        let set = move |axis: usize, place: Vector3<f64>| {
            let value = format!("{:.4}", place[axis]);
            let change = Change::Set { column: subject.columns()[axis].into(), value };
            subject.edit(change).of(column, std::slice::from_ref(&member.name))
        };
        place.into_iter().flat_map(move |place| (0..3).map(move |axis| set(axis, place)))
    });
    let edits: Vec<Edit> = edits.collect();
    Mistake::new("geographic", subject.key(), sentence, remedy).undone_by(edits)
}

fn other_frame(subject: Subject, members: &[Member], distance: f64, cameras: &Cameras) -> Mistake {
    let along =
        |of: fn(&Vector3<f64>) -> f64| median(&members.iter().map(|member| of(&member.offset)).collect::<Vec<f64>>());
    let (plan, height) = (along(|offset| offset.xy().norm()), along(|offset| offset.z));
    let sentence = format!(
        "{} are in another coordinate system than the cameras: they lie {} away in plan and {} {}, and the cameras \
         extend over {}.",
        subject.words(),
        length(plan),
        length(height.abs()),
        if height < 0.0 { "lower" } else { "higher" },
        length(cameras.extent)
    );
    let remedy = format!(
        "Look at the coordinate system that the list of positions, or its import, names ({}; {}); transform one of the \
         two.",
        length(distance),
        subject.place()
    );
    Mistake::new("other-frame", subject.key(), sentence, remedy)
}

/// A length for a person.
fn length(metres: f64) -> String {
    match metres {
        m if m >= 99_500.0 => format!("{:.0} km", m / 1e3),
        m if m >= 1000.0 => format!("{:.1} km", m / 1e3),
        m => format!("{m:.0} m"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Measured, Row, made};
    use super::*;

    const POINTS: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [80.0, 5.0, 2.0], [10.0, 15.0, 0.0], [70.0, -20.0, 3.0]];

    #[test]
    fn points_of_another_system_are_far() {
        let moved = |by: [f64; 3]| POINTS.map(|point| [0, 1, 2].map(|axis| point[axis] + by[axis]));
        assert!(judge(&made::surveyed(&POINTS)).is_empty());
        let found = judge(&made::surveyed(&moved([218_000.0, 0.0, -3700.0])));
        assert_eq!((found.len(), found[0].kind.as_str(), found[0].subject.as_str()), (1, "other-frame", "control"));
        assert!(found[0].sentence.contains("218 km away in plan and 3.7 km lower"), "{}", found[0].sentence);
        // Ten times farther than the flight is long and high: 10 * (90 + 60) m.
        assert_eq!(judge(&made::surveyed(&moved([2000.0, 0.0, 0.0]))).len(), 1);
        assert!(judge(&made::surveyed(&moved([400.0, 0.0, 0.0]))).is_empty());
    }

    #[test]
    fn points_that_no_image_marks_may_lie_anywhere() {
        let far = POINTS.map(|[x, y, z]| [x + 218_000.0, y, z]);
        let mut tables = made::surveyed(&[&POINTS[..], &far[..], &far[..]].concat());
        assert_eq!(judge(&tables).len(), 1, "most are far");
        let near: Vec<Row> = tables.marks.iter().filter(|row| row.point < POINTS.len()).collect();
        tables.marks = made::table(Measured::Marks, near);
        assert!(judge(&tables).is_empty());
        // Before any is marked the list alone tells.
        tables.marks = made::table(Measured::Marks, Vec::new());
        assert_eq!(judge(&tables).len(), 1);
    }

    #[test]
    fn positions_that_are_absent_or_no_numbers_tell_nothing() {
        let far = POINTS.map(|[x, y, z]| [x + 218_000.0, y, z]);
        let mut tables = made::surveyed(&far);
        tables.images.clear();
        assert!(judge(&tables).is_empty());
        let mut tables = made::surveyed(&POINTS);
        tables.reach = Some(f64::NAN);
        assert!(judge(&tables).is_empty());
        tables.surveyed.iter_mut().for_each(|point| point.position.x = f64::NAN);
        assert!(judge(&tables).is_empty());
        tables.surveyed.clear();
        assert!(judge(&tables).is_empty());
    }

    #[test]
    fn exchanged_latitude_and_longitude_are_told_by_where_they_lead() {
        let mut tables = made::surveyed(&POINTS);
        tables.origin = Vector3::new(1000.0, 0.0, 0.0);
        for point in &mut tables.surveyed {
            point.exchanged = Some(point.position);
            point.position += Vector3::new(3e6, 2e6, -1e6);
        }
        let found = judge(&tables);
        assert_eq!((found.len(), found[0].kind.as_str(), found[0].mend.len()), (1, "geographic", 12), "{found:?}");
        assert_eq!(found[0].mend[3].change, Change::Set { column: "x".into(), value: "1080.0000".into() });
        assert_eq!(found[0].mend[3].rows[1].values, ["g1"]);
    }

    #[test]
    fn poses_in_a_system_of_their_own_tell_nothing() {
        let mut tables = made::surveyed(&POINTS.map(|[x, y, z]| [x + 5e5, y + 5e6, z]));
        tables.images.iter_mut().for_each(|image| image.gnss = None);
        assert!(judge(&tables).is_empty());
        // East, north, up about the block: they should lie near.
        tables.is_local = true;
        assert_eq!(judge(&tables).len(), 1);
        // So should receivers.
        let mut tables = made::surveyed(&POINTS);
        tables.is_local = true;
        tables.images.iter_mut().for_each(|image| image.gnss = image.gnss.map(|at| at + Vector3::new(4e6, 0.0, 0.0)));
        let found = judge(&tables);
        assert_eq!((found.len(), found[0].subject.as_str()), (1, "gnss"), "{found:?}");
    }
}
