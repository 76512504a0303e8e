use super::*;
use approx::assert_relative_eq;

const SENSOR: [f64; 2] = [5120.0, 3840.0];
/// The study's camera with distortion of some 100 px in the corners.
const STUDY: Interior =
    [5510.09, 2539.75, 1945.80, 2537.97, 1955.92, 3.0e-9, -1.0e-16, 1.0e-24, 2.0e-7, -1.0e-7, 1.0e-4, -5.0e-5];
/// Round-off of image coordinates of thousands of px and of the inverse distortion.
const EXACT_PX: f64 = 1e-8;

/// The camera whose images are those of `camera`, enlarged by `s` about its principal point: every length in px by `s`,
/// every coefficient by its unit.
fn enlarged(camera: &Interior, s: f64) -> Interior {
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *camera;
    let (dx, dy) = (ppx + s * (dcx - ppx), ppy + s * (dcy - ppy));
    [s * f, ppx, ppy, dx, dy, k1 / s.powi(2), k2 / s.powi(4), k3 / s.powi(6), p1 / s, p2 / s, b1, b2]
}

#[test]
fn a_homothety_about_the_principal_point_is_a_change_of_scale() {
    let lambda = 0.005;
    let field = compare(SENSOR, &STUDY, &enlarged(&STUDY, 1.0 + lambda), Grid::default(), Part::WholeCamera).unwrap();
    assert_eq!((field.vectors.len(), field.undefined), (64 * 48, 0));
    for vector in &field.vectors {
        assert_relative_eq!(vector.d[0], lambda * (vector.at[0] - STUDY[1]), epsilon = EXACT_PX);
        assert_relative_eq!(vector.d[1], lambda * (vector.at[1] - STUDY[2]), epsilon = EXACT_PX);
    }
    // The published greatest error of this homothety, 16.15 px, is that of the corner farthest from the principal
    // point.
    let corners = [[0.0, 0.0], [5120.0, 0.0], [0.0, 3840.0], [5120.0, 3840.0]];
    let field = compare_at(&corners, &STUDY, &enlarged(&STUDY, 1.0 + lambda), Part::WholeCamera).unwrap();
    assert_relative_eq!(field.statistics.max, 16.15, epsilon = 0.01);
    assert_eq!(field.vectors[1].d[0].hypot(field.vectors[1].d[1]), field.statistics.max);
}

#[test]
fn without_distortion_it_is_a_change_of_f_alone() {
    let mut a = STUDY;
    a[5..].fill(0.0);
    let mut b = a;
    b[0] *= 1.005;
    let field = compare(SENSOR, &a, &b, Grid::default(), Part::WholeCamera).unwrap();
    for vector in &field.vectors {
        assert_relative_eq!(vector.d[0], 0.005 * (vector.at[0] - a[1]), epsilon = EXACT_PX);
    }
    // Where the distortion does not change its part of the field is nothing, whatever the focal length.
    let distortion = compare(SENSOR, &a, &b, Grid::default(), Part::Distortion).unwrap();
    assert_eq!(distortion.statistics.max, 0.0);
}

#[test]
fn equal_cameras_do_not_differ() {
    for part in [Part::WholeCamera, Part::WholeCameraUpToRotation, Part::Distortion] {
        let field = compare(SENSOR, &STUDY, &STUDY, Grid::default(), part).unwrap();
        assert!(field.statistics.max < EXACT_PX, "{part:?}: {}", field.statistics.max);
    }
}

