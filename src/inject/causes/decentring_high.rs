//! Decentring of a higher order than the camera has. A definition: Brown's form, where the displacement along the axis
//! of the decentring is three times that across it, with `r^4` in the place of `r^2`.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "decentring-high",
    summary: "decentring that grows with the fourth power of the radius (a definition, no cause behind it)",
    parameters: &[
        parameter(
            "corner",
            "px",
            DefaultValue::Number(2.0),
            "displacement along the axis at the radius of the farthest corner",
        ),
        parameter("direction_deg", "deg", DefaultValue::Number(0.0), "axis of the decentring, from x towards y"),
    ],
    prepare,
};

struct DecentringHigh {
    corner: f64,
    axis: [f64; 2],
    cameras: Vec<([f64; 2], f64)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let corner = setting.values.number("corner");
    let (sin, cos) = setting.values.number("direction_deg").to_radians().sin_cos();
    let of = |camera: &Camera| ([camera.interior[DCX], camera.interior[DCY]], corner_radius(camera));
    let cameras = setting.world.cameras.iter().map(of).collect();
    unless(corner == 0.0, DecentringHigh { corner, axis: [cos, sin], cameras })
}

impl Action for DecentringHigh {
    fn sensor(&self, camera: usize, _interior: &Interior, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let ([cx, cy], corner_radius) = self.cameras[camera];
        let (dx, dy) = ((x - cx) / corner_radius, (y - cy) / corner_radius);
        let [ax, ay] = self.axis;
        let r2 = dx * dx + dy * dy;
        // Tangential profile: (r^2 a + 2 (a . d) d) / 3 has length 1 for d = a.
        let along = ax * dx + ay * dy;
        let size = self.corner * r2 / 3.0;
        Some([x + size * (r2 * ax + 2.0 * along * dx), y + size * (r2 * ay + 2.0 * along * dy)])
    }
}
