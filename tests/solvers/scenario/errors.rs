//! What is added to an exact block: noise of image and survey, wrong approximations.

use crate::scenario::simulation;
use misclosure::block::{Image, Role};
use misclosure::scenario::{Perturbation, SurveyNoise, add_noise, add_survey_noise};

#[test]
fn noise_has_its_size_and_is_stated() {
    let exact = simulation("dike", 1).block;
    let mut noisy = exact.clone();
    add_noise(&mut noisy, 0.3, 4).unwrap();
    assert_eq!((noisy.sigma.tie_px, noisy.sigma.mark_px), (0.3, 0.3));
    for (noisy, exact) in [(&noisy.ties, &exact.ties), (&noisy.marks, &exact.marks)] {
        let errors: Vec<f64> = noisy.iter().zip(exact).flat_map(|(a, b)| [a.x - b.x, a.y - b.y]).collect();
        let count = errors.len() as f64;
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
        // Five standard deviations of an estimated standard deviation and of a mean.
        assert!((rms - 0.3).abs() < 5.0 * 0.3 / (2.0 * count).sqrt(), "{rms}");
        assert!((errors.iter().sum::<f64>() / count).abs() < 5.0 * 0.3 / count.sqrt());
    }
    let mut again = exact.clone();
    add_noise(&mut again, 0.3, 4).unwrap();
    assert_eq!(again, noisy);
    let mut other = exact.clone();
    add_noise(&mut other, 0.3, 5).unwrap();
    assert_ne!(other, noisy);
    let mut untouched = exact.clone();
    add_noise(&mut untouched, 0.0, 4).unwrap();
    assert_eq!(untouched, exact);
    assert!(add_noise(&mut untouched, f64::NAN, 4).is_err() && add_noise(&mut untouched, -1.0, 4).is_err());
}

#[test]
fn survey_noise_is_switched_by_table() {
    let exact = simulation("dike", 1).block;
    let mut noisy = exact.clone();
    add_survey_noise(&mut noisy, SurveyNoise { gnss: true, control: true, check: false }, 4);
    let mut squares = [0.0; 2];
    for (a, b) in noisy.images.iter().zip(&exact.images) {
        let error = a.gnss.unwrap().position - b.gnss.unwrap().position;
        squares[0] += error.xy().norm_squared() / 2.0 / exact.images.len() as f64;
        squares[1] += error.z.powi(2) / exact.images.len() as f64;
        assert_eq!(a.pose, b.pose);
    }
    // 113 images: the standard deviations are known to 5 % and 7 %.
    assert!((squares[0].sqrt() / exact.sigma.gnss_xy_m - 1.0).abs() < 0.25, "{squares:?}");
    assert!((squares[1].sqrt() / exact.sigma.gnss_z_m - 1.0).abs() < 0.3, "{squares:?}");
    for (a, b) in noisy.surveyed.iter().zip(&exact.surveyed) {
        assert_eq!(a.position == b.position, a.role == Role::Check);
        assert!((a.position - b.position).norm() < 0.05);
    }
    assert_eq!((&noisy.ties, &noisy.marks), (&exact.ties, &exact.marks));
}

#[test]
fn perturbed_start_leaves_measurements_and_truth() {
    let exact = simulation("dike", 1);
    let mut wrong = exact.clone();
    let angle_rad = 0.1_f64.to_radians();
    let perturbation = Perturbation { focal_fraction: 0.005, position_m: 0.1, angle_rad, points: true };
    wrong.perturb_start(perturbation, 3).unwrap();
    assert_eq!((&wrong.truth, &wrong.block.ties), (&exact.truth, &exact.block.ties));
    assert_eq!((&wrong.block.marks, &wrong.block.surveyed), (&exact.block.marks, &exact.block.surveyed));
    assert!((wrong.block.cameras[0].interior[0] / 5510.09 - 1.005).abs() < 1e-12);
    assert!(wrong.block.tie_points.iter().all(|point| point.position.is_none()));
    let pairs = || wrong.block.images.iter().zip(&exact.block.images);
    let degrees = 3.0 * exact.block.images.len() as f64;
    let shift = (pairs().map(|(a, b)| (a.pose.centre - b.pose.centre).norm_squared()).sum::<f64>() / degrees).sqrt();
    let turn = |(a, b): (&Image, &Image)| a.pose.rotation.angle_to(&b.pose.rotation).powi(2);
    let turn = (pairs().map(turn).sum::<f64>() / degrees).sqrt();
    assert!((shift / 0.1 - 1.0).abs() < 0.15, "{shift}");
    assert!((turn / angle_rad - 1.0).abs() < 0.15, "{turn}");
    assert!(wrong.perturb_start(Perturbation { position_m: -1.0, ..perturbation }, 3).is_err());
    assert!(wrong.perturb_start(Perturbation { focal_fraction: -1.0, ..perturbation }, 3).is_err());
}
