//! What is in a block, counted: for people who look at it before adjusting.

use super::{Block, ImageId, Role};
use crate::camera::undistort::undistort;
use crate::math::intersect::intersect_rays;
use crate::math::statistics::median;
use nalgebra::Vector3;

/// One flight.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightInventory {
    /// Name.
    pub name: String,
    /// Number of images.
    pub images: usize,
    /// Number of tie-point measurements.
    pub tie_measurements: usize,
    /// From first to last exposure, s; `None` where fewer than two times are known.
    pub span_s: Option<f64>,
    /// Median size of a pixel on the object at the tie points, `Z / f` at the approximations, m; `None` without tie
    /// points.
    pub gsd_m: Option<f64>,
}

/// Points of one kind and their image measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointInventory {
    /// Number of points.
    pub points: usize,
    /// Points without any measurement.
    pub unmeasured: usize,
    /// Number of image measurements.
    pub measurements: usize,
}

/// What is in a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Inventory {
    /// In the block's order.
    pub flights: Vec<FlightInventory>,
    /// Optional columns of `images.csv`: name, and the number of images that have a value.
    pub columns: Vec<(&'static str, usize)>,
    /// Tie points.
    pub ties: PointInventory,
    /// Tie points that have approximate coordinates.
    pub positions: usize,
    /// Entry `m`: number of tie points that `m` images see.
    pub multiplicity: Vec<usize>,
    /// Control points.
    pub control: PointInventory,
    /// Check points.
    pub check: PointInventory,
}

impl Inventory {
    /// Counts.
    pub fn of(block: &Block) -> Self {
        let mut images_of_point = vec![0; block.tie_points.len()];
        let mut ties_of_flight = vec![0; block.flights.len()];
        for tie in &block.ties {
            images_of_point[tie.point.index()] += 1;
            ties_of_flight[block.images[tie.image.index()].flight.index()] += 1;
        }
        let mut marks_of_point = vec![0; block.surveyed.len()];
        block.marks.iter().for_each(|mark| marks_of_point[mark.point.index()] += 1);
        let marks_of = |role: Role| -> Vec<usize> {
            let points = block.surveyed.iter().zip(&marks_of_point);
            points.filter(|(point, _)| point.role == role).map(|(_, n)| *n).collect()
        };
        let mut multiplicity = vec![0; images_of_point.iter().max().map_or(0, |most| most + 1)];
        images_of_point.iter().for_each(|m| multiplicity[*m] += 1);
        let mut gsd = pixel_sizes(block);
        let flight = |(k, name): (usize, &String)| {
            let images = || block.images.iter().filter(|image| image.flight.index() == k);
            FlightInventory {
                name: name.clone(),
                images: images().count(),
                tie_measurements: ties_of_flight[k],
                span_s: span(images().filter_map(|image| image.time_s)),
                gsd_m: Some(std::mem::take(&mut gsd[k])).filter(|sizes| !sizes.is_empty()).map(|sizes| median(&sizes)),
            }
        };
        Self {
            flights: block.flights.iter().enumerate().map(flight).collect(),
            columns: columns(block),
            ties: points(&images_of_point),
            positions: block.tie_points.iter().filter(|point| point.position.is_some()).count(),
            multiplicity,
            control: points(&marks_of(Role::Control)),
            check: points(&marks_of(Role::Check)),
        }
    }

    /// Mean number of images that see a tie point; `None` without tie points.
    pub fn mean_multiplicity(&self) -> Option<f64> {
        (self.ties.points > 0).then(|| self.ties.measurements as f64 / self.ties.points as f64)
    }
}

fn points(measurements: &[usize]) -> PointInventory {
    PointInventory {
        points: measurements.len(),
        unmeasured: measurements.iter().filter(|n| **n == 0).count(),
        measurements: measurements.iter().sum(),
    }
}

/// From least to greatest of two values or more.
fn span(times: impl Iterator<Item = f64>) -> Option<f64> {
    let times: Vec<f64> = times.collect();
    let least = times.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (times.len() > 1).then_some(greatest - least)
}

fn columns(block: &Block) -> Vec<(&'static str, usize)> {
    let count = |has: &dyn Fn(&super::Image) -> bool| block.images.iter().filter(|image| has(image)).count();
    vec![
        ("time_s", count(&|image| image.time_s.is_some())),
        ("temperature_c", count(&|image| image.temperature_c.is_some())),
        ("gnss_x, gnss_y, gnss_z", count(&|image| image.gnss.is_some())),
        ("gnss_sigma_xy", count(&|image| image.gnss.is_some_and(|gnss| gnss.sigma_xy.is_some()))),
        ("gnss_sigma_z", count(&|image| image.gnss.is_some_and(|gnss| gnss.sigma_z.is_some()))),
        ("vx, vy, vz", count(&|image| image.velocity.is_some())),
        ("wx, wy, wz", count(&|image| image.angular_velocity.is_some())),
        ("exposure_s", count(&|image| image.exposure_s.is_some())),
        ("focus_m", count(&|image| image.focus_m.is_some())),
    ]
}

/// Per flight: size of a pixel on the object at every tie-point measurement, m.
fn pixel_sizes(block: &Block) -> Vec<Vec<f64>> {
    let positions = approximate_positions(block);
    let mut sizes = vec![Vec::new(); block.flights.len()];
    for tie in &block.ties {
        let image = &block.images[tie.image.index()];
        let Some(position) = positions[tie.point.index()] else { continue };
        let depth = image.pose.cam_from_world(&position).z;
        if depth > 0.0 {
            let [focal_px, ..] = block.camera_of(tie.image).interior;
            sizes[image.flight.index()].push(depth / focal_px);
        }
    }
    sizes
}

