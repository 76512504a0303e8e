//! Distortion of normalised coordinates, or of millimetres, in place of pixels.

use super::focal;
use super::tables::{Camera, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// A term that moves a corner by more than this many half diagonals is none of pixels: fisheyes reach one, and
/// millimetres read as pixels 100.
const ABSURD: f64 = 5.0;
/// The same for decentring, whose terms are below a hundredth in real lenses.
const ABSURD_DECENTRING: f64 = 1.0;
/// A corner moves by less than this share of its distance from the centre, in a lens that a central projection
/// describes at all.
const PLAUSIBLE: f64 = 0.6;
/// Half the diagonal of the smallest sensor that is flown, mm.
const SMALLEST_MM: f64 = 3.0;

/// Largest term of the radial distortion at a radius, as a share of it.
fn radial(camera: &Camera, radius: f64) -> f64 {
    let [k1, k2, k3] = camera.radial;
    let r2 = radius * radius;
    [k1 * r2, k2 * r2 * r2, k3 * r2 * r2 * r2].iter().map(|term| term.abs()).fold(0.0, f64::max)
}

fn decentring(camera: &Camera, radius: f64) -> f64 {
    let [p1, p2] = camera.decentring;
    p1.hypot(p2) * radius
}

/// Is the distortion plausible if lengths have a unit in which half the diagonal is so long?
fn is_plausible(camera: &Camera, half_diagonal: f64) -> bool {
    radial(camera, half_diagonal) < PLAUSIBLE && decentring(camera, half_diagonal) < PLAUSIBLE
}

/// Focal length, px, by which the coordinates were divided; `None` where they may as well be millimetres. (What is
/// plausible of millimetres is plausible of normalised coordinates, too: a focal length has several millimetres.)
fn normalised_by(camera: &Camera) -> Option<f64> {
    let h = camera.half_diagonal();
    let millimetres = camera.per_mm().map_or(SMALLEST_MM, |per_mm| h / per_mm);
    focal::in_pixels(camera).filter(|focal| is_plausible(camera, h / focal) && !is_plausible(camera, millimetres))
}

/// Distortions that are no pixels.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    let is_absurd = |camera: &&Camera| {
        let h = camera.half_diagonal();
        radial(camera, h) > ABSURD || decentring(camera, h) > ABSURD_DECENTRING
    };
    tables.cameras.iter().filter(is_absurd).map(mistake).collect()
}

fn mistake(camera: &Camera) -> Mistake {
    let h = camera.half_diagonal();
    let size = radial(camera, h).max(decentring(camera, h));
    let (words, remedy) = if normalised_by(camera).is_some() {
        (
            "coordinates that are divided by the focal length",
            "Divide k1, k2, k3 by f^2, f^4, f^6, and p1, p2 by f, with f in pixels",
        )
    } else {
        (
            "coordinates that are divided by the focal length, or for millimetres",
            "Convert them to px^-2, px^-4, px^-6 (k1, k2, k3) and px^-1 (p1, p2)",
        )
    };
    let sentence = format!(
        "Camera {}: the distortion would move a corner of the image by {size:.3e} times half its diagonal; the \
         coefficients are for {words}.",
        camera.id
    );
    Mistake::new("distortion-unit", "camera", sentence, format!("{remedy} (block.toml)."))
        .of(vec![camera.id.clone()])
        .sized(size, None, "1")
        .undone_by(edits(camera))
}

fn edits(camera: &Camera) -> Vec<Edit> {
    let Some(focal) = normalised_by(camera) else { return Vec::new() };
    let powers = [("k1", 2), ("k2", 4), ("k3", 6), ("p1", 1), ("p2", 1)];
    let edit = |(column, power): (&str, i32)| {
        Edit::all("block.toml", Change::times(column, focal.powi(-power))).of("id", std::slice::from_ref(&camera.id))
    };
    powers.into_iter().map(edit).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    fn judged(radial: [f64; 3], decentring: [f64; 2], pixel_um: Option<f64>) -> Vec<Mistake> {
        let mut tables = made::tables();
        let own = &mut tables.cameras[0];
        (own.radial, own.decentring, own.pixel_um) = (radial, decentring, pixel_um);
        judge(&tables)
    }

    #[test]
    fn normalised_coefficients_are_divided_by_powers_of_the_focal_length() {
        for pixel_um in [Some(2.0), None] {
            let found = judged([-0.15, 0.08, -0.01], [1e-3, -5e-4], pixel_um);
            assert_eq!(found.len(), 1, "{found:?}");
            assert_eq!(found[0].mend.len(), 5);
            assert_eq!(found[0].mend[0].change, Change::times("k1", 3000f64.powi(-2)));
            assert_eq!(found[0].mend[3].change, Change::times("p1", 1.0 / 3000.0));
        }
    }

    #[test]
    fn what_may_be_millimetres_is_named_and_not_mended() {
        // 5 mm from the centre 1 % of distortion; normalised it would be 0.03 %.
        let found = judged([4e-4, 0.0, 0.0], [0.0, 0.0], Some(2.0));
        assert_eq!((found.len(), found[0].mend.len()), (1, 0));
    }

    #[test]
    fn decentring_alone_is_seen() {
        assert_eq!(judged([0.0; 3], [2e-3, 0.0], None).len(), 1);
    }

    #[test]
    fn lenses_are_right() {
        let strong = [-6e-8, 1.5e-14, -1e-21];
        for radial in [[0.0; 3], [-1e-8, 2e-16, 0.0], strong, [f64::NAN, 0.0, 0.0]] {
            assert!(judged(radial, [2e-6, 1e-6], Some(2.0)).is_empty(), "{radial:?}");
        }
    }
}
