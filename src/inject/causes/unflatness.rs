//! A sensor that is no plane: the ray behind the lens meets its surface, not the focal plane.
//!
//! The surface `z(x, y)` (px out of the focal plane, away from the lens) is a saddle, a bend and a bump. The ray
//! crosses the focal plane at the ideal pixel, with the slope of the line from the principal point, and goes on until
//! it meets the surface.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "unflatness",
    summary: "sensor surface out of the focal plane (saddle, bend, bump), met by the ray",
    parameters: &[
        parameter("saddle", "px", DefaultValue::Number(3.0), "height of the saddle at the corners: u v"),
        parameter(
            "bend",
            "px",
            DefaultValue::Number(3.0),
            "height of a cylindrical bend at the left and right edge: u^2",
        ),
        parameter("bump", "px", DefaultValue::Number(0.0), "height of a Gaussian bump"),
        parameter("bump_u", "1", DefaultValue::Number(0.3), "its place, -1 at the left edge, 1 at the right"),
        parameter("bump_v", "1", DefaultValue::Number(0.3), "its place, -1 at the top, 1 at the bottom"),
        parameter("bump_sigma", "1", DefaultValue::Number(0.4), "its radius in units of half the width"),
    ],
    prepare,
};

/// Steps of the intersection; each gains the slope of the surface, some 1e-3.
const STEPS: usize = 50;
/// px; below the rounding of the sum of a coordinate and its shift.
const TOLERANCE_PX: f64 = 1e-12;

struct Unflatness {
    saddle: f64,
    bend: f64,
    bump: f64,
    place: [f64; 2],
    sigma: f64,
    /// Half width and half height of each camera, px.
    halves: Vec<[f64; 2]>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let half = |camera: &Camera| [0.5 * f64::from(camera.width_px), 0.5 * f64::from(camera.height_px)];
    let surface = Unflatness {
        saddle: values.number("saddle"),
        bend: values.number("bend"),
        bump: values.number("bump"),
        place: [values.number("bump_u"), values.number("bump_v")],
        sigma: values.positive("bump_sigma")?,
        halves: setting.world.cameras.iter().map(half).collect(),
    };
    unless(surface.saddle == 0.0 && surface.bend == 0.0 && surface.bump == 0.0, surface)
}

impl Unflatness {
    fn height(&self, [half_width, half_height]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
        let (u, v) = (x / half_width - 1.0, y / half_height - 1.0);
        // Distances of the bump are measured in half widths both ways, so that it is round.
        let (du, dv) = (u - self.place[0], (v - self.place[1]) * half_height / half_width);
        let bump = (-(du * du + dv * dv) / (2.0 * self.sigma * self.sigma)).exp();
        self.saddle * u * v + self.bend * u * u + self.bump * bump
    }
}

impl Action for Unflatness {
    fn sensor(&self, camera: usize, interior: &Interior, xy: [f64; 2]) -> Option<[f64; 2]> {
        let [f, ppx, ppy, ..] = *interior;
        let slope = [(xy[0] - ppx) / f, (xy[1] - ppy) / f];
        let mut on_surface = xy;
        for _ in 0..STEPS {
            let z = self.height(self.halves[camera], on_surface);
            let next = [xy[0] + slope[0] * z, xy[1] + slope[1] * z];
            let moved = (next[0] - on_surface[0]).hypot(next[1] - on_surface[1]);
            on_surface = next;
            if moved <= TOLERANCE_PX {
                return Some(on_surface);
            }
        }
        None
    }
}
