//! A small block made by hand, and what most tests ask of it.

use misclosure::block::{Block, Gnss, Image, Measurement, Pose, Role, Sigma, SurveyedPoint, TiePoint};
use misclosure::camera::{Camera, Interior, fraser};
use misclosure::inject::{self, Injected};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// The camera of the study with some distortion.
pub const INTERIOR: Interior =
    [5510.09, 2539.75, 1945.80, 2537.97, 1955.92, 1.5e-9, -4.5e-17, 1.4e-24, 3e-8, -2e-8, 2e-4, -1e-4];
pub const WIDTH: f64 = 5120.0;
pub const HEIGHT: f64 = 3840.0;

/// Looks down, image x to the east when the heading is north, tilted forward.
fn rotation(heading: f64, tilt: f64) -> UnitQuaternion<f64> {
    // Rows: camera x (right), y (down the image, backwards along the flight), z (forward of the lens, down).
    let down = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), heading);
    let pitch = Rotation3::from_axis_angle(&Vector3::x_axis(), tilt);
    UnitQuaternion::from_rotation_matrix(&(pitch * Rotation3::from_matrix_unchecked(down) * turn.inverse()))
}

/// Two flights over a hundred metres: `north` (nadir, 60 m, two strips back and forth) and `east` (tilted forward by 23
/// degrees, 80 m).
pub fn truth() -> Block {
    truth_with(INTERIOR)
}

/// The same with another camera.
pub fn truth_with(interior: Interior) -> Block {
    let camera =
        Camera { id: "cam".into(), width_px: WIDTH as u32, height_px: HEIGHT as u32, pixel_um: None, interior };
    let mut images = Vec::new();
    let mut add = |flight: u32, time: f64, centre: Vector3<f64>, velocity: Vector3<f64>, tilt: f64| {
        let heading = -(velocity.x).atan2(velocity.y);
        let wobble = Vector3::new(0.01, -0.02, 0.03) * (time * 1.7).sin();
        images.push(Image {
            time_s: Some(time),
            temperature_c: Some(20.0 + 0.1 * time),
            gnss: Some(Gnss { position: centre, sigma_xy: None, sigma_z: None }),
            velocity: Some(velocity),
            ..Image::new(
                format!("i{:02}", images.len()),
                0_usize.into(),
                (flight as usize).into(),
                Pose { rotation: UnitQuaternion::from_scaled_axis(wobble) * rotation(heading, tilt), centre },
            )
        });
    };
    for strip in 0..2 {
        let north = if strip == 0 { 1.0 } else { -1.0 };
        for n in 0..6 {
            let along = (f64::from(n) - 2.5) * 12.0 * north;
            let time = f64::from(strip * 6 + n) * 2.4 + f64::from(strip) * 20.0;
            let centre = Vector3::new(f64::from(strip) * 20.0 - 10.0, along, 60.0);
            add(0, time, centre, Vector3::new(0.0, 5.0 * north, 0.0), 0.0);
        }
    }
    for n in 0..8 {
        let along = (f64::from(n) - 3.5) * 10.0;
        add(1, 100.0 + f64::from(n) * 2.0, Vector3::new(along, -25.0, 80.0), Vector3::new(5.0, 0.0, 0.0), -0.4);
    }

    let ground = |x: f64, y: f64| 2.0 * (0.07 * x).sin() + 1.5 * (0.05 * y).cos();
    let mut block = Block {
        name: "by hand".into(),
        crs: "local".into(),
        survey_crs: String::new(),
        sigma: Sigma {
            tie_px: 0.3,
            mark_px: 0.4,
            control_xy_m: 0.005,
            control_z_m: 0.008,
            gnss_xy_m: 0.03,
            gnss_z_m: 0.05,
        },
        cameras: vec![camera],
        flights: vec!["north".into(), "east".into()],
        images,
        tie_points: Vec::new(),
        ties: Vec::new(),
        surveyed: Vec::new(),
        marks: Vec::new(),
        origin: nalgebra::Vector3::zeros(),
        extra_image_columns: Vec::new(),
    };
    for n in 0..400_u32 {
        // A regular grid with an irrational shear, so that points fall everywhere on the sensor.
        let x = f64::from(n % 20) * 5.0 - 47.0;
        let y = f64::from(n / 20) * 5.0 - 47.0 + 0.618 * f64::from(n % 20);
        let position = Vector3::new(x, y, ground(x, y));
        block.tie_points.push(TiePoint { name: format!("p{n:03}"), position: Some(position) });
    }
    for n in 0..12_u32 {
        let x = f64::from(n % 4) * 20.0 - 30.0;
        let y = f64::from(n / 4) * 25.0 - 25.0;
        block.surveyed.push(SurveyedPoint {
            name: format!("s{n:02}"),
            position: Vector3::new(x, y, ground(x, y)),
            role: if n < 5 { Role::Control } else { Role::Check },
            sigma_xy: None,
            sigma_z: None,
        });
    }
    let tie_positions: Vec<_> = block.tie_points.iter().map(|point| point.position.unwrap()).collect();
    let surveyed_positions: Vec<_> = block.surveyed.iter().map(|point| point.position).collect();
    block.ties = visible(&block, &tie_positions);
    // A tie point needs two images.
    let mut rays = vec![0; block.tie_points.len()];
    block.ties.iter().for_each(|tie| rays[tie.point.index()] += 1);
    let mut kept = rays.iter().map(|rays| *rays >= 2);
    block.tie_points.retain(|_| kept.next().unwrap());
    let tie_positions: Vec<_> = block.tie_points.iter().map(|point| point.position.unwrap()).collect();
    block.ties = visible(&block, &tie_positions);
    block.marks = visible(&block, &surveyed_positions);
    block
}

