//! Measurements in undistorted images beside a camera with distortion.

use super::files::Camera;
use super::measurements::rewrite_in;
use super::*;

pub(super) static KINDS: [Kind; 1] = [Kind {
    id: "undistorted",
    subjects: &["ties"],
    summary: "tie points measured in undistorted images, beside the camera of the original ones",
    parameters: &[parameter("marks", "", DefaultValue::Flag(false), "1: the marks, too")],
    act: |files, values| {
        let both: &[&'static str] = &["ties.csv", "marks.csv"];
        let tables = if values.flag("marks") { both } else { &both[..1] };
        rewrite_in(files, tables, |_| true, undistorted)?;
        Ok(Vec::new())
    },
}];

/// Steps of the inversion at most; a lens of a few per cent of distortion needs ten.
const STEPS: usize = 200;
/// Change of the last step, px.
const PRECISION_PX: f64 = 1e-10;

/// What the lens adds to an ideal image point, as CONVENTIONS.md has it.
fn distortion(camera: &Camera, [u, v]: [f64; 2]) -> [f64; 2] {
    let [_, _, _, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = camera.interior;
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    [
        du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv,
        dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv,
    ]
}

/// The ideal image point whose distorted one was measured: `u <- x - distortion(u)` until it stays.
fn undistorted(camera: &Camera, [x, y]: [f64; 2]) -> Result<[f64; 2]> {
    let mut ideal = [x, y];
    for _ in 0..STEPS {
        let [dx, dy] = distortion(camera, ideal);
        let next = [x - dx, y - dy];
        let step = (next[0] - ideal[0]).hypot(next[1] - ideal[1]);
        ideal = next;
        if step < PRECISION_PX {
            return Ok(ideal);
        }
    }
    bail!("camera `{}`: the distortion at {x}, {y} px cannot be inverted", camera.id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distorting_again_gives_the_measurement() {
        let interior = [5510.0, 2539.0, 1945.0, 2537.0, 1955.0, -9e-9, 4e-16, -1e-23, 3e-8, -2e-8, 2e-4, -1e-4];
        let camera = Camera { id: "cam".into(), size: [5120.0, 3840.0], pixel_mm: None, interior };
        for measured in [[0.0, 0.0], [5120.0, 3840.0], [2537.0, 1955.0], [4000.0, 300.0]] {
            let ideal = undistorted(&camera, measured).expect("an ideal point");
            let [dx, dy] = distortion(&camera, ideal);
            assert!((ideal[0] + dx - measured[0]).hypot(ideal[1] + dy - measured[1]) < 1e-8, "{measured:?}");
        }
        let corner = undistorted(&camera, [0.0, 0.0]).expect("an ideal point");
        assert!(corner[0].hypot(corner[1]) > 100.0, "{corner:?}");
    }

    #[test]
    fn a_distortion_without_inverse_is_refused() {
        let mut interior = [0.0; 12];
        interior[5] = -1e-5;
        let camera = Camera { id: "cam".into(), size: [5120.0, 3840.0], pixel_mm: None, interior };
        assert!(undistorted(&camera, [5000.0, 3000.0]).is_err());
    }
}
