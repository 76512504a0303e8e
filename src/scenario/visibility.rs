//! Which images see a place: a spatial lookup first, then the exact projection.

use super::terrain::GroundPlace;
use crate::block::{Image, ImageId};
use crate::camera::undistort::{monotonic_radius, undistort};
use crate::camera::{Camera, fraser};
use nalgebra::Vector3;

/// Points nearer to the sensor's edge (px) are not measured.
pub const SENSOR_MARGIN_PX: f64 = 1.0;
/// Surfaces seen under a larger angle to their normal are not matched.
pub const MAX_INCIDENCE_DEG: f64 = 75.0;

/// Cells of the lookup over the smallest footprint: finer cells have shorter lists and more of them.
const CELLS_PER_FOOTPRINT: f64 = 5.0;
/// Cells at most, whatever the footprints: as many as a corridor of thousands of images across both axes has.
const MAX_CELLS: f64 = 4e6;
/// Cells at most for each image: where images lie so far apart, finer ones are empty.
const MAX_CELLS_PER_IMAGE: f64 = 1e3;
/// Places along each edge of the sensor at which its ideal outline is taken.
const EDGE_SAMPLES: usize = 16;
/// The outline is widened by this part of itself, for what lies between the samples.
const OUTLINE_MARGIN: f64 = 0.01;

/// Exact projection into one camera, with its limits.
pub(super) struct Lens<'a> {
    camera: &'a Camera,
    /// Square of the radius (px from the centre of distortion) up to which the distortion is monotonic.
    domain2: f64,
}

impl<'a> Lens<'a> {
    pub(super) fn new(camera: &'a Camera) -> Self {
        // Ideal points can lie outside the sensor that are imaged inside; twice the sensor is beyond any lens.
        let reach = 4.0 * camera.half_diagonal_px();
        Lens { camera, domain2: monotonic_radius(&camera.interior, reach).powi(2) }
    }

    /// Image point (px) of a point in the camera frame, if it is in front, inside the domain and on the sensor with a
    /// margin (px).
    pub(super) fn image_of(&self, camera_point: Vector3<f64>, margin: f64) -> Option<[f64; 2]> {
        let [f, ppx, ppy, dcx, dcy, ..] = self.camera.interior;
        let point = fraser::project(&self.camera.interior, camera_point.into())?;
        let du = ppx + f * camera_point.x / camera_point.z - dcx;
        let dv = ppy + f * camera_point.y / camera_point.z - dcy;
        let inside = |value: f64, size: u32| value >= margin && value <= f64::from(size) - margin;
        let seen = du * du + dv * dv < self.domain2
            && inside(point[0], self.camera.width_px)
            && inside(point[1], self.camera.height_px);
        seen.then_some(point)
    }

    /// Box around the ideal points of the whole sensor as ray slopes `X/Z, Y/Z`: min x, max x, min y, max y.
    fn outline(&self) -> [f64; 4] {
        let [f, ppx, ppy, dcx, dcy, ..] = self.camera.interior;
        let [width, height] = [f64::from(self.camera.width_px), f64::from(self.camera.height_px)];
        let mut outline = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let mut widen = |[u, v]: [f64; 2]| {
            let [x, y] = [(u - ppx) / f, (v - ppy) / f];
            outline = [outline[0].min(x), outline[1].max(x), outline[2].min(y), outline[3].max(y)];
        };
        for i in 0..=EDGE_SAMPLES {
            let part = i as f64 / EDGE_SAMPLES as f64;
            for xy in [[part * width, 0.0], [part * width, height], [0.0, part * height], [width, part * height]] {
                match undistort(&self.camera.interior, xy) {
                    Some(ideal) => widen(ideal),
                    // A corner beyond the domain: nothing further than the domain is seen.
                    None => {
                        let radius = self.domain2.sqrt();
                        widen([dcx - radius, dcy - radius]);
                        widen([dcx + radius, dcy + radius]);
                    }
                }
            }
        }
        let (dx, dy) = (OUTLINE_MARGIN * (outline[1] - outline[0]), OUTLINE_MARGIN * (outline[3] - outline[2]));
        [outline[0] - dx, outline[1] + dx, outline[2] - dy, outline[3] + dy]
    }
}

/// All images, ready to be asked which of them see a place.
pub(super) struct Viewer<'a> {
    images: &'a [Image],
    lenses: Vec<Lens<'a>>,
    grid: Grid,
    min_cosine: f64,
}

impl<'a> Viewer<'a> {
    /// For places whose heights lie in `height_range` (m).
    pub(super) fn new(cameras: &'a [Camera], images: &'a [Image], height_range: [f64; 2]) -> Self {
        let lenses: Vec<_> = cameras.iter().map(Lens::new).collect();
        let outlines: Vec<_> = lenses.iter().map(Lens::outline).collect();
        let boxes: Vec<_> =
            images.iter().map(|image| footprint_box(image, &outlines[image.camera.index()], height_range)).collect();
        Viewer { images, lenses, grid: Grid::new(&boxes), min_cosine: MAX_INCIDENCE_DEG.to_radians().cos() }
    }

    /// The images that see the place, in their order, with the exact image points (px).
    pub(super) fn seen_by(&self, place: &GroundPlace) -> Vec<(ImageId, [f64; 2])> {
        let mut seen = Vec::new();
        for &index in self.grid.near(place.position.x, place.position.y) {
            let image = &self.images[index as usize];
            let to_camera = image.pose.centre - place.position;
            if to_camera.dot(&place.normal) < self.min_cosine * to_camera.norm() {
                continue;
            }
            let camera_point = image.pose.cam_from_world(&place.position);
            if let Some(point) = self.lenses[image.camera.index()].image_of(camera_point, SENSOR_MARGIN_PX) {
                seen.push((ImageId(index), point));
            }
        }
        seen
    }
}

