//! The study's homothetic error: every image point moves away from a centre by a constant part of its distance, `b =
//! lambda CQ`.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "homothety",
    summary: "image points moved away from a centre by a part of their distance (the study's global error)",
    parameters: &[
        parameter("lambda", "1", DefaultValue::Number(0.005), "part of the distance"),
        parameter(
            "centre",
            "",
            DefaultValue::Choice("pp", &["pp", "dc", "xy"]),
            "principal point, centre of distortion, or cx, cy",
        ),
        parameter("cx", "px", DefaultValue::Optional("needs centre=xy"), "centre"),
        parameter("cy", "px", DefaultValue::Optional("needs centre=xy"), "centre"),
    ],
    prepare,
};

struct Homothety {
    lambda: f64,
    /// By camera.
    centres: Vec<[f64; 2]>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let given = match (values.word("centre"), values.optional("cx"), values.optional("cy")) {
        ("xy", Some(x), Some(y)) => Some([x, y]),
        ("xy", _, _) => anyhow::bail!("centre=xy needs `cx` and `cy`"),
        (_, None, None) => None,
        _ => anyhow::bail!("`cx` and `cy` need centre=xy"),
    };
    let first = if values.word("centre") == "dc" { 3 } else { 1 };
    let of = |camera: &Camera| given.unwrap_or([camera.interior[first], camera.interior[first + 1]]);
    let lambda = values.number("lambda");
    unless(lambda == 0.0, Homothety { lambda, centres: setting.world.cameras.iter().map(of).collect() })
}

impl Action for Homothety {
    fn sensor(&self, camera: usize, _interior: &Interior, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let [cx, cy] = self.centres[camera];
        Some([x + self.lambda * (x - cx), y + self.lambda * (y - cy)])
    }
}
