//! The study's gradually varied focal length: `f(n) = f (1 + b)^n`, n the image's place in the table, from 0.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "focal-growth",
    summary: "focal length that grows from image to image, in the order of the table (the study's gradual focal \
              length)",
    parameters: &[parameter("b", "1", DefaultValue::Number(1e-5), "relative growth per image")],
    prepare,
};

struct FocalGrowth {
    b: f64,
    images: usize,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let b = setting.values.number("b");
    ensure!(b > -1.0, "parameter `b` must be above -1, it is {b}");
    unless(b == 0.0, FocalGrowth { b, images: setting.world.images.len() })
}

impl FocalGrowth {
    fn factor(&self, image: usize) -> f64 {
        (1.0 + self.b).powf(image as f64)
    }
}

impl Action for FocalGrowth {
    fn interior(&self, image: usize, interior: &mut Interior) {
        interior[F] *= self.factor(image);
    }

    fn notes(&self) -> Vec<(String, String)> {
        vec![("f of the last image / f of the first".into(), self.factor(self.images.saturating_sub(1)).to_string())]
    }
}
