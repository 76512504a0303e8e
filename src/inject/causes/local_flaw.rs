//! The study's local error: `b = lambda exp(-|CQ|^2 / sigma^2) CQ / |CQ|`. (As printed there the exponent lacks its
//! sign and the error grows without bound.) Its direction jumps at the centre; the smooth variant has `CQ / sigma` in
//! the place of the unit vector.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "local-flaw",
    summary: "image points pushed away from a place on the sensor, fading with distance (the study's local error)",
    parameters: &[
        parameter("centre_x", "px", DefaultValue::Number(1000.0), "place"),
        parameter("centre_y", "px", DefaultValue::Number(1000.0), "place"),
        parameter("lambda", "px", DefaultValue::Number(10.0), "size"),
        parameter("sigma", "px", DefaultValue::Number(200.0), "distance at which it has faded to 1/e"),
        parameter("smooth", "", DefaultValue::Flag(false), "1: proportional to the distance near the centre"),
    ],
    prepare,
};

struct LocalFlaw {
    centre: [f64; 2],
    lambda: f64,
    sigma: f64,
    smooth: bool,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let flaw = LocalFlaw {
        centre: [values.number("centre_x"), values.number("centre_y")],
        lambda: values.number("lambda"),
        sigma: values.positive("sigma")?,
        smooth: values.flag("smooth"),
    };
    unless(flaw.lambda == 0.0, flaw)
}

impl Action for LocalFlaw {
    fn sensor(&self, _camera: usize, _interior: &Interior, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (qx, qy) = (x - self.centre[0], y - self.centre[1]);
        let distance = qx.hypot(qy);
        if distance == 0.0 {
            // The centre itself has no direction to go.
            return Some([x, y]);
        }
        let part = distance / self.sigma;
        let size = self.lambda * (-part * part).exp() / if self.smooth { self.sigma } else { distance };
        Some([x + size * qx, y + size * qy])
    }
}
