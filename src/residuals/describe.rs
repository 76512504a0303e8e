//! What is left, in words.

use super::{Structure, StructureTest};
use crate::math::probability::p_is;
use crate::math::statistics::normal_two_sided;

/// Cells that a sentence names at most.
const NAMED: usize = 3;

pub(super) fn unexplained(structure: &Structure) -> Vec<String> {
    let mut tests: Vec<&StructureTest> =
        structure.tests.iter().filter(|test| test.decides && test.family_p_value < structure.significance).collect();
    tests.sort_by(|a, b| a.ln_p_value.total_cmp(&b.ln_p_value));
    tests.iter().map(|test| sentence(structure, test)).collect()
}

fn sentence(structure: &Structure, test: &StructureTest) -> String {
    let p = p_is(test.p_value);
    let detail = match test.against {
        "sensor" => place_on_sensor(structure),
        "spectrum" => periods(structure),
        "image" => images(structure),
        _ => None,
    };
    format!("{} ({p}): {}", test.against, detail.unwrap_or_else(|| test.description.clone()))
}

fn place_on_sensor(structure: &Structure) -> Option<String> {
    let mut parts = Vec::new();
    for grid in &structure.pictures.sensor {
        let tested = grid.cells.iter().filter(|cell| cell.p_value.is_finite()).count();
        let level = structure.significance / tested.max(1) as f64;
        let mut cells: Vec<_> = grid.cells.iter().filter(|cell| cell.p_value < level).collect();
        let length = |d: [f64; 2]| d[0].hypot(d[1]);
        cells.sort_by(|a, b| length(b.displacement).total_cmp(&length(a.displacement)));
        let named: Vec<String> = cells
            .iter()
            .take(NAMED)
            .map(|cell| {
                format!("{:.2} px about ({:.0}, {:.0}) px", length(cell.displacement), cell.centre[0], cell.centre[1])
            })
            .collect();
        if !named.is_empty() {
            parts.push(format!(
                "{} of {tested} cells of the sensor are displaced, most: {}",
                cells.len(),
                named.join(", ")
            ));
        }
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

fn periods(structure: &Structure) -> Option<String> {
    let peak = structure.pictures.peaks.first()?;
    Some(format!(
        "a pattern repeats every {:.0} px in the direction {:.0} degrees from the x axis, amplitude {:.3} px in x and \
         {:.3} px in y",
        peak.wavelength, peak.direction_deg, peak.amplitude[0], peak.amplitude[1]
    ))
}

fn images(structure: &Structure) -> Option<String> {
    let images = &structure.pictures.images;
    let level = structure.significance / images.len().max(1) as f64;
    let mut moved: Vec<_> = images
        .iter()
        .filter(|image| image.scale_sigma > 0.0 && normal_two_sided(image.scale / image.scale_sigma) < level)
        .collect();
    moved.sort_by(|a, b| b.scale.abs().total_cmp(&a.scale.abs()));
    let largest = moved.first()?;
    let first = moved.iter().map(|image| image.time_s).fold(f64::INFINITY, f64::min);
    let since = if first.is_finite() { format!(", first at {first:.1} s") } else { String::new() };
    Some(format!(
        "{} of {} images differ in scale, most number {} by {:.3} px at half the diagonal{since}",
        moved.len(),
        images.len(),
        largest.image + 1,
        largest.scale
    ))
}