#[test]
fn distortion_part_of_one_radial_term() {
    let k1 = 4.0e-9;
    let mut a = STUDY;
    a[5..].fill(0.0);
    let mut b = a;
    (b[0], b[5]) = (5300.0, k1);
    let field = compare(SENSOR, &a, &b, Grid { columns: 7, rows: 5 }, Part::Distortion).unwrap();
    for vector in &field.vectors {
        // r + k1 r^3 = distance of the image point, by bisection.
        let (dx, dy) = (vector.at[0] - b[3], vector.at[1] - b[4]);
        let distance = dx.hypot(dy);
        let (mut low, mut high) = (0.0, distance);
        for _ in 0..200 {
            let r = 0.5 * (low + high);
            if r + k1 * r.powi(3) < distance { low = r } else { high = r }
        }
        let part = 1.0 - low / distance;
        assert_relative_eq!(vector.d[0], part * dx, epsilon = EXACT_PX);
        assert_relative_eq!(vector.d[1], part * dy, epsilon = EXACT_PX);
    }
    assert!(field.statistics.max > 50.0);
}

#[test]
fn the_best_rotation_is_found() {
    let truth = Vector3::new(0.01, -0.02, 0.03);
    let rays: Vec<_> = Grid::default()
        .points(SENSOR)
        .map(|at| {
            let there = ray(&STUDY, at).unwrap();
            (fraser::project(&STUDY, (exp(&truth) * there).into()).unwrap(), there)
        })
        .collect();
    assert_relative_eq!(best_rotation(&STUDY, &rays).unwrap(), truth, epsilon = 1e-12);
}

#[test]
fn a_moved_principal_point_is_mostly_a_rotation() {
    let mut b = STUDY;
    (b[1], b[3]) = (b[1] + 5.0, b[3] + 5.0);
    let whole = compare(SENSOR, &STUDY, &b, Grid::default(), Part::WholeCamera).unwrap();
    assert_relative_eq!(whole.statistics.min, 5.0, epsilon = EXACT_PX);
    assert_relative_eq!(whole.statistics.max, 5.0, epsilon = EXACT_PX);
    let rotated = compare(SENSOR, &STUDY, &b, Grid::default(), Part::WholeCameraUpToRotation).unwrap();
    // Rays to the right turn about the axis that points down, y, by -5 px / f. The terms of second order in the field
    // of view (+-0.47 x 0.35) remain of the 5 px, and shift the best angle by their mean.
    assert_relative_eq!(rotated.rotation.y, -5.0 / 5510.09, max_relative = 0.15);
    assert!(rotated.statistics.rms < 0.1 * whole.statistics.rms, "{}", rotated.statistics.rms);
    // It is the least: any small turn more makes it larger.
    for axis in 0..3 {
        for step in [-1e-5, 1e-5] {
            let mut near = rotated.rotation;
            near[axis] += step;
            let sum: f64 = rotated
                .vectors
                .iter()
                .map(|v| {
                    let xy = fraser::project(&b, (exp(&near) * ray(&STUDY, v.at).unwrap()).into()).unwrap();
                    (xy[0] - v.at[0]).powi(2) + (xy[1] - v.at[1]).powi(2)
                })
                .sum();
            assert!(sum > rotated.statistics.rms.powi(2) * rotated.statistics.n as f64);
        }
    }
}

#[test]
fn what_is_undefined_is_counted() {
    // Barrel distortion that folds back at r = 2041 px: the corners have no ray.
    let mut folded = STUDY;
    folded[5..].fill(0.0);
    folded[5] = -8.0e-8;
    for part in [Part::WholeCamera, Part::Distortion] {
        let field = compare(SENSOR, &folded, &STUDY, Grid::default(), part).unwrap();
        assert!(field.undefined > 100 && field.vectors.len() > 100);
        assert_eq!(field.undefined + field.vectors.len(), 64 * 48);
        assert_eq!(field.statistics.n, field.vectors.len());
    }
    let corner = [[1.0, 1.0], [5119.0, 1.0]];
    assert_eq!(compare_at(&corner, &folded, &STUDY, Part::WholeCamera).unwrap_err(), FieldError::Undefined(0));
}

#[test]
fn grid_of_cell_centres() {
    let points: Vec<_> = Grid { columns: 2, rows: 2 }.points([40.0, 20.0]).collect();
    assert_eq!(points, [[10.0, 5.0], [30.0, 5.0], [10.0, 15.0], [30.0, 15.0]]);
}
