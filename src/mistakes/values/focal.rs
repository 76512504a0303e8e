//! Focal length in another unit than pixels.

use super::tables::{Camera, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// Largest focal length as a share of the sensor that a list of normalised cameras has: a telephoto lens of 19 degrees.
const NORMALISED: f64 = 3.0;
/// Largest number that is read as millimetres: the lenses of aerial cameras end at 300 mm.
const LONGEST_MM: f64 = 600.0;
/// Smallest one: the lenses of telephones have 2 mm.
const SHORTEST_MM: f64 = 1.0;

/// Unit of a focal length that cannot be pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Shares of the longer side of the sensor.
    Share,
    /// Millimetres.
    Millimetres,
}

/// Unit of the focal length; `None` where it may be pixels, or where nothing fits.
pub fn unit(camera: &Camera) -> Option<Unit> {
    let focal = camera.focal;
    // A sensor of a few pixels says nothing; NaN is refused here, too.
    if !(focal > 0.0 && camera.longer().is_finite()) || camera.is_focal(focal) || focal > camera.longer() {
        return None;
    }
    let as_millimetres = camera.per_mm().is_none_or(|per_mm| camera.is_focal(focal * per_mm));
    let as_millimetres = as_millimetres && (SHORTEST_MM..=LONGEST_MM).contains(&focal);
    let as_share = focal < NORMALISED && camera.is_focal(focal * camera.longer());
    match (as_share, as_millimetres, camera.per_mm().is_some()) {
        (true, false, _) | (true, true, false) => Some(Unit::Share),
        (_, true, _) => Some(Unit::Millimetres),
        (false, false, _) => None,
    }
}

/// Factor to pixels, where one reading alone is possible.
fn factor(camera: &Camera, unit: Unit) -> Option<f64> {
    let as_share = camera.focal < NORMALISED && camera.is_focal(camera.focal * camera.longer());
    let as_millimetres = camera.per_mm().filter(|per_mm| camera.is_focal(camera.focal * per_mm));
    match unit {
        Unit::Share if camera.per_mm().is_some() && as_millimetres.is_none() => Some(camera.longer()),
        Unit::Millimetres if !as_share => as_millimetres,
        _ => None,
    }
}

/// Focal length in pixels as far as it is known: as stated, or converted; `None` where neither is plausible.
pub fn in_pixels(camera: &Camera) -> Option<f64> {
    match unit(camera) {
        None => Some(camera.focal).filter(|focal| camera.is_focal(*focal)),
        Some(unit) => factor(camera, unit).map(|factor| factor * camera.focal),
    }
}

/// Focal lengths that are no pixels.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    tables.cameras.iter().filter_map(|camera| Some(mistake(camera, unit(camera)?))).collect()
}

fn mistake(camera: &Camera, unit: Unit) -> Mistake {
    let (focal, [width, height]) = (camera.focal, camera.sides);
    let (words, key) = match unit {
        Unit::Share => ("a share of the sensor's longer side", "1"),
        Unit::Millimetres => ("millimetres", "mm"),
    };
    let sentence = format!(
        "Camera {}: the focal length {focal} cannot be pixels of a sensor of {width} x {height} px; it is given in \
         {words}.",
        camera.id
    );
    let remedy = match (unit, in_pixels(camera)) {
        (_, Some(px)) => format!("Give it in pixels: f = {px:.2} (block.toml)."),
        (Unit::Share, None) => {
            format!("Give it in pixels (f of block.toml): {focal} times the longer side, if it is a share of that.")
        }
        (Unit::Millimetres, None) => {
            "Give it in pixels (f of block.toml): millimetres times 1000, divided by the pixel size in micrometres."
                .into()
        }
    };
    let mend = factor(camera, unit)
        .map(|factor| Edit::all("block.toml", Change::times("f", factor)).of("id", std::slice::from_ref(&camera.id)));
    Mistake::new("focal-unit", "camera", sentence, remedy)
        .of(vec![camera.id.clone()])
        .sized(focal, None, key)
        .undone_by(mend.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    fn judged(change: impl Fn(&mut Camera)) -> Vec<Mistake> {
        let mut tables = made::tables();
        change(&mut tables.cameras[0]);
        judge(&tables)
    }

    #[test]
    fn millimetres_of_a_known_pixel_are_mended() {
        let found = judged(|camera| camera.focal = 6.0);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].kind.as_str(), found[0].names.as_slice()), ("focal-unit", &["cam".to_string()][..]));
        assert_eq!((found[0].value, found[0].unit.as_deref()), (Some(6.0), Some("mm")));
        assert_eq!(found[0].mend[0].change, Change::times("f", 500.0));
    }

    #[test]
    fn millimetres_of_an_unknown_pixel_are_named_alone() {
        let found = judged(|camera| (camera.focal, camera.pixel_um) = (24.0, None));
        assert_eq!((found.len(), found[0].mend.len(), found[0].unit.as_deref()), (1, 0, Some("mm")));
    }

    #[test]
    fn a_share_of_the_width_is_no_millimetre() {
        // 0.75 mm would be 375 px: no lens of this sensor.
        let found = judged(|camera| camera.focal = 0.75);
        assert_eq!((found.len(), found[0].unit.as_deref()), (1, Some("1")));
        assert_eq!(found[0].mend[0].change, Change::times("f", 4000.0));
        // Of 1.5 both are possible.
        let both = judged(|camera| camera.focal = 1.5);
        assert_eq!((both.len(), both[0].mend.len()), (1, 0));
    }

    #[test]
    fn pixels_are_right() {
        for focal in [1200.0, 3000.0, 40_000.0, f64::NAN, 0.0] {
            assert!(judged(|camera| camera.focal = focal).is_empty(), "{focal}");
        }
        assert_eq!(in_pixels(&made::camera()), Some(3000.0));
    }
}
