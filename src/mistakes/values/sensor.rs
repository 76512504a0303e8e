//! Size of the sensor: sides exchanged, or the size of another resolution.

use super::extent::{self, Extent};
use super::scale;
use super::tables::{Camera, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// Share of a side within which a principal point is at a centre: half of what parts the centre of a 3:2 image from
/// that of the turned one.
const AT_CENTRE: f64 = 0.05;
/// The same where it alone decides: calibrated principal points lie within some hundredths of the centre, and a crop
/// has its own there by a chance of one in a thousand.
const PRECISELY: f64 = 0.02;
/// Fewest measurements beyond the sensor that no blunder of a matching explains.
const FEWEST: usize = 5;
/// The same as a share: blunders that leave the sensor are one in a thousand.
const SHARE: f64 = 0.005;
/// Least ratio by which both directions reach beyond the sensor.
const BEYOND: f64 = 1.003;
/// How far the ratios of the two directions may differ, relative: another resolution keeps the shape.
const SAME_SHAPE: f64 = 0.01;

/// What is wrong with a sensor's size.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Finding {
    /// Width and height are exchanged.
    Exchanged,
    /// Principal point and measurements are those of an image of this share of the size.
    Smaller(f64),
    /// Measurements reach as far as this, px.
    Larger([f64; 2]),
}

/// Is the principal point within [`AT_CENTRE`] of the centre of an image of these sides?
fn is_centred(camera: &Camera, sides: [f64; 2]) -> bool {
    is_within(AT_CENTRE, camera, sides)
}

/// The same within a share of the sides.
fn is_within(share: f64, camera: &Camera, sides: [f64; 2]) -> bool {
    (0..2).all(|axis| (camera.principal[axis] - 0.5 * sides[axis]).abs() < share * sides[axis])
}

fn finding(camera: &Camera, extent: &Extent) -> Option<Finding> {
    let [width, height] = camera.sides;
    if is_exchanged(camera, extent) {
        return Some(Finding::Exchanged);
    }
    let smaller = scale::share(camera, extent)
        .filter(|share| share.exact && is_centred(camera, [share.of * width, share.of * height]));
    if let Some(share) = smaller {
        return Some(Finding::Smaller(share.of));
    }
    let [right, below] = [extent.high[0] / width, extent.high[1] / height];
    let enough = |count: usize| count >= FEWEST && count as f64 >= SHARE * extent.count as f64;
    let same = (right / below - 1.0).abs() < SAME_SHAPE && right.min(below) > BEYOND;
    (extent.beyond.into_iter().all(enough) && extent.before == 0 && same).then_some(Finding::Larger(extent.high))
}

/// Do principal point and measurements belong to the sensor with its sides exchanged? The measurements must leave the
/// sensor as stated, or the principal point must lie precisely at the centre of the turned one: a few images may have
/// no measurement at their borders.
pub fn is_exchanged(camera: &Camera, extent: &Extent) -> bool {
    let [width, height] = camera.sides;
    let turned = is_centred(camera, [height, width]) && !is_centred(camera, camera.sides);
    let precisely = extent.count > 0 && is_within(PRECISELY, camera, [height, width]);
    let shorter = usize::from(height < width);
    let fits = extent.high[1 - shorter] <= camera.shorter() + extent::EDGE_PX;
    turned && (extent.beyond[shorter] >= FEWEST || precisely) && fits
}

/// Sizes that do not fit the measurements. `extents`: of ties and marks together.
pub fn judge(tables: &Tables, extents: &[Extent]) -> Vec<Mistake> {
    let found =
        tables.cameras.iter().zip(extents).filter_map(|(camera, extent)| Some((camera, finding(camera, extent)?)));
    found.map(|(camera, finding)| mistake(camera, finding)).collect()
}