/// Box `[min x, max x, min y, max y]` (m) of all places between two heights that an image can see; `None` where the
/// view reaches the horizon.
///
/// The part of a viewing pyramid between two planes is convex, and its corners lie on the pyramid's edges.
fn footprint_box(image: &Image, outline: &[f64; 4], height_range: [f64; 2]) -> Option<[f64; 4]> {
    let centre = image.pose.centre;
    let to_world = image.pose.rotation.inverse();
    let mut bounds = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    for x in [outline[0], outline[1]] {
        for y in [outline[2], outline[3]] {
            let ray = to_world * Vector3::new(x, y, 1.0);
            for height in height_range {
                let scale = (height - centre.z) / ray.z;
                if ray.z >= 0.0 || !scale.is_finite() || scale <= 0.0 {
                    return None;
                }
                let place = centre + ray * scale;
                bounds =
                    [bounds[0].min(place.x), bounds[1].max(place.x), bounds[2].min(place.y), bounds[3].max(place.y)];
            }
        }
    }
    Some(bounds)
}

/// Square cells over the ground, each with the images whose footprint box touches it.
struct Grid {
    origin: [f64; 2],
    cell: f64,
    size: [usize; 2],
    cells: Vec<Vec<u32>>,
    /// Images without a box: they are candidates everywhere.
    everywhere: Vec<u32>,
}

impl Grid {
    fn new(boxes: &[Option<[f64; 4]>]) -> Self {
        let known = || boxes.iter().flatten();
        let everywhere: Vec<u32> =
            boxes.iter().zip(0..).filter(|(bounds, _)| bounds.is_none()).map(|(_, i)| i).collect();
        if known().next().is_none() {
            return Grid { origin: [0.0; 2], cell: 1.0, size: [0, 0], cells: Vec::new(), everywhere };
        }
        let low = |axis: usize| known().map(|b| b[2 * axis]).fold(f64::INFINITY, f64::min);
        let high = |axis: usize| known().map(|b| b[2 * axis + 1]).fold(f64::NEG_INFINITY, f64::max);
        let (origin, end) = ([low(0), low(1)], [high(0), high(1)]);
        let (width, height) = (end[0] - origin[0], end[1] - origin[1]);
        let smallest = known().map(|b| (b[1] - b[0]).min(b[3] - b[2])).fold(f64::INFINITY, f64::min);
        let most = MAX_CELLS.min(MAX_CELLS_PER_IMAGE * known().count() as f64);
        // A long and narrow area has one row of cells: its length bounds their number, not its size.
        let least = (width * height / most).sqrt().max(width.max(height) / most);
        let cell = (smallest / CELLS_PER_FOOTPRINT).max(least).max(f64::MIN_POSITIVE);
        let number = |value: f64, axis: usize| ((value - origin[axis]) / cell) as usize;
        let size = [number(end[0], 0) + 1, number(end[1], 1) + 1];
        let mut cells = vec![everywhere.clone(); size[0] * size[1]];
        for (bounds, image) in boxes.iter().zip(0..) {
            let Some(b) = bounds else { continue };
            for row in number(b[2], 1)..=number(b[3], 1) {
                for column in number(b[0], 0)..=number(b[1], 0) {
                    cells[row * size[0] + column].push(image);
                }
            }
        }
        cells.iter_mut().for_each(|cell| cell.sort_unstable());
        Grid { origin, cell, size, cells, everywhere }
    }

    /// Candidates for a place, in their order.
    fn near(&self, x: f64, y: f64) -> &[u32] {
        let (column, row) = ((x - self.origin[0]) / self.cell, (y - self.origin[1]) / self.cell);
        if column < 0.0 || row < 0.0 || column >= self.size[0] as f64 || row >= self.size[1] as f64 {
            return &self.everywhere;
        }
        &self.cells[row as usize * self.size[0] + column as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Scenario, flight, preset_names, terrain::Ground};
    use super::*;
    use crate::scenario::random::{Table, stream};
    use std::collections::BTreeMap;

    #[test]
    fn cells_are_as_many_as_the_images_are_worth_on_a_line_too() {
        for length in [1e3, 1e12, 1e100] {
            let boxes = [Some([0.0, 1.0, 0.0, 1.0]), Some([length, length + 1.0, 0.0, 1.0])];
            let cells = Grid::new(&boxes).cells.len() as f64;
            assert!(cells <= 3.0 * MAX_CELLS_PER_IMAGE * boxes.len() as f64 + 1.0, "{length:e} m: {cells} cells");
        }
    }

    /// The lookup must lose nothing: it is held against every image of every preset.
    #[test]
    fn lookup_finds_what_asking_every_image_finds() {
        for preset in preset_names() {
            let scenario = Scenario::preset(preset, &BTreeMap::new()).unwrap();
            let cameras: Vec<Camera> = scenario.cameras.iter().map(Camera::from).collect();
            let images = flight::fly(&scenario, 5).images;
            let ground = Ground::new(&scenario.terrain, 5);
            let viewer = Viewer::new(&cameras, &images, ground.height_range());
            let mut everything = Viewer::new(&cameras, &images, ground.height_range());
            everything.grid = Grid::new(&vec![None; images.len()]);
            let mut total = 0;
            for index in 0..300 {
                let place = ground.draw(&mut stream(5, Table::Tie, index), true);
                let seen = viewer.seen_by(&place);
                assert_eq!(seen, everything.seen_by(&place), "{preset}");
                total += seen.len();
            }
            assert!(total > 600, "{preset}: {total}");
        }
    }
}
