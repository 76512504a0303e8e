//! Temperatures of the camera in another unit than degrees Celsius.

use super::tables::Tables;
use crate::block::edit::{Change, Edit};
use crate::math::statistics::median;
use crate::mistakes::Mistake;

/// Fewest images whose temperature is looked at.
const FEWEST: usize = 3;
/// Temperatures that are kelvin: -73 to 127 degrees Celsius. No camera works at 200 degrees Celsius.
const KELVIN: [f64; 2] = [200.0, 400.0];
/// Most temperatures above this, in degrees Celsius, are none of a camera that works: sensors switch off there.
const TOO_HOT: f64 = 70.0;
/// Share of the images that is most.
const MOST: f64 = 0.8;
/// What degrees Fahrenheit of a camera lie between: -18 to 66 degrees Celsius.
const FAHRENHEIT: [f64; 2] = [0.0, 150.0];

/// Temperatures that no camera has in degrees Celsius.
pub fn judge(tables: &Tables) -> Option<Mistake> {
    let values: Vec<f64> = tables.images.iter().filter_map(|image| image.temperature_c).collect();
    if values.len() < FEWEST {
        return None;
    }
    let all = |[low, high]: [f64; 2]| values.iter().all(|value| (low..=high).contains(value));
    let hot = values.iter().filter(|value| **value > TOO_HOT).count() as f64;
    let (unit, key, factor, offset) = if all(KELVIN) {
        ("kelvin", "K", 1.0, -273.15)
    } else if all(FAHRENHEIT) && hot >= MOST * values.len() as f64 {
        ("degrees Fahrenheit", "F", 5.0 / 9.0, -160.0 / 9.0)
    } else {
        return None;
    };
    let middle = median(&values);
    let sentence = format!(
        "Images: the camera temperatures are {unit}; {middle:.1} (the median) is no temperature of a working camera in \
         degrees Celsius, and {:.1} is.",
        factor * middle + offset
    );
    let remedy = "Convert them to degrees Celsius (temperature_c of images.csv).";
    let change = Change::Affine { column: "temperature_c".into(), factor, offset };
    let mend = vec![Edit::all("images.csv", change)];
    let found = Mistake::new("temperature-unit", "images", sentence, remedy.into());
    Some(found.sized(middle, None, key).undone_by(mend))
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    fn judged(temperature: impl Fn(usize) -> Option<f64>) -> Option<Mistake> {
        let mut tables = made::with_images(made::images(20));
        tables.images.iter_mut().enumerate().for_each(|(k, image)| image.temperature_c = temperature(k));
        judge(&tables)
    }

    #[test]
    fn kelvin_and_fahrenheit() {
        let kelvin = judged(|k| Some(293.15 + k as f64)).expect("kelvin");
        assert_eq!((kelvin.kind.as_str(), kelvin.unit.as_deref()), ("temperature-unit", Some("K")));
        let fahrenheit = judged(|k| Some(75.0 + k as f64)).expect("Fahrenheit");
        assert_eq!(fahrenheit.unit.as_deref(), Some("F"));
        let Change::Affine { factor, offset, .. } = &fahrenheit.mend[0].change else { panic!("{fahrenheit:?}") };
        assert!((factor * 212.0 + offset - 100.0).abs() < 1e-12);
    }

    #[test]
    fn degrees_celsius_and_few_values_are_right() {
        assert!(judged(|k| Some(20.0 + k as f64)).is_none());
        assert!(judged(|k| Some(45.0 + k as f64)).is_none(), "a hot day");
        assert!(judged(|_| None).is_none());
        assert!(judged(|k| (k == 0).then_some(295.0)).is_none());
        assert!(judged(|k| Some(if k == 0 { 0.0 } else { 295.0 })).is_none(), "a mixture is no unit");
    }
}