fn mistake(camera: &Camera, finding: Finding) -> Mistake {
    let ([width, height], id) = (camera.sides, &camera.id);
    let set = |column: &str, value: f64| {
        let change = Change::Set { column: column.into(), value: format!("{value:.0}") };
        Edit::all("block.toml", change).of("id", std::slice::from_ref(id))
    };
    let (sentence, remedy, mend) = match finding {
        Finding::Exchanged => (
            format!(
                "Camera {id}: width and height of the sensor ({width} x {height} px) are exchanged; principal point \
                     and measurements belong to {height} x {width} px."
            ),
            "Exchange width_px and height_px".to_string(),
            vec![set("width_px", height), set("height_px", width)],
        ),
        Finding::Smaller(share) => (
            format!(
                "Camera {id}: the sensor has {width} x {height} px; principal point and measurements belong to an \
                     image of {share:.3} times that size."
            ),
            "Give the size of the images that were measured in (width_px, height_px)".into(),
            vec![set("width_px", share * width), set("height_px", share * height)],
        ),
        Finding::Larger([x, y]) => (
            format!(
                "Camera {id}: measurements reach {x:.1}, {y:.1} px, beyond the sensor of {width} x {height} px in both \
                     directions."
            ),
            "Look at the size of the images that were measured in (width_px, height_px), and whether focal length and \
             principal point belong to it"
                .into(),
            Vec::new(),
        ),
    };
    let size = match finding {
        Finding::Exchanged => None,
        Finding::Smaller(share) => Some(share),
        Finding::Larger([x, _]) => Some(x / width),
    };
    let found = Mistake::new("sensor-size", "camera", sentence, format!("{remedy} (block.toml)."));
    let found = found.of(vec![id.clone()]).undone_by(mend);
    match size {
        Some(size) => found.sized(size, None, "1"),
        None => found,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Row, made};
    use super::*;

    fn judged(change: impl Fn(&mut Camera), moved: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Mistake> {
        let rows = made::rows(10).into_iter().map(|row| Row { xy: moved(row.xy), ..row }).collect();
        let mut tables = made::with_rows(rows);
        change(&mut tables.cameras[0]);
        judge(&tables, &extent::of(&tables.ties, &tables))
    }

    #[test]
    fn exchanged_sides_are_those_of_the_principal_point() {
        let found = judged(|camera| camera.sides = [3000.0, 4000.0], |xy| xy);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].kind, "sensor-size");
        assert_eq!(found[0].mend[0].change, Change::Set { column: "width_px".into(), value: "4000".into() });
    }

    #[test]
    fn a_few_measurements_near_the_middle_leave_it_to_the_principal_point() {
        let turned = |camera: &mut Camera| camera.sides = [3000.0, 4000.0];
        // All within 1000 px of the middle of 4000 x 3000.
        let near = |[x, y]: [f64; 2]| [1500.0 + 0.25 * x, 1125.0 + 0.25 * y];
        assert_eq!(judged(turned, near).len(), 1);
        let off = |camera: &mut Camera| (camera.sides, camera.principal) = ([3000.0, 4000.0], [1900.0, 1590.0]);
        assert!(judged(off, near).is_empty());
    }

    #[test]
    fn a_camera_of_reduced_images_has_another_size() {
        let halve = |camera: &mut Camera| camera.principal = camera.principal.map(|value| 0.5 * value);
        let found = judged(halve, |xy| xy.map(|value| 0.5 * value));
        assert_eq!((found.len(), found[0].value), (1, Some(0.5)), "{found:?}");
        assert_eq!(found[0].mend[1].change, Change::Set { column: "height_px".into(), value: "1500".into() });
    }

    #[test]
    fn measurements_beyond_both_edges_are_of_a_larger_sensor() {
        let found = judged(|_| (), |xy| xy.map(|value| 1.02 * value));
        assert_eq!((found.len(), found[0].mend.len()), (1, 0), "{found:?}");
        // Beyond all four edges they are undistorted.
        assert!(judged(|_| (), |[x, y]| [2000.0 + 1.02 * (x - 2000.0), 1500.0 + 1.02 * (y - 1500.0)]).is_empty());
    }

    #[test]
    fn a_good_sensor_is_right() {
        assert!(judged(|_| (), |xy| xy).is_empty());
        // A crop has its principal point anywhere.
        assert!(judged(|camera| camera.principal = [1500.0, 2000.0], |xy| xy).is_empty());
    }
}
