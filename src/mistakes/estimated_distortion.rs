//! The distortion that tie points estimate against the recorded one. Rough approximate orientations hide from the rays
//! that measurements have no distortion, or one of the opposite sign; a network of the tie points shows it.

use super::{BEYOND, Mistake};
use crate::block::edit::{Change, Edit};
use crate::camera::{Camera, Interior, K1, P2, fraser};
use crate::math::statistics::rms;

/// Distortions that differ by less, px, are two calibrations of one camera.
const LEAST_PX: f64 = 1.0;

/// How the estimated distortion differs from the recorded one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimated {
    /// There is none.
    None,
    /// It has the opposite sign.
    Opposite,
}

/// What tie points say of the distortion of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Which.
    pub estimated: Estimated,
    /// RMS of estimated less recorded distortion over the tie points, px.
    pub own: f64,
    /// The same once the mistake is undone, px.
    pub undone: f64,
}

/// Compares the estimated interior with the recorded one at image points `at` (px); `None` where they agree, or differ
/// in another way.
pub fn judge(recorded: &Interior, estimated: &Interior, at: &[[f64; 2]]) -> Option<Found> {
    let opposite = opposite(recorded);
    let mut none = *recorded;
    none[K1..].fill(0.0);
    // Without the focal length and the principal point, which follow the orientation.
    let differs = |other: &Interior| {
        let of = |[x, y]: &[f64; 2]| {
            let [own, other] = [estimated, other].map(|interior| added(interior, [*x, *y]));
            [own[0] - other[0], own[1] - other[1]]
        };
        rms(&at.iter().flat_map(of).collect::<Vec<f64>>())
    };
    let own = differs(recorded);
    let tried = [(Estimated::None, differs(&none)), (Estimated::Opposite, differs(&opposite))];
    let (which, undone) = tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    // What is left once the mistake is undone has to be that of two calibrations. Beside a recorded distortion that is
    // far too large, no distortion is nearer to the estimate, without being it. Not a number compares as false.
    (own > LEAST_PX && undone < LEAST_PX && own > BEYOND * undone).then_some(Found { estimated: which, own, undone })
}

/// The recorded interior with the distortion of the opposite sign.
fn opposite(recorded: &Interior) -> Interior {
    let mut opposite = *recorded;
    opposite[K1..=P2].iter_mut().for_each(|own| *own = -*own);
    opposite
}

/// What the distortion adds to an ideal image point of the recorded camera, px; the point is taken by its direction.
fn added(interior: &Interior, [x, y]: [f64; 2]) -> [f64; 2] {
    let [u, v] = fraser::distort(interior, x, y);
    [u - x, v - y]
}

impl Found {
    /// The mistake of a camera. `tables`: measurements without distortion; `images`: names of the images of the camera,
    /// none where it is the only one.
    pub fn mistake(&self, camera: &Camera, tables: &[&str], images: &[String]) -> Mistake {
        let evidence = format!(
            "The distortion that they estimate differs from it by {:.1} px; once that is undone, by {:.1} px (RMS over \
             the tie points).",
            self.own, self.undone
        );
        match self.estimated {
            Estimated::None => {
                let sentence = format!(
                    "Tie points: measured in undistorted images, and the camera ({}) has the distortion of the \
                     original ones. {evidence}",
                    camera.id
                );
                let remedy = format!(
                    "Measure in the original images, or apply the distortion to x and y ({}). Set it to zero if this \
                     is not the camera of these images.",
                    tables.join(", ")
                );
                let distort = |table: &&str| {
                    let edit = Edit::all(table, Change::Distort { interior: camera.interior });
                    if images.is_empty() { edit } else { edit.of("image", images) }
                };
                Mistake::new("undistorted", "ties", sentence, remedy).undone_by(tables.iter().map(distort).collect())
            }
            Estimated::Opposite => {
                let sentence = format!(
                    "Camera ({}): the distortion has the opposite sign of what the tie points estimate. {evidence}",
                    camera.id
                );
                let remedy = "Change the signs of k1, k2, k3, p1, p2 (they act from the ideal to the measured point).";
                let names = crate::camera::PARAMETERS;
                let set = |k: usize| {
                    let value = format!("{:e}", -camera.interior[k]);
                    let change = Change::Set { column: names[k].into(), value };
                    Edit::all("block.toml", change).of("id", std::slice::from_ref(&camera.id))
                };
                let edits = (K1..=P2).filter(|k| camera.interior[*k] != 0.0).map(set).collect();
                Mistake::new("distortion-sign", "camera", sentence, remedy.into()).undone_by(edits)
            }
        }
        .of(images.to_vec())
        .tested(f64::NAN, f64::NEG_INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{F, PPX, PPY};

    const RECORDED: Interior = [3000.0, 2010.0, 1490.0, 2010.0, 1490.0, -2e-9, 1e-17, 0.0, 1e-8, -1e-8, 0.0, 0.0];

    fn at() -> Vec<[f64; 2]> {
        (0..100).map(|k| [f64::from(k % 10) * 440.0, f64::from(k / 10) * 330.0]).collect()
    }

    #[test]
    fn no_distortion_and_the_opposite_one_are_told() {
        let mut none = RECORDED;
        none[F] *= 1.01;
        none[PPX] += 5.0;
        none[PPY] -= 3.0;
        none[K1..].fill(0.0);
        let found = judge(&RECORDED, &none, &at()).expect("no distortion");
        assert!(found.estimated == Estimated::None && found.own > LEAST_PX && found.undone < 1e-9, "{found:?}");
        let found = judge(&RECORDED, &opposite(&RECORDED), &at()).expect("the opposite one");
        assert_eq!(found.estimated, Estimated::Opposite);
    }

    #[test]
    fn another_calibration_is_no_mistake() {
        let mut other = RECORDED;
        other[K1] *= 0.8;
        assert_eq!(judge(&RECORDED, &RECORDED, &at()), None);
        assert_eq!(judge(&RECORDED, &other, &at()), None);
        // A recorded distortion that is twelve times too large: the estimate is nearer to none, and is not none.
        let mut strong = RECORDED;
        strong[K1..=P2].iter_mut().for_each(|own| *own *= 12.0);
        assert_eq!(judge(&strong, &RECORDED, &at()), None);
        other[K1] = f64::NAN;
        assert_eq!(judge(&RECORDED, &other, &at()), None);
        let mut weak = RECORDED;
        weak[K1..].iter_mut().for_each(|own| *own *= 1e-2);
        assert_eq!(judge(&weak, &opposite(&weak), &at()), None, "less than a pixel");
    }
}
