//! A camera that is another one in every image.

use crate::inject::fixture::{INTERIOR, distance, inject, pairs, plain_interior, truth, truth_with};
use nalgebra::Vector3;

const ROUNDING_PX: f64 = 5e-12;

/// By image, the factor by which points moved away from the principal point of a camera without distortion.
fn scales(error: &str) -> Vec<f64> {
    let truth = truth_with(plain_interior());
    let injected = inject(&truth, &[error]);
    let mut scales = vec![f64::NAN; truth.images.len()];
    for (image, _, [x, y], after) in pairs(&truth, &injected.block) {
        let d = [x - 2560.0, y - 1920.0];
        let scale = ((after[0] - 2560.0) * d[0] + (after[1] - 1920.0) * d[1]) / (d[0] * d[0] + d[1] * d[1]);
        assert!(distance(after, [2560.0 + scale * d[0], 1920.0 + scale * d[1]]) < 1e-9, "a pure change of scale");
        if !scales[image].is_nan() {
            assert!((scale - scales[image]).abs() < 1e-11, "the same for the whole image");
        }
        scales[image] = scale;
    }
    scales
}

#[test]
fn calibration_changes_the_start_alone() {
    let truth = truth();
    let block = inject(&truth, &["calibration:f=+25,k1=1e-9"]).block;
    let mut expected = truth.clone();
    expected.cameras[0].interior[0] = INTERIOR[0] + 25.0;
    expected.cameras[0].interior[5] = INTERIOR[5] + 1e-9;
    assert_eq!(block, expected);
}

#[test]
fn start_perturbs_poses_and_nothing_measured() {
    let truth = truth();
    let block = inject(&truth, &["start:position_m=2,angle_deg=3,points_m=0.5"]).block;
    assert_eq!((&block.ties, &block.marks, &block.surveyed), (&truth.ties, &truth.marks, &truth.surveyed));
    let n = truth.images.len() as f64;
    let shift: f64 =
        truth.images.iter().zip(&block.images).map(|(a, b)| (a.pose.centre - b.pose.centre).norm_squared()).sum();
    let turn: f64 = truth
        .images
        .iter()
        .zip(&block.images)
        .map(|(a, b)| a.pose.rotation.angle_to(&b.pose.rotation).to_degrees().powi(2))
        .sum();
    // RMS of 60 normal numbers: within 4 of its standard deviations, 1/sqrt(120) each.
    assert!(((shift / (3.0 * n)).sqrt() / 2.0 - 1.0).abs() < 0.37);
    assert!(((turn / (3.0 * n)).sqrt() / 3.0 - 1.0).abs() < 0.37);
    assert_ne!(block.images, inject(&truth, &["start:position_m=2,angle_deg=3,seed=5"]).block.images);
}

#[test]
fn focal_growth_is_geometric_in_table_order() {
    let scales = scales("focal-growth:b=1e-4");
    for (n, scale) in scales.iter().enumerate() {
        assert!((scale - (n as f64 * 1e-4_f64.ln_1p()).exp()).abs() < 1e-11, "image {n}");
    }
    // The study: 113 images, 6.17 px from the first to the last.
    assert!((5510.09 * ((112.0 * 1e-5_f64.ln_1p()).exp() - 1.0) - 6.17).abs() < 0.01);
}

#[test]
fn focal_steps_follow_the_flights() {
    for (image, scale) in scales("focal-steps:steps=2/-11").into_iter().enumerate() {
        let expected = if image < 12 { 5502.0 / 5500.0 } else { 5489.0 / 5500.0 };
        assert!((scale - expected).abs() < 1e-11);
    }
    let drawn = scales("focal-steps:size=4");
    assert_eq!(drawn[0], 1.0, "the first flight is the reference");
    assert!((drawn[12] - 1.0).abs() > 1e-6);
}

#[test]
fn focus_hunting_has_its_size() {
    let scales = scales("focus-hunting:size=2");
    let rms = (scales.iter().map(|scale| ((scale - 1.0) * 5500.0).powi(2)).sum::<f64>() / scales.len() as f64).sqrt();
    // 20 normal numbers: 4 standard deviations of their RMS.
    assert!((rms / 2.0 - 1.0).abs() < 4.0 / 40.0_f64.sqrt(), "{rms}");
    assert!((scales[0] - scales[1]).abs() > 1e-6, "independent");
}

