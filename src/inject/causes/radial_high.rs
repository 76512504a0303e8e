//! Radial distortion of a higher order than the camera has. A definition: `r^order` along the radius from the centre of
//! distortion.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "radial-high",
    summary: "radial distortion that grows with the ninth power of the radius (a definition, no cause behind it)",
    parameters: &[
        parameter("corner", "px", DefaultValue::Number(2.0), "displacement at the farthest corner, outwards"),
        parameter("order", "1", DefaultValue::Number(9.0), "power of the radius"),
    ],
    prepare,
};

struct RadialHigh {
    corner: f64,
    order: f64,
    /// By camera: centre and radius of the corner, px.
    cameras: Vec<([f64; 2], f64)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (corner, order) = (setting.values.number("corner"), setting.values.positive("order")?);
    let of = |camera: &Camera| ([camera.interior[DCX], camera.interior[DCY]], corner_radius(camera));
    unless(corner == 0.0, RadialHigh { corner, order, cameras: setting.world.cameras.iter().map(of).collect() })
}

impl Action for RadialHigh {
    fn sensor(&self, camera: usize, _interior: &Interior, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let ([cx, cy], corner_radius) = self.cameras[camera];
        let (dx, dy) = (x - cx, y - cy);
        let r = dx.hypot(dy);
        if r == 0.0 {
            return Some([x, y]);
        }
        let shift = self.corner * (r / corner_radius).powf(self.order) / r;
        Some([x + shift * dx, y + shift * dy])
    }
}
