//! Between the lens and the pixel.

use crate::inject::fixture::{HEIGHT, INTERIOR, WIDTH, distance, inject, pairs, plain_interior, truth, truth_with};

/// Sums of pixel coordinates below 8192 are exact to this, px.
const ROUNDING_PX: f64 = 5e-12;

#[test]
fn homothety_scales_about_its_centre() {
    let truth = truth();
    let centres = [("pp", [INTERIOR[1], INTERIOR[2]]), ("dc", [INTERIOR[3], INTERIOR[4]])];
    for (name, [cx, cy]) in centres {
        let injected = inject(&truth, &[&format!("homothety:lambda=0.005,centre={name}")]);
        for (_, _, [x, y], after) in pairs(&truth, &injected.block) {
            assert!(distance(after, [cx + 1.005 * (x - cx), cy + 1.005 * (y - cy)]) < ROUNDING_PX);
        }
        // The study: at most 16.15 px (at a corner), so a little less among points.
        assert!((12.0..16.15).contains(&injected.report.change_max_px), "{}", injected.report.change_max_px);
    }
    let injected = inject(&truth, &["homothety:centre=xy,cx=100,cy=200,lambda=-0.01"]);
    for (_, _, [x, y], after) in pairs(&truth, &injected.block) {
        assert!(distance(after, [x - 0.01 * (x - 100.0), y - 0.01 * (y - 200.0)]) < ROUNDING_PX);
    }
}

#[test]
fn local_flaw_points_away_and_fades() {
    let truth = truth();
    let injected = inject(&truth, &["local-flaw:centre_x=1000,centre_y=1200,lambda=10,sigma=300"]);
    let smooth = inject(&truth, &["local-flaw:centre_x=1000,centre_y=1200,lambda=10,sigma=300,smooth=1"]);
    let mut near = 0;
    for ((_, _, before, after), (_, _, _, after_smooth)) in
        pairs(&truth, &injected.block).into_iter().zip(pairs(&truth, &smooth.block))
    {
        let q = [before[0] - 1000.0, before[1] - 1200.0];
        let s = q[0].hypot(q[1]);
        let moved = [after[0] - before[0], after[1] - before[1]];
        assert!((moved[0].hypot(moved[1]) - 10.0 * (-(s / 300.0).powi(2)).exp()).abs() < ROUNDING_PX);
        assert!(moved[0] * q[0] + moved[1] * q[1] >= 0.0, "outwards");
        let moved_smooth = distance(after_smooth, before);
        assert!((moved_smooth - moved[0].hypot(moved[1]) * s / 300.0).abs() < ROUNDING_PX);
        near += usize::from(s < 300.0);
    }
    assert!(near > 20, "the test sees the flaw: {near} points");
}

#[test]
fn high_orders_grow_as_they_say() {
    let truth = truth();
    // Farthest corner from the centre of distortion: (5120 - 2537.97, 1955.92).
    let corner = (WIDTH - INTERIOR[3]).hypot(INTERIOR[4]);
    let radial = inject(&truth, &["radial-high:corner=2"]).block;
    for (_, _, before, after) in pairs(&truth, &radial) {
        let d = [before[0] - INTERIOR[3], before[1] - INTERIOR[4]];
        let r = d[0].hypot(d[1]);
        assert!((distance(after, before) - 2.0 * (r / corner).powi(9)).abs() < ROUNDING_PX);
        assert!((after[0] - before[0]) * d[0] + (after[1] - before[1]) * d[1] >= 0.0, "outwards");
    }
    let decentring = inject(&truth, &["decentring-high:corner=2,direction_deg=90"]).block;
    let k = 2.0 / 3.0 / corner.powi(4);
    for (_, _, before, after) in pairs(&truth, &decentring) {
        let (dx, dy) = (before[0] - INTERIOR[3], before[1] - INTERIOR[4]);
        let r2 = dx * dx + dy * dy;
        // Brown's tangential form for an axis along y.
        let expected = [before[0] + k * r2 * 2.0 * dx * dy, before[1] + k * r2 * (r2 + 2.0 * dy * dy)];
        assert!(distance(after, expected) < ROUNDING_PX);
    }
}

#[test]
fn unflat_sensor_is_met_where_ray_and_surface_cross() {
    let truth = truth_with(plain_interior());
    let height = |x: f64, y: f64| {
        let (u, v) = (2.0 * x / WIDTH - 1.0, 2.0 * y / HEIGHT - 1.0);
        let (du, dv) = (u - 0.3, (v - 0.3) * HEIGHT / WIDTH);
        5.0 * u * v + 4.0 * u * u + 6.0 * (-(du * du + dv * dv) / (2.0 * 0.16)).exp()
    };
    let injected = inject(&truth, &["unflatness:saddle=5,bend=4,bump=6"]);
    for (_, _, [x, y], [sx, sy]) in pairs(&truth, &injected.block) {
        // The light goes from the projection centre, f in front of the focal plane, through (x, y) to depth z behind
        // it.
        let z = height(sx, sy);
        let part = (5500.0 + z) / 5500.0;
        let on_ray = [2560.0 + (x - 2560.0) * part, 1920.0 + (y - 1920.0) * part];
        assert!(distance([sx, sy], on_ray) < 1e-10, "on ray and surface at once");
    }
    assert!(injected.report.change_max_px > 1.0);
}

#[test]
fn stitching_is_periodic() {
    let truth = truth();
    let injected = inject(&truth, &["sensor-stitch:amplitude=0.5,wavelength=400,axis=x"]).block;
    for (_, _, before, after) in pairs(&truth, &injected) {
        assert_eq!(before[1], after[1]);
        let phase = (before[0] / 400.0).fract();
        let shift = after[0] - before[0];
        assert_eq!(shift > 0.0, phase < 0.5);
        assert!((shift - 0.5 * (std::f64::consts::TAU * phase).sin()).abs() < 1e-9);
    }
}
