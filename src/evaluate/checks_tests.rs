use super::*;
use crate::block::{CameraId, FlightId, Image, ImageId, Measurement, Pose, Sigma, SurveyedPoint};
use crate::camera::{Camera, fraser};
use crate::evaluate::{Failure, PlainModel};
use approx::assert_relative_eq;
use nalgebra::UnitQuaternion;

const CAMERA: [f64; 12] = [5510.09, 2539.75, 1945.80, 2537.97, 1955.92, 3.0e-9, 0.0, 0.0, 2.0e-7, 0.0, 0.0, 0.0];

/// 5 images over 5 control and 20 check points, exact, in the survey's system; check point 23 has one mark only.
fn survey_block() -> Block {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let image = |i: u32| {
        Image::new(
            format!("i{i}"),
            CameraId(0),
            FlightId(0),
            Pose { rotation, centre: Vector3::new(10.0 * f64::from(i), 2.0 * f64::from(i % 2), 50.0) },
        )
    };
    let surveyed = |i: u32| SurveyedPoint {
        name: format!("p{i}"),
        position: Vector3::new(8.0 + f64::from(i % 5) * 6.0, f64::from(i / 5) * 2.0 - 4.0, f64::from(i % 3)),
        role: if [0, 4, 12, 20, 24].contains(&i) { Role::Control } else { Role::Check },
        sigma_xy: None,
        sigma_z: None,
    };
    let mut block = Block {
        name: "test".into(),
        crs: "local".into(),
        survey_crs: String::new(),
        sigma: Sigma {
            tie_px: 0.5,
            mark_px: 0.5,
            control_xy_m: 0.005,
            control_z_m: 0.01,
            gnss_xy_m: 0.03,
            gnss_z_m: 0.05,
        },
        cameras: vec![Camera { id: "cam".into(), width_px: 5120, height_px: 3840, pixel_um: None, interior: CAMERA }],
        flights: vec!["f".into()],
        images: (0..5).map(image).collect(),
        tie_points: Vec::new(),
        ties: Vec::new(),
        surveyed: (0..25).map(surveyed).collect(),
        marks: Vec::new(),
        origin: nalgebra::Vector3::zeros(),
        extra_image_columns: Vec::new(),
    };
    for (p, point) in block.surveyed.iter().enumerate() {
        for (i, image) in block.images.iter().enumerate() {
            let [x, y] = fraser::project(&CAMERA, image.pose.cam_from_world(&point.position).into()).unwrap();
            if p != 23 || i == 0 {
                block.marks.push(Measurement { image: ImageId::from(i), point: PointId::from(p), x, y, sigma: None });
            }
        }
    }
    block
}

/// The same images as a free adjustment would leave them: in a system of their own.
fn free_system(block: &Block) -> (PlainModel, Similarity) {
    let survey_from_free = Similarity {
        scale: 0.97,
        rotation: UnitQuaternion::from_euler_angles(0.02, -0.03, 0.4),
        translation: Vector3::new(-3.0, 7.0, 1.0),
    };
    let mut model = PlainModel::of_block(block);
    let free_from_survey = survey_from_free.inverse();
    model.poses.iter_mut().for_each(|pose| *pose = free_from_survey.apply_to_pose(pose));
    (model, survey_from_free)
}

#[test]
fn a_free_block_comes_home_through_its_control() {
    let block = survey_block();
    let (model, truth) = free_system(&block);
    let comparison = compare(&model, &block, Alignment::FromControl, Method::Image).unwrap();
    assert_relative_eq!(comparison.similarity.unwrap().scale, truth.scale, max_relative = 1e-11);
    assert_eq!(comparison.rows.len(), 24);
    assert!(comparison.rows.iter().all(|row| row.d.norm() < 1e-9), "{:?}", comparison.rows);
    assert_eq!((comparison.control.unwrap().n, comparison.check.unwrap().n), (5, 19));
    assert_eq!(comparison.failed.len(), 1);
    assert_eq!((comparison.failed[0].point, comparison.failed[0].reason), (PointId(23), Failure::TooFewMarks(1)));
    // Without alignment the two systems differ by metres; with the true similarity by nothing.
    let unaligned = compare(&model, &block, Alignment::None, Method::Image).unwrap();
    assert!(unaligned.rows.iter().all(|row| row.d.norm() > 1.0) && unaligned.similarity.is_none());
    let given = compare(&model, &block, Alignment::Given(truth), Method::Rays).unwrap();
    assert!(given.rows.iter().all(|row| row.d.norm() < 1e-9));
    // Covariances come into the survey's system too.
    let there = compare(&PlainModel::of_block(&block), &block, Alignment::None, Method::Image).unwrap();
    for (a, b) in comparison.rows.iter().zip(&there.rows) {
        assert_relative_eq!(a.covariance, b.covariance, epsilon = 1e-12);
    }
}

