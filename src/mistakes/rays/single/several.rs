//! Two cameras under one name: the images fall into two parts with principal points of their own.

use super::super::scene::Scene;
use super::shifted::{MOST_SHIFTED, Shifted};
use crate::math::statistics::median;
use crate::mistakes::{BEYOND, Mistake, price};

/// Principal points of two cameras differ by more than this, px; those of one camera by less.
const LEAST_APART_PX: f64 = 10.0;
/// Images of the second camera at least: fewer do not show how far they spread.
const FEWEST: usize = 5;
/// Rounds in which images change sides: most divisions are found in two.
const ROUNDS: usize = 10;

/// Images of a second camera under the name of the first, by the shifts of their measurements. Few such images are
/// cropped.
pub fn cameras(scene: &Scene, shifted: &[Shifted<'_>], alpha: f64) -> Vec<Mistake> {
    let of_camera = |camera: usize| -> Option<Mistake> {
        let is_own = |s: &&Shifted<'_>| scene.views[s.view].camera == camera && s.sigma < LEAST_APART_PX;
        let own: Vec<&Shifted<'_>> = shifted.iter().filter(is_own).collect();
        let shifts: Vec<[f64; 2]> = own.iter().map(|shifted| shifted.shift).collect();
        let second = divided(&shifts)?;
        let names: Vec<String> = own
            .iter()
            .zip(&second)
            .filter(|(_, second)| **second)
            .map(|(shifted, _)| scene.views[shifted.view].name.clone())
            .collect();
        let drop: f64 = own.iter().map(|shifted| shifted.drop).sum();
        let enough = names.len() >= FEWEST
            && names.len() as f64 >= MOST_SHIFTED * own.len() as f64
            && drop > price(alpha, scene.views.len());
        enough.then(|| said(&scene.cameras[camera].id, names, apart(&shifts, &second)))
    };
    (0..scene.cameras.len()).filter_map(of_camera).collect()
}

/// Which shifts belong to the smaller of two parts that lie ten times further apart than they spread; `None` where they
/// are one.
fn divided(shifts: &[[f64; 2]]) -> Option<Vec<bool>> {
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let middle = of_part(shifts, |_| true);
    let farthest =
        |from: [f64; 2]| shifts.iter().copied().max_by(|a, b| distance(*a, from).total_cmp(&distance(*b, from)));
    let first = farthest(middle)?;
    let mut centres = [first, farthest(first)?];
    let mut second: Vec<bool> = Vec::new();
    for _ in 0..ROUNDS {
        second = shifts.iter().map(|shift| distance(*shift, centres[1]) < distance(*shift, centres[0])).collect();
        centres = [false, true].map(|part| of_part(shifts, |k| second[k] == part));
    }
    let spread = |part: bool| {
        let own = shifts.iter().zip(&second).filter(|(_, own)| **own == part);
        median(&own.map(|(shift, _)| distance(*shift, centres[usize::from(part)])).collect::<Vec<_>>())
    };
    let between = distance(centres[0], centres[1]);
    let is_apart = between > LEAST_APART_PX && between > BEYOND * spread(false).max(spread(true));
    if 2 * second.iter().filter(|second| **second).count() > second.len() {
        second.iter_mut().for_each(|second| *second = !*second);
    }
    is_apart.then_some(second)
}

/// Median of a part by coordinate.
fn of_part(shifts: &[[f64; 2]], is_in: impl Fn(usize) -> bool) -> [f64; 2] {
    let axis = |axis: usize| {
        let own = shifts.iter().enumerate().filter(|(k, _)| is_in(*k));
        median(&own.map(|(_, shift)| shift[axis]).collect::<Vec<_>>())
    };
    [axis(0), axis(1)]
}

fn apart(shifts: &[[f64; 2]], second: &[bool]) -> [f64; 2] {
    let [a, b] = [false, true].map(|part| of_part(shifts, |k| second[k] == part));
    [b[0] - a[0], b[1] - a[1]]
}

fn said(camera: &str, names: Vec<String>, [dx, dy]: [f64; 2]) -> Mistake {
    let sentence = format!(
        "Camera {camera} is two cameras: the principal point of {} images lies {:.1}, {:.1} px (x, y) beside that of the others.",
        names.len(),
        -dx,
        -dy
    );
    let remedy = "Give these images a camera of their own (camera of images.csv, [[camera]] of block.toml).".into();
    Mistake::new("several-cameras", "camera", sentence, remedy).of(names).tested(f64::NAN, f64::NEG_INFINITY).sized(
        dx.hypot(dy),
        None,
        "px",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> [f64; 2] {
        let k = k as f64;
        [0.8 * (3.1 * k).sin(), 0.8 * (5.3 * k).cos()]
    }

    #[test]
    fn two_parts_are_told_from_one() {
        let two: Vec<[f64; 2]> = (0..30)
            .map(|k| {
                let [x, y] = noise(k);
                if k % 3 == 0 { [x + 25.0, y - 12.0] } else { [x, y] }
            })
            .collect();
        let second = divided(&two).expect("two parts");
        assert!((0..30).all(|k| second[k] == (k % 3 == 0)), "{second:?}");
        let [dx, dy] = apart(&two, &second);
        assert!((dx - 25.0).abs() < 1.0 && (dy + 12.0).abs() < 1.0);

        let one: Vec<[f64; 2]> = (0..30).map(noise).collect();
        assert_eq!(divided(&one), None);
        let wide: Vec<[f64; 2]> = (0..30).map(|k| noise(k).map(|n| 30.0 * n)).collect();
        assert_eq!(divided(&wide), None, "shifts that nothing determines spread as they lie apart");
        assert_eq!(divided(&[]), None);
    }
}
