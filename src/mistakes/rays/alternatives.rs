//! The conventions that are tried, the most common first, as far as the numbers of a block allow them.

use super::cause::{Cause, Table};
use super::coordinates::{Coordinates, Unit};
use super::lens::{Length, Lens};
use super::orientation::Orientation;
use super::scene::Scene;
use crate::camera::{Camera, F, K1, K2, K3, PPX, PPY};

/// Conventions that are wrong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// In the order in which they are undone.
    pub causes: Vec<Cause>,
    /// Do they change the unit of coordinates? Pixels cannot be compared then.
    pub is_unit: bool,
}

impl Alternative {
    /// Of one or more causes.
    pub fn new(causes: &[Cause]) -> Self {
        Self { causes: causes.to_vec(), is_unit: false }
    }

    /// The scene without them.
    pub fn undone(&self, scene: &Scene) -> Option<Scene> {
        let mut undone = scene.clone();
        self.causes.iter().try_for_each(|cause| cause.undo(&mut undone))?;
        Some(undone)
    }
}

/// Factors between images and reduced copies of them.
const FACTORS: [f64; 10] = [2.0, 4.0, 0.5, 0.25, 4.0 / 3.0, 1.5, 3.0, 0.75, 2.0 / 3.0, 8.0];
/// Share of the sensor below which coordinates, a principal point, or a focal length are no pixels: tie points lie all
/// over the image, the principal point near its middle, and no lens sees 170 degrees without a model of its own.
const NO_PIXELS: f64 = 0.1;
/// Share of the measurements that may lie beside the sensor at either end: false matches and rounding.
const BESIDE: f64 = 0.01;
/// Share of a side by which the others may: coordinates of an undistorted image.
const MARGIN: f64 = 0.02;
/// Distance of a principal point from the centre of the sensor, as a share of a side, that cameras with a shifted
/// lens do not reach.
const OFF_CENTRE: f64 = 0.2;
/// Distortion at the corner as a share of its radius that no lens of this model has: the image would fold.
const ABSURD: f64 = 0.7;

/// Where measurements lie, as shares of the sensor's sides.
struct Reach {
    low: [f64; 2],
    high: [f64; 2],
    /// The same with the sides exchanged.
    high_across: [f64; 2],
}

impl Reach {
    fn of(scene: &Scene) -> Option<Self> {
        let quantiles = |axis: usize, side: usize| -> Option<(f64, f64)> {
            let mut shares: Vec<f64> = scene
                .sights()
                .map(|sight| sight.xy[axis] / sides(scene.camera_of(sight))[side])
                .filter(|share| share.is_finite())
                .collect();
            shares.sort_by(f64::total_cmp);
            let few = (BESIDE * shares.len() as f64) as usize;
            Some((*shares.get(few)?, *shares.iter().rev().nth(few)?))
        };
        let [x, y] = [quantiles(0, 0)?, quantiles(1, 1)?];
        let across = [quantiles(0, 1)?.1, quantiles(1, 0)?.1];
        Some(Self { low: [x.0, y.0], high: [x.1, y.1], high_across: across })
    }

    fn extent(&self) -> f64 {
        (self.high[0] - self.low[0]).max(self.high[1] - self.low[1])
    }

    fn largest(&self) -> f64 {
        self.high[0].max(self.high[1])
    }

    fn is_negative(&self) -> bool {
        self.low[0] < -MARGIN || self.low[1] < -MARGIN
    }
}

fn sides(camera: &Camera) -> [f64; 2] {
    [f64::from(camera.width_px.max(1)), f64::from(camera.height_px.max(1))]
}

/// The principal point as shares of the sides.
fn principal_point(camera: &Camera) -> [f64; 2] {
    let [width, height] = sides(camera);
    [camera.interior[PPX] / width, camera.interior[PPY] / height]
}

fn is_near_centre([x, y]: [f64; 2]) -> bool {
    (x - 0.5).abs() < OFF_CENTRE && (y - 0.5).abs() < OFF_CENTRE
}

