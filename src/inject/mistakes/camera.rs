//! Cameras of another unit, another calibration, another resolution; and two cameras under one name.

use super::files::{Camera, INTERIOR};
use super::measurements::{image_or_middle, rewrite_in};
use super::*;
use std::collections::BTreeSet;

/// Focal length of a second camera over that of the first one: of two lenses of one type.
const OTHER_LENS: f64 = 1.02;
/// Width of the picture of a small-format camera, mm.
const SMALL_FORMAT_MM: f64 = 36.0;

const SUBJECTS: &[&str] = &["camera"];
const CAMERA: ParameterSpec = parameter("camera", "", DefaultValue::Name("every camera"), "the camera");
const PIXEL: ParameterSpec =
    parameter("pixel_um", "um", DefaultValue::Optional("that of the camera"), "side of a pixel");

pub(super) static KINDS: [Kind; 7] = [
    Kind {
        id: "focal-unit",
        subjects: SUBJECTS,
        summary: "a focal length that is no number of pixels",
        parameters: &[
            parameter(
                "unit",
                "",
                DefaultValue::Choice("mm", &["mm", "35mm", "widths"]),
                "35mm: as of a small-format camera; widths: of the image",
            ),
            CAMERA,
            PIXEL,
        ],
        act: |files, values| {
            change(files, values, |camera| {
                let ([f, ..], [width, _]) = (camera.interior, camera.size);
                let f = match values.word("unit") {
                    "mm" => f * camera.pixel_mm(values.optional("pixel_um"))?,
                    "35mm" => f * SMALL_FORMAT_MM / width,
                    _ => f / width,
                };
                Ok(vec![("f", f)])
            })
        },
    },
    Kind {
        id: "focal-wrong",
        subjects: SUBJECTS,
        summary: "the focal length of another lens",
        parameters: &[parameter("factor", "", DefaultValue::Number(0.75), "of the focal length"), CAMERA],
        act: |files, values| {
            let factor = values.positive("factor")?;
            change(files, values, |camera| Ok(vec![("f", factor * camera.interior[0])]))
        },
    },
    Kind {
        id: "principal-point-unit",
        subjects: SUBJECTS,
        summary: "principal point and centre of distortion in another unit or from another origin",
        parameters: &[
            parameter(
                "unit",
                "",
                DefaultValue::Choice("mm", &["mm", "mm-centred", "px-centred"]),
                "centred: from the centre of the image",
            ),
            CAMERA,
            PIXEL,
        ],
        act: |files, values| {
            let unit = values.word("unit");
            change(files, values, |camera| {
                let mm = if unit == "px-centred" { 1.0 } else { camera.pixel_mm(values.optional("pixel_um"))? };
                let half = if unit == "mm" { [0.0; 2] } else { camera.size.map(|side| side / 2.0) };
                // ppx, ppy, dcx, dcy
                let entry = |k: usize| (INTERIOR[k], mm * (camera.interior[k] - half[(k - 1) % 2]));
                Ok((1..=4).map(entry).collect())
            })
        },
    },
    Kind {
        id: "distortion-unit",
        subjects: SUBJECTS,
        summary: "coefficients of the distortion for other coordinates than pixels",
        parameters: &[
            parameter(
                "unit",
                "",
                DefaultValue::Choice("focal", &["focal", "mm"]),
                "focal: coordinates divided by the focal length",
            ),
            CAMERA,
            PIXEL,
        ],
        act: |files, values| {
            change(files, values, |camera| {
                let unit_px = match values.word("unit") {
                    "focal" => camera.interior[0],
                    _ => 1.0 / camera.pixel_mm(values.optional("pixel_um"))?,
                };
                // px^-2, px^-4, px^-6 of k1, k2, k3 and px^-1 of p1, p2.
                let powers = [(5, 2), (6, 4), (7, 6), (8, 1), (9, 1)];
                Ok(powers.map(|(k, power)| (INTERIOR[k], camera.interior[k] * unit_px.powi(power))).into())
            })
        },
    },
    Kind {
        id: "distortion-sign",
        subjects: SUBJECTS,
        summary: "coefficients of the distortion that act from image to object: all with the wrong sign",
        parameters: &[CAMERA],
        act: |files, values| {
            // Zero stays as it is written.
            let reversed = |value: f64| if value == 0.0 { value } else { -value };
            change(files, values, |camera| Ok((5..=9).map(|k| (INTERIOR[k], reversed(camera.interior[k]))).collect()))
        },
    },
    Kind {
        id: "sensor-size",
        subjects: SUBJECTS,
        summary: "width and height exchanged, or those of another resolution",
        parameters: &[
            parameter("factor", "", DefaultValue::Optional("exchanged sides"), "of width and height"),
            CAMERA,
        ],
        act: |files, values| {
            let factor = match values.optional("factor") {
                Some(_) => Some(values.positive("factor")?),
                None => None,
            };
            change(files, values, |camera| {
                let [width, height] = camera.size;
                let [width, height] = match factor {
                    Some(factor) => [(factor * width).round().max(1.0), (factor * height).round().max(1.0)],
                    None => [height, width],
                };
                Ok(vec![("width_px", width), ("height_px", height)])
            })
        },
    },
    Kind {
        id: "several-cameras",
        subjects: SUBJECTS,
        summary: "two cameras under one name; of a block with one camera the second part gets another focal length",
        parameters: &[
            parameter(
                "from",
                "",
                DefaultValue::Name("the one in the middle of the list"),
                "first image of the second camera, where the block has one camera",
            ),
            parameter("factor", "", DefaultValue::Optional("1.02"), "focal length of the second camera, as a share"),
        ],
        act: several_cameras,
    },
];

fn change(
    files: &mut Files,
    values: &Values,
    change: impl Fn(&Camera) -> Result<Vec<(&'static str, f64)>>,
) -> Result<Notes> {
    files.change_cameras(values.word("camera"), change)?;
    Ok(Vec::new())
}

fn several_cameras(files: &mut Files, values: &Values) -> Result<Notes> {
    let images = files.table("images.csv")?;
    let [image, camera] = images.columns(["image", "camera"])?;
    let first = images.cells(camera).next().context("images.csv has no row")?.to_owned();
    if images.cells(camera).any(|id| id != first) {
        let is_given = !values.word("from").is_empty() || values.optional("factor").is_some();
        ensure!(!is_given, "`from` and `factor` make a second camera; this block has one: leave them out");
        for row in 0..images.len() {
            images.set(row, camera, &first);
        }
        return Ok(vec![note("camera", first)]);
    }
    let factor = match values.optional("factor") {
        Some(_) => values.positive("factor")?,
        None => OTHER_LENS,
    };
    let from = image_or_middle(files, values.word("from"))?;
    let images = files.table("images.csv")?;
    let second: BTreeSet<String> = images.cells(image).skip_while(|name| *name != from).map(str::to_owned).collect();
    ensure!(second.len() < images.len(), "parameter `from` names the first image: there would be one camera");
    rewrite_in(
        files,
        &["ties.csv", "marks.csv"],
        |name| second.contains(name),
        |camera, [x, y]| {
            let [_, ppx, ppy, ..] = camera.interior;
            Ok([ppx + factor * (x - ppx), ppy + factor * (y - ppy)])
        },
    )?;
    Ok(vec![
        note("first image of the second camera", from),
        note("images of the second camera", second.len()),
        note("focal length of the second camera, as a share", factor),
    ])
}