/// Of each tie point, as given or intersected at the approximate orientation.
fn approximate_positions(block: &Block) -> Vec<Option<Vector3<f64>>> {
    let mut rays = vec![Rays::default(); block.tie_points.len()];
    for tie in block.ties.iter().filter(|tie| block.tie_points[tie.point.index()].position.is_none()) {
        if let Some(direction) = ray(block, tie.image, [tie.x, tie.y]) {
            rays[tie.point.index()].origins.push(block.images[tie.image.index()].pose.centre);
            rays[tie.point.index()].directions.push(direction);
        }
    }
    let points = block.tie_points.iter().zip(&rays);
    points.map(|(point, rays)| point.position.or_else(|| intersect_rays(&rays.origins, &rays.directions))).collect()
}

#[derive(Clone, Default)]
struct Rays {
    origins: Vec<Vector3<f64>>,
    directions: Vec<Vector3<f64>>,
}

/// Direction (world axes, unit length) in which an image sees an image point.
fn ray(block: &Block, image: ImageId, xy: [f64; 2]) -> Option<Vector3<f64>> {
    let interior = &block.camera_of(image).interior;
    let [f, ppx, ppy, ..] = *interior;
    let [u, v] = undistort(interior, xy)?;
    let direction = Vector3::new((u - ppx) / f, (v - ppy) / f, 1.0).normalize();
    Some(block.images[image.index()].pose.rotation.inverse() * direction)
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::UnitQuaternion;

    /// Three images in two flights look down from 50 m (two) and 30 m on two tie points at height zero; f = 1000 px.
    fn block(with_positions: bool) -> Block {
        let camera = Camera {
            id: "cam".into(),
            width_px: 1000,
            height_px: 1000,
            pixel_um: None,
            interior: [1000.0, 500.0, 500.0, 500.0, 500.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        };
        // Half a turn about x: the camera looks down, its y axis points south.
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let image = |name: &str, flight: u32, time_s, centre| Image {
            time_s,
            ..Image::new(name, CameraId(0), FlightId(flight), Pose { rotation, centre })
        };
        let images = vec![
            image("a", 0, Some(2.0), Vector3::new(0.0, 0.0, 50.0)),
            image("b", 0, Some(5.5), Vector3::new(10.0, 0.0, 50.0)),
            image("c", 1, None, Vector3::new(5.0, 0.0, 30.0)),
        ];
        let points = [Vector3::new(3.0, 1.0, 0.0), Vector3::new(6.0, -2.0, 0.0)];
        let see = |image: usize, point: usize| {
            let [x, y, z] = images[image].pose.cam_from_world(&points[point]).into();
            let xy = [500.0 + 1000.0 * x / z, 500.0 + 1000.0 * y / z];
            Measurement { image: image.into(), point: point.into(), x: xy[0], y: xy[1], sigma: None }
        };
        let ties = vec![see(0, 0), see(1, 0), see(2, 0), see(0, 1), see(1, 1)];
        let surveyed = |name: &str, role| SurveyedPoint {
            name: name.into(),
            position: Vector3::zeros(),
            role,
            sigma_xy: None,
            sigma_z: None,
        };
        Block {
            name: "small".into(),
            crs: "local".into(),
            survey_crs: String::new(),
            sigma: Sigma {
                tie_px: 0.5,
                mark_px: 0.5,
                control_xy_m: 0.01,
                control_z_m: 0.01,
                gnss_xy_m: 0.03,
                gnss_z_m: 0.05,
            },
            cameras: vec![camera],
            flights: vec!["high".into(), "low".into()],
            tie_points: points
                .map(|p| TiePoint { name: p.x.to_string(), position: with_positions.then_some(p) })
                .into(),
            marks: vec![Measurement { point: PointId(1), ..ties[0] }],
            ties,
            images,
            surveyed: vec![surveyed("c1", Role::Control), surveyed("k1", Role::Check), surveyed("c2", Role::Control)],
            origin: nalgebra::Vector3::zeros(),
            extra_image_columns: Vec::new(),
        }
    }

    #[test]
    fn counts_of_a_small_block() {
        let inventory = Inventory::of(&block(true));
        let [high, low] = &inventory.flights[..] else { panic!("two flights") };
        assert_eq!((high.images, high.tie_measurements, high.span_s), (2, 4, Some(3.5)));
        assert_eq!((low.images, low.tie_measurements, low.span_s), (1, 1, None));
        assert_eq!(inventory.multiplicity, [0, 0, 1, 1]);
        assert_eq!(inventory.mean_multiplicity(), Some(2.5));
        assert_eq!(inventory.control, PointInventory { points: 2, unmeasured: 2, measurements: 0 });
        assert_eq!(inventory.check, PointInventory { points: 1, unmeasured: 0, measurements: 1 });
        assert_eq!((inventory.columns[0], inventory.columns[1]), (("time_s", 2), ("temperature_c", 0)));
    }

    #[test]
    fn pixel_size_is_height_by_focal_length_with_given_or_intersected_points() {
        for with_positions in [true, false] {
            let inventory = Inventory::of(&block(with_positions));
            assert_eq!(inventory.positions, if with_positions { 2 } else { 0 });
            assert_relative_eq!(inventory.flights[0].gsd_m.unwrap(), 0.05, max_relative = 1e-9);
            assert_relative_eq!(inventory.flights[1].gsd_m.unwrap(), 0.03, max_relative = 1e-9);
        }
    }
}