/// All alternatives of a scene; those of the coordinates alone for marks.
pub fn alternatives(scene: &Scene, table: Table) -> Vec<Alternative> {
    let Some(reach) = Reach::of(scene) else { return Vec::new() };
    let coordinates = of_coordinates(&reach);
    let mut list: Vec<Alternative> = coordinates
        .iter()
        .map(|one| Alternative {
            causes: vec![Cause::Coordinates(*one)],
            is_unit: matches!(one, Coordinates::Millimetres { .. } | Coordinates::Normalised { .. }),
        })
        .collect();
    if table == Table::Ties {
        list.extend(of_orientations());
        list.extend(of_lenses(scene, &reach));
    }
    if reach.extent() >= NO_PIXELS && used(scene).into_iter().all(is_distorted) {
        list.push(Alternative::new(&[Cause::Coordinates(Coordinates::Undistorted)]));
    }
    list
}

fn of_coordinates(reach: &Reach) -> Vec<Coordinates> {
    if reach.extent() < NO_PIXELS {
        return of_units();
    }
    let mut list = vec![Coordinates::YUp, Coordinates::Mirrored, Coordinates::Exchanged];
    if reach.is_negative() {
        list.extend([false, true].map(|up| Coordinates::Centred { up }));
    }
    let fits = |times: &f64| reach.largest() * times <= 1.0 + MARGIN;
    let is_too_large = reach.largest() > 1.0 + MARGIN;
    // Coordinates that fit the sensor are not reduced further: tie points would lie in a corner alone.
    let scales = FACTORS.into_iter().filter(fits).filter(|times| *times > 1.0 || is_too_large);
    list.extend(scales.map(Coordinates::Scaled));
    list
}

fn of_units() -> Vec<Coordinates> {
    let mut list = Vec::new();
    for up in [false, true] {
        let by = [Unit::Focal, Unit::Sides, Unit::LongerSide];
        list.extend(by.map(|by| Coordinates::Normalised { by, up }));
        list.extend([true, false].map(|centred| Coordinates::Millimetres { centred, up }));
    }
    list
}

fn of_orientations() -> Vec<Alternative> {
    use Orientation::{Axes, Exchanged, Inverse, RealFirst, RealLast, Reversed, Translation};
    let backwards = Axes { backwards: true, quarters: 0 };
    let mut single = vec![backwards, Inverse, RealLast, Translation, RealFirst, Exchanged, Reversed(2)];
    single.extend([2, 1, 3].map(|quarters| Axes { backwards: false, quarters }));
    single.extend([2, 1, 3].map(|quarters| Axes { backwards: true, quarters }));
    single.extend([Reversed(0), Reversed(1)]);
    let mut list: Vec<Alternative> =
        single.into_iter().map(|one| Alternative::new(&[Cause::Orientation(one)])).collect();
    // Habits of whole programs: camera to world with y upwards, or quaternions of such a rotation.
    for pair in [[Inverse, backwards], [RealLast, Inverse], [RealFirst, Inverse], [RealLast, backwards]] {
        list.push(Alternative::new(&pair.map(Cause::Orientation)));
    }
    list
}

/// Cameras that took measured images.
fn used(scene: &Scene) -> Vec<&Camera> {
    let mut seen = vec![false; scene.cameras.len()];
    scene.sights().for_each(|sight| seen[scene.views[sight.view].camera] = true);
    scene.cameras.iter().zip(seen).filter(|(_, seen)| *seen).map(|(camera, _)| camera).collect()
}

fn is_distorted(camera: &Camera) -> bool {
    (K1..=K3).any(|k| camera.interior[k] != 0.0)
}