fn visible(block: &Block, points: &[Vector3<f64>]) -> Vec<Measurement> {
    let mut seen = Vec::new();
    for (point, position) in points.iter().enumerate() {
        for (image, shot) in block.images.iter().enumerate() {
            let interior = &block.cameras[0].interior;
            let Some([x, y]) = fraser::project(interior, shot.pose.cam_from_world(position).into()) else { continue };
            if (0.0..WIDTH).contains(&x) && (0.0..HEIGHT).contains(&y) {
                seen.push(Measurement { image: image.into(), point: point.into(), x, y, sigma: None });
            }
        }
    }
    seen
}

/// A camera without distortion, principal point and centre of distortion in the same place.
pub fn plain_interior() -> Interior {
    let mut interior = [0.0; 12];
    interior[..5].copy_from_slice(&[5500.0, 2560.0, 1920.0, 2560.0, 1920.0]);
    interior
}

/// The truth measured again under the errors named.
pub fn inject(truth: &Block, errors: &[&str]) -> Injected {
    let injections: Vec<_> = errors.iter().map(|error| inject::parse(error).unwrap()).collect();
    inject::apply(truth, truth, &injections, 7).unwrap()
}

/// A tie before and after: image's index, true point, both image points.
type Pair = (usize, Vector3<f64>, [f64; 2], [f64; 2]);

/// Ties before and after, where both are there.
pub fn pairs(before: &Block, after: &Block) -> Vec<Pair> {
    let key = |block: &Block, tie: &Measurement| {
        (block.images[tie.image.index()].name.clone(), block.tie_points[tie.point.index()].name.clone())
    };
    let found: std::collections::HashMap<_, _> = after.ties.iter().map(|tie| (key(after, tie), tie)).collect();
    let pairs: Vec<_> = before
        .ties
        .iter()
        .filter_map(|tie| {
            let other = found.get(&key(before, tie))?;
            let position = before.tie_points[tie.point.index()].position.unwrap();
            Some((tie.image.index(), position, [tie.x, tie.y], [other.x, other.y]))
        })
        .collect();
    assert!(pairs.len() * 2 > before.ties.len(), "most ties survive");
    pairs
}

/// Length of a difference in the image, px.
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