#[test]
fn lens_follows_a_rising_temperature_with_its_lag() {
    // Temperature rises evenly by 0.1 K/s within a flight and in between: T = 20 + 0.1 t. A lens that starts in balance
    // and lags by L is behind by 0.1 L (1 - exp(-t / L)).
    let truth = truth();
    let times: Vec<f64> = truth.images.iter().map(|image| image.time_s.unwrap()).collect();
    let scales = scales("temperature-focal:alpha=0.8,lag=25,reference=20");
    for (scale, t) in scales.iter().zip(&times) {
        let lens = 0.1 * t - 0.1 * 25.0 * (1.0 - (-t / 25.0).exp());
        let f = (scale - 1.0) * 5500.0;
        // Integration steps of a twentieth of the lag: 1e-7 of some kelvins.
        assert!((f - 0.8 * lens).abs() < 1e-6, "{f} {}", 0.8 * lens);
    }
    // A pause much longer than the lag forgets the start: 0.1 K/s x 0.01 s behind.
    let quick = self::scales("temperature-focal:expansion=100,lag=0.01,reference=20");
    for (scale, t) in quick.iter().zip(&times).skip(1) {
        assert!((scale - 1.0 - 100e-6 * (0.1 * t - 0.001)).abs() < 1e-11);
    }
}

#[test]
fn temperature_history_can_be_made_and_is_recorded() {
    let truth = truth_with(plain_interior());
    let block = inject(&truth, &["temperature-focal:from=20,to=40,alpha=0.5"]).block;
    assert_eq!(block.images[0].temperature_c, Some(20.0));
    assert_eq!(block.images[19].temperature_c, Some(40.0));
    let scales = scales("temperature-focal:from=20,to=40,alpha=0.5");
    assert!(((scales[19] - scales[0]) * 5500.0 - 10.0).abs() < 1e-8);
    // Warming up with a time constant of 30 s over 114 s: half of a 20 K rise after 30 ln(2 / (1 + exp(-114/30))) s.
    let block = inject(&truth, &["temperature-focal:from=20,to=40,warm_up=30"]).block;
    let half = 30.0 * (2.0 / (1.0 + (-114.0_f64 / 30.0).exp())).ln();
    for image in &block.images {
        let temperature = image.temperature_c.unwrap();
        assert_eq!(temperature > 30.0, image.time_s.unwrap() > half, "{temperature} at {:?}", image.time_s);
    }
    assert!((block.images[19].temperature_c.unwrap() - 40.0).abs() < 1e-12);
}

/// By image, the shift that all its points share.
fn shifts(error: &str) -> Vec<[f64; 2]> {
    let truth = truth();
    let injected = inject(&truth, &[error]);
    let mut shifts = vec![[f64::NAN; 2]; truth.images.len()];
    for (image, _, before, after) in pairs(&truth, &injected.block) {
        let shift = [after[0] - before[0], after[1] - before[1]];
        if !shifts[image][0].is_nan() {
            assert!(distance(shift, shifts[image]) < ROUNDING_PX, "distortion moves along");
        }
        shifts[image] = shift;
    }
    shifts
}

#[test]
fn sensor_shifts_are_the_same_for_all_points_of_an_image() {
    let drift = shifts("pp-drift:x=3,y=-2");
    let last = 114.0;
    let truth = truth();
    for (shift, image) in drift.iter().zip(&truth.images) {
        let part = image.time_s.unwrap() / last;
        assert!(distance(*shift, [3.0 * part, -2.0 * part]) < 1e-10);
    }
    for (image, shift) in shifts("pp-drift:x=19,against=order").iter().enumerate() {
        assert!(distance(*shift, [image as f64, 0.0]) < 1e-10);
    }
    for (image, shift) in shifts("pp-steps:x=0/4,y=1/-1").iter().enumerate() {
        assert!(distance(*shift, if image < 12 { [0.0, 1.0] } else { [4.0, -1.0] }) < 1e-10);
    }
    let jitter = shifts("sensor-jitter:size=2");
    let rms = (jitter.iter().map(|s| s[0] * s[0] + s[1] * s[1]).sum::<f64>() / 40.0).sqrt();
    assert!((rms / 2.0 - 1.0).abs() < 4.0 / 80.0_f64.sqrt(), "{rms}");
}

#[test]
fn lens_sags_with_the_tilt() {
    let truth = truth();
    for (image, shift) in shifts("lens-sag:lateral=2").iter().enumerate() {
        let axis = truth.images[image].pose.rotation.inverse() * Vector3::z();
        // The image moves by the sine of the angle between the optical axis and the vertical.
        let sine = axis.xy().norm();
        assert!((shift[0].hypot(shift[1]) - 2.0 * sine).abs() < 1e-10);
        if image >= 12 {
            assert!(sine > 0.3, "the tilted flight");
            // Looking ahead of the vertical, the ground is down in the image: the lens hangs towards it.
            assert!(shift[1] > 0.7, "{shift:?}");
        }
    }
}