fn of_lenses(scene: &Scene, reach: &Reach) -> Vec<Alternative> {
    let used = used(scene);
    let every = |is: &dyn Fn(&Camera) -> bool| !used.is_empty() && used.iter().all(|camera| is(camera));
    let mut focal: Vec<Option<Lens>> = vec![None];
    if every(&|camera| camera.interior[F] < NO_PIXELS * 2.0 * camera.half_diagonal_px()) {
        focal.push(Some(Lens::FocalMillimetres));
    }
    let mut middle: Vec<Option<Lens>> = vec![None];
    if every(&|camera| principal_point(camera).into_iter().all(|share| share.abs() < NO_PIXELS)) {
        middle.extend([true, false].map(|centred| Some(Lens::Millimetres { centred })));
        middle.push(Some(Lens::Centred));
    }
    let mut list: Vec<Vec<Lens>> = Vec::new();
    for focal in &focal {
        for middle in &middle {
            list.push(focal.iter().chain(middle).copied().collect());
        }
    }
    if every(&is_distorted) {
        list.push(vec![Lens::Sign]);
    }
    if used.iter().any(|camera| is_absurd(camera)) {
        for length in [Length::Focal, Length::Millimetre, Length::HalfDiagonal] {
            list.push(vec![Lens::Unit(length)]);
            list.push(vec![Lens::Unit(length), Lens::Sign]);
        }
    }
    let sizes = FACTORS.into_iter().filter(|times| every(&|camera| may_be_size(camera, reach, *times)));
    list.extend(sizes.map(|times| vec![Lens::OtherSize(times)]));
    let across = reach.high_across.iter().all(|high| *high <= 1.0 + MARGIN);
    if across && every(&|camera| camera.width_px != camera.height_px) {
        list.push(vec![Lens::SidesExchanged]);
    }
    list.retain(|causes| !causes.is_empty());
    list.into_iter().map(|causes| Alternative::new(&causes.into_iter().map(Cause::Lens).collect::<Vec<_>>())).collect()
}

/// Does the distortion fold the image within the sensor?
fn is_absurd(camera: &Camera) -> bool {
    let h = camera.half_diagonal_px();
    let at_corner: f64 = [K1, K2, K3].iter().zip([2, 4, 6]).map(|(k, power)| camera.interior[*k] * h.powi(power)).sum();
    // Not a number is absurd, too.
    at_corner.is_nan() || at_corner.abs() >= ABSURD
}

/// May the numbers of a camera be those of an image of another size? The principal point then lies near the centre of
/// the image at this size alone, or measurements lie beside the sensor.
fn may_be_size(camera: &Camera, reach: &Reach, times: f64) -> bool {
    let [x, y] = principal_point(camera);
    let is_too_large = reach.largest() > 1.0 + MARGIN && reach.largest() <= times * (1.0 + MARGIN);
    let fits_sensor = is_near_centre([times * x, times * y]) && !is_near_centre([x, y]);
    is_too_large || fits_sensor
}

#[cfg(test)]
mod tests {
    use super::super::made;
    use super::*;

    fn has(list: &[Alternative], cause: Cause) -> bool {
        list.iter().any(|one| one.causes == [cause])
    }

    #[test]
    fn numbers_of_a_block_rule_alternatives_out() {
        let scene = made::scene();
        let list = alternatives(&scene, Table::Ties);
        assert!(has(&list, Cause::Coordinates(Coordinates::YUp)));
        assert!(has(&list, Cause::Orientation(Orientation::Inverse)));
        assert!(!has(&list, Cause::Coordinates(Coordinates::Centred { up: false })), "nothing is negative");
        assert!(!has(&list, Cause::Coordinates(Coordinates::Scaled(2.0))), "the sensor is filled already");
        assert!(!has(&list, Cause::Lens(Lens::FocalMillimetres)), "a focal length in pixels");
        let marks = alternatives(&scene, Table::Marks);
        assert!(marks.iter().all(|one| matches!(one.causes[..], [Cause::Coordinates(_)])));
    }

    #[test]
    fn small_coordinates_are_another_unit() {
        let mut scene = made::scene();
        scene.points.iter_mut().flatten().for_each(|sight| sight.xy = sight.xy.map(|value| value / 5e3));
        let list = alternatives(&scene, Table::Ties);
        assert!(list.iter().any(|one| one.is_unit));
        assert!(!has(&list, Cause::Coordinates(Coordinates::YUp)));
        assert!(alternatives(&Scene { points: Vec::new(), ..scene }, Table::Ties).is_empty());
    }
}
