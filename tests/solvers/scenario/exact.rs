//! Measurements are exact: a projection of the test's own, with the rotation as a sandwich of quaternions.

use crate::scenario::simulation;
use misclosure::block::{Block, Image, Measurement};
use misclosure::io::block::{read_block, write_block};
use misclosure::scenario::{Simulation, preset_names};
use nalgebra::Vector3;

/// Demanded agreement of the measurements with the exact projection.
const EXACT_PX: f64 = 1e-9;

/// Hamilton product.
fn times(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The camera formula of the block format, with the rotation as the sandwich q v q*; also Z.
fn project(interior: &[f64; 12], image: &Image, point: &Vector3<f64>) -> ([f64; 2], f64) {
    let q = image.pose.rotation;
    let q = [q.w, q.i, q.j, q.k];
    let d = point - image.pose.centre;
    let [_, x, y, z] = times(times(q, [0.0, d.x, d.y, d.z]), [q[0], -q[1], -q[2], -q[3]]);
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let (u, v) = (ppx + f * x / z, ppy + f * y / z);
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
    let x = u + du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv;
    let y = v + dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv;
    ([x, y], z)
}

/// Every measurement equals the projection of the truth, in front, on the sensor by `margin`; every point is measured
/// in two images or more, once in each.
pub fn assert_exact(simulation: &Simulation, margin: f64) {
    let Simulation { block, truth, .. } = simulation;
    let positions: [Vec<Vector3<f64>>; 2] = [
        truth.tie_points.iter().map(|point| point.position.expect("the truth is complete")).collect(),
        truth.surveyed.iter().map(|point| point.position).collect(),
    ];
    for (table, positions) in [&block.ties, &block.marks].into_iter().zip(&positions) {
        let mut images_of = vec![Vec::new(); positions.len()];
        for &Measurement { image, point, x, y, .. } in table {
            let camera = truth.camera_of(image);
            let (exact, depth) = project(&camera.interior, &truth.images[image.index()], &positions[point.index()]);
            assert!(depth > 0.0);
            assert!((x - exact[0]).abs() < EXACT_PX && (y - exact[1]).abs() < EXACT_PX, "{x} {y} {exact:?}");
            assert!(x >= margin && x <= f64::from(camera.width_px) - margin);
            assert!(y >= margin && y <= f64::from(camera.height_px) - margin);
            images_of[point.index()].push(image);
        }
        for images in &mut images_of {
            images.sort();
            assert!(images.len() >= 2, "a point with {} rays", images.len());
            assert!(images.windows(2).all(|pair| pair[0] < pair[1]), "twice in one image");
        }
    }
    assert!(truth.ties.is_empty() && truth.marks.is_empty());
}

#[test]
fn every_preset_is_exact() {
    for name in preset_names() {
        let simulation = simulation(name, 7);
        println!("{name}\n{}", simulation.report);
        assert_exact(&simulation, 1.0);
        let Simulation { block, truth, .. } = &simulation;
        assert_eq!(
            (&block.cameras, &block.images, &block.tie_points),
            (&truth.cameras, &truth.images, &truth.tie_points)
        );
        assert_eq!(block.name, name);
        assert!(block.ties.len() > 1000);
    }
}

#[test]
fn a_written_block_is_still_exact() {
    let folder = tempfile::tempdir().unwrap();
    let mut simulation = simulation("dike", 2);
    write_block(&simulation.block, folder.path()).unwrap();
    let read = read_block(folder.path()).unwrap();
    assert!(read.set_aside.is_empty(), "{}", read.set_aside);
    simulation.block = read.block;
    assert_exact(&simulation, 1.0);
    let images = |block: &Block| block.images.iter().map(|image| (image.time_s, image.gnss)).collect::<Vec<_>>();
    assert_eq!(images(&simulation.block), images(&simulation.truth));
}
