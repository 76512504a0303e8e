//! Which distortion a file means: its text says "classical Brown" and leaves open the direction, and which of P1 and P2
//! is which.
//!
//! Coefficients act on coordinates normalised by the focal length. All readings are tried on the measurements, where
//! any has coordinates in space, and the one with the least residuals is taken.

use super::super::fit::{Fit, Formula, fit_fraser};
use crate::camera::Interior;

/// A camera as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FileCamera {
    /// Name of its photogroup.
    pub name: String,
    /// Width and height, px.
    pub size: [u32; 2],
    /// Focal length, px.
    pub f: f64,
    /// Principal point, px from the outer corner of the top-left pixel.
    pub pp: [f64; 2],
    /// `K1, K2, K3, P1, P2`.
    pub distortion: [f64; 5],
}

/// A reading of the coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Reading {
    /// From the ideal point to the distorted one, as ours.
    pub forward: bool,
    /// `P1` goes with `r^2 + 2 x^2` in x, as in ours; else with `2 x y`, as in OpenCV.
    pub as_fraser: bool,
}

/// Every reading; the first is what this program writes.
pub(super) const READINGS: [Reading; 4] = [
    Reading { forward: true, as_fraser: true },
    Reading { forward: true, as_fraser: false },
    Reading { forward: false, as_fraser: true },
    Reading { forward: false, as_fraser: false },
];

impl Reading {
    /// In words.
    pub(super) fn describe(self) -> String {
        let direction = if self.forward { "from object to image" } else { "from image to object" };
        let order = if self.as_fraser { "P1 along x" } else { "P1 along y, as in OpenCV" };
        format!("distortion {direction}, {order}")
    }
}

impl FileCamera {
    /// Does it distort at all?
    pub(super) fn distorts(&self) -> bool {
        self.distortion.iter().any(|k| *k != 0.0)
    }

    /// The Fraser camera of a reading: exact from object to image, else the nearest. `None` where none comes near.
    pub(super) fn fraser(&self, reading: Reading) -> Option<Fit<Interior>> {
        let (f, [ppx, ppy]) = (self.f, self.pp);
        let [k1, k2, k3, p1, p2] = self.distortion;
        let [p1, p2] = if reading.as_fraser { [p1, p2] } else { [p2, p1] };
        let radial = [k1 / f.powi(2), k2 / f.powi(4), k3 / f.powi(6)];
        let forward = [f, ppx, ppy, ppx, ppy, radial[0], radial[1], radial[2], p1 / f, p2 / f, 0.0, 0.0];
        if reading.forward || !self.distorts() {
            return Some(Fit { parameters: forward, rms_px: 0.0, max_px: 0.0 });
        }
        let backward = |[x, y]: [f64; 2]| {
            let [u, v] = crate::camera::fraser::distort(&forward, x, y);
            Some([(u - ppx) / f, (v - ppy) / f])
        };
        let straight = [f, ppx, ppy, ppx, ppy, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        fit_fraser(&Formula::Backward(&backward), self.size, &straight, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::fraser::{distort, project};

    #[test]
    fn every_reading_is_another_camera() {
        let camera = FileCamera {
            name: "g".into(),
            size: [4000, 3000],
            f: 3600.0,
            pp: [2010.0, 1490.0],
            distortion: [-0.03, 0.01, 0.0, 1e-3, -5e-4],
        };
        let corner = |reading| project(&camera.fraser(reading).unwrap().parameters, [0.5, 0.4, 1.0]).unwrap();
        let points = READINGS.map(corner);
        for (k, a) in points.iter().enumerate() {
            assert!(points[..k].iter().all(|b| (a[0] - b[0]).hypot(a[1] - b[1]) > 1.0), "{points:?}");
        }
        // Backward: the formula takes the image point to the ray.
        let fit = camera.fraser(READINGS[2]).unwrap();
        let [x, y] = project(&fit.parameters, [0.5, 0.4, 1.0]).unwrap();
        let forward = camera.fraser(READINGS[0]).unwrap().parameters;
        let [u, v] = distort(&forward, x, y);
        assert!((u - 2010.0 - 1800.0).hypot(v - 1490.0 - 1440.0) <= 2.0 * fit.max_px.max(1e-9), "{u} {v} {fit:?}");
    }
}