#[test]
fn check_points_take_no_part_in_the_similarity() {
    let block = survey_block();
    let (model, _) = free_system(&block);
    let before = compare(&model, &block, Alignment::FromControl, Method::Image).unwrap();
    let mut moved = block.clone();
    let shift = Vector3::new(0.5, -0.25, 2.0);
    moved.surveyed.iter_mut().filter(|p| p.role == Role::Check).for_each(|p| p.position += shift);
    let after = compare(&model, &moved, Alignment::FromControl, Method::Image).unwrap();
    assert_eq!(before.similarity, after.similarity);
    assert_eq!(before.control, after.control);
    for (a, b) in before.rows.iter().zip(&after.rows) {
        let expected = if a.role == Role::Check { a.d - shift } else { a.d };
        assert_relative_eq!(b.d, expected, epsilon = 1e-12);
    }
}

#[test]
fn control_that_determines_no_similarity_is_an_error() {
    let mut block = survey_block();
    let (model, _) = free_system(&block);
    block.surveyed.iter_mut().skip(10).for_each(|p| p.role = Role::Check);
    let error = compare(&model, &block, Alignment::FromControl, Method::Image).unwrap_err();
    assert_eq!(error, SimilarityError::TooFew(2));
}

/// A survey that is shifted, and images that have nothing to do with it.
struct Shifted(PlainModel, Vector3<f64>);

impl ImageModel for Shifted {
    fn project(&self, image: ImageId, p: &Vector3<f64>) -> Option<crate::evaluate::ProjectedPoint> {
        self.0.project(image, p)
    }
    fn surveyed(&self, point: &Vector3<f64>) -> Vector3<f64> {
        point + self.1
    }
    fn centre(&self, image: ImageId) -> Vector3<f64> {
        self.0.centre(image)
    }
    fn ray(&self, image: ImageId, observed: [f64; 2]) -> Option<Vector3<f64>> {
        self.0.ray(image, observed)
    }
}

#[test]
fn effects_of_the_survey_are_applied() {
    let block = survey_block();
    let shift = Vector3::new(0.0, 0.0, 0.125);
    let model = Shifted(PlainModel::of_block(&block), shift);
    let comparison = compare(&model, &block, Alignment::None, Method::Image).unwrap();
    assert!(comparison.rows.iter().all(|row| (row.d - shift).norm() < 1e-9));
}

#[test]
fn statistics_by_hand() {
    let residuals = [Vector3::new(3.0, 4.0, 12.0), Vector3::new(-3.0, -4.0, -12.0), Vector3::new(0.0, 0.0, 0.0)];
    let statistics = Statistics::of(residuals).unwrap();
    assert_eq!((statistics.mean_m.x, statistics.mean_m.z), (0.0, 0.0));
    assert_relative_eq!(statistics.mean_m.xy, 10.0 / 3.0);
    assert_relative_eq!(statistics.mean_m.xyz, 26.0 / 3.0);
    assert_relative_eq!(statistics.mean_m.abs_z, 8.0);
    let std = statistics.std_m.unwrap();
    assert_relative_eq!(std.x, 3.0);
    assert_relative_eq!(std.z, 12.0);
    assert_relative_eq!(std.xy, (25.0f64 / 3.0).sqrt());
    assert_relative_eq!(std.abs_z, 48f64.sqrt());
    assert_relative_eq!(statistics.rms_m.xyz, (338.0f64 / 3.0).sqrt());
    assert_relative_eq!(statistics.rms_m.xy, (50.0f64 / 3.0).sqrt());
    assert!(Statistics::of([]).is_none());
    assert!(Statistics::of([Vector3::x()]).unwrap().std_m.is_none());
}

#[test]
fn statistics_have_the_keys_of_the_summary() {
    let json = serde_json::to_value(Statistics::of([Vector3::x(), Vector3::y()]).unwrap()).unwrap();
    let keys = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&json), ["n", "mean_m", "std_m", "rms_m"]);
    assert_eq!(keys(&json["mean_m"]), ["x", "y", "z", "xy", "xyz", "abs_z"]);
    assert_eq!(keys(&json["std_m"]), ["x", "y", "z", "xy", "xyz", "abs_z"]);
    assert_eq!(keys(&json["rms_m"]), ["x", "y", "z", "xy", "xyz"]);
}
