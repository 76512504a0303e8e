//! Width and height of the sensor against where measurements lie.

use super::scene::Scene;
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// Share of a camera's measurements beside the sensor that is no chance: false matches lie within images, too.
const BESIDE: f64 = 0.02;
/// A measurement at the border of an image may lie that far beside it, px.
const BORDER: f64 = 1.0;
/// Measurements of a camera below which nothing is said.
const FEWEST: usize = 50;

/// Cameras whose sides are exchanged while their other numbers are right: many measurements lie beside the sensor,
/// none beside the turned one.
pub fn sides_exchanged(scene: &Scene) -> Vec<Mistake> {
    (0..scene.cameras.len())
        .filter(|camera| is_exchanged(scene, *camera))
        .map(|camera| mistake(scene, camera))
        .collect()
}

fn is_exchanged(scene: &Scene, camera: usize) -> bool {
    let of = &scene.cameras[camera];
    let [width, height] = [f64::from(of.width_px), f64::from(of.height_px)];
    let (mut all, mut beside, mut beside_turned) = (0, 0, 0);
    for sight in scene.sights().filter(|sight| scene.views[sight.view].camera == camera) {
        let [x, y] = sight.xy;
        let lies_in = |width: f64, height: f64| {
            (-BORDER..=width + BORDER).contains(&x) && (-BORDER..=height + BORDER).contains(&y)
        };
        all += 1;
        beside += usize::from(!lies_in(width, height));
        beside_turned += usize::from(!lies_in(height, width));
    }
    all >= FEWEST && beside as f64 > BESIDE * all as f64 && beside_turned == 0
}

fn mistake(scene: &Scene, camera: usize) -> Mistake {
    let of = &scene.cameras[camera];
    let sentence = format!(
        "Camera {}: width_px and height_px ({} x {}) are exchanged; tie points lie beside this sensor, and all lie \
         within {} x {}.",
        of.id, of.width_px, of.height_px, of.height_px, of.width_px
    );
    let edit =
        Edit::all("block.toml", Change::ExchangeColumns { columns: ["width_px", "height_px"].map(String::from) });
    Mistake::new("sensor-size", "camera", sentence, "Exchange width_px and height_px of block.toml.".into())
        .of(vec![of.id.clone()])
        .tested(f64::NAN, f64::NEG_INFINITY)
        .undone_by(vec![edit.of("id", std::slice::from_ref(&of.id))])
}

#[cfg(test)]
mod tests {
    use super::super::made;
    use super::*;

    #[test]
    fn exchanged_sides_are_named_and_right_ones_are_not() {
        let mut scene = made::scene();
        assert!(sides_exchanged(&scene).is_empty());
        let camera = &mut scene.cameras[0];
        std::mem::swap(&mut camera.width_px, &mut camera.height_px);
        let found = sides_exchanged(&scene);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].kind.as_str(), found[0].mend.len()), ("sensor-size", 1));
    }
}
