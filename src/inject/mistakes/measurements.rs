//! Image measurements of another convention: of all ties or marks, or those of one image.

use super::files::Camera;
use super::*;

/// Subjects, and choices of `of`, of conventions of tables.
const TABLES: &[&str] = &["ties", "marks"];
/// The same, where one image alone may be concerned.
const IMAGES_TOO: &[&str] = &["ties", "marks", "images"];

const OF: ParameterSpec =
    parameter("of", "", DefaultValue::Choice("both", &["ties", "marks", "both"]), "whose coordinates");
const OF_IMAGES_TOO: ParameterSpec = of_images_too("both");
const IMAGE: ParameterSpec =
    parameter("image", "", DefaultValue::Name("the one in the middle of the list"), "the image, with of=images");

const fn of_images_too(default: &'static str) -> ParameterSpec {
    let choices = &["ties", "marks", "both", "images"];
    parameter("of", "", DefaultValue::Choice(default, choices), "whose coordinates; images: both, in one image")
}

pub(super) static KINDS: [Kind; 9] = [
    Kind {
        id: "y-up",
        subjects: TABLES,
        summary: "y counted upwards from the lower edge",
        parameters: &[OF],
        act: |files, values| rewrite(files, values, |camera, [x, y]| Ok([x, camera.size[1] - y])),
    },
    Kind {
        id: "mirrored",
        subjects: IMAGES_TOO,
        summary: "x counted from the right edge: mirrored images, or one of them",
        parameters: &[OF_IMAGES_TOO, IMAGE],
        act: |files, values| rewrite(files, values, |camera, [x, y]| Ok([camera.size[0] - x, y])),
    },
    Kind {
        id: "columns-exchanged",
        subjects: TABLES,
        summary: "x and y exchanged",
        parameters: &[OF],
        act: |files, values| rewrite(files, values, |_, [x, y]| Ok([y, x])),
    },
    Kind {
        id: "centred",
        subjects: TABLES,
        summary: "coordinates counted from the centre of the image",
        parameters: &[OF],
        act: |files, values| {
            rewrite(files, values, |camera, [x, y]| Ok([x - camera.size[0] / 2.0, y - camera.size[1] / 2.0]))
        },
    },
    Kind {
        id: "image-scale",
        subjects: IMAGES_TOO,
        summary: "measured in reduced or enlarged images, or in one of them",
        parameters: &[
            OF_IMAGES_TOO,
            IMAGE,
            parameter("factor", "", DefaultValue::Number(0.5), "width of these images, as a share of the full one"),
        ],
        act: |files, values| {
            let factor = values.positive("factor")?;
            rewrite(files, values, |_, [x, y]| Ok([factor * x, factor * y]))
        },
    },
    Kind {
        id: "offset",
        subjects: IMAGES_TOO,
        summary: "coordinates shifted: centre and corner of a pixel, or one image that was cropped",
        parameters: &[
            of_images_too("marks"),
            IMAGE,
            parameter("x", "px", DefaultValue::Number(0.5), "added to them"),
            parameter("y", "px", DefaultValue::Number(0.5), "added to them"),
        ],
        act: |files, values| {
            let by = [values.number("x"), values.number("y")];
            rewrite(files, values, |_, [x, y]| Ok([x + by[0], y + by[1]]))
        },
    },
    Kind {
        id: "millimetres",
        subjects: TABLES,
        summary: "millimetres on the sensor in place of pixels",
        parameters: &[
            OF,
            parameter("pixel_um", "um", DefaultValue::Optional("that of the camera"), "side of a pixel"),
            parameter(
                "origin",
                "",
                DefaultValue::Choice("corner", &["corner", "centre"]),
                "centre: of the image, y up",
            ),
        ],
        act: |files, values| {
            let centred = values.word("origin") == "centre";
            rewrite(files, values, |camera, [x, y]| {
                let mm = camera.pixel_mm(values.optional("pixel_um"))?;
                let [width, height] = camera.size;
                Ok(if centred { [mm * (x - width / 2.0), mm * (height / 2.0 - y)] } else { [mm * x, mm * y] })
            })
        },
    },
    Kind {
        id: "normalised",
        subjects: TABLES,
        summary: "coordinates divided by the size of the image, or by the focal length",
        parameters: &[OF, parameter("by", "", DefaultValue::Choice("size", &["size", "focal"]), "divided by this")],
        act: |files, values| {
            let by_size = values.word("by") == "size";
            rewrite(files, values, |camera, [x, y]| {
                let ([width, height], [f, ppx, ppy, ..]) = (camera.size, camera.interior);
                Ok(if by_size { [x / width, y / height] } else { [(x - ppx) / f, (y - ppy) / f] })
            })
        },
    },
    Kind {
        id: "whole-pixels",
        subjects: TABLES,
        summary: "coordinates rounded to whole pixels",
        parameters: &[OF],
        act: |files, values| rewrite(files, values, |_, [x, y]| Ok([x.round(), y.round()])),
    },
];

/// Rewrites the coordinates that the parameters `of` and `image` name.
fn rewrite(files: &mut Files, values: &Values, new: impl Fn(&Camera, [f64; 2]) -> Result<[f64; 2]>) -> Result<Notes> {
    let (of, given) = (values.word("of"), values.word("image"));
    ensure!(of == "images" || given.is_empty(), "parameter `image` goes with of=images");
    if of == "images" {
        let image = image_or_middle(files, given)?;
        rewrite_in(files, &["ties.csv", "marks.csv"], |name| name == image, new)?;
        return Ok(vec![note("image", image)]);
    }
    let tables: &[&str] = match of {
        "ties" => &["ties.csv"],
        "marks" => &["marks.csv"],
        _ => &["ties.csv", "marks.csv"],
    };
    rewrite_in(files, tables, |_| true, new)?;
    Ok(Vec::new())
}

/// Rewrites the coordinates in tables, in the images that are wanted.
pub(super) fn rewrite_in(
    files: &mut Files,
    tables: &[&'static str],
    is_wanted: impl Fn(&str) -> bool,
    new: impl Fn(&Camera, [f64; 2]) -> Result<[f64; 2]>,
) -> Result<()> {
    let cameras = files.camera_by_image()?;
    files.each_table(tables, |table| {
        let [image, x, y] = table.columns(["image", "x", "y"])?;
        for row in 0..table.len() {
            let name = table.cell(row, image);
            if !is_wanted(name) {
                continue;
            }
            let camera = cameras.get(name).with_context(|| format!("images.csv has no image `{name}`"))?;
            if let Some(old) = table.numbers(row, [x, y])? {
                table.put(row, [x, y], new(camera, old)?)?;
            }
        }
        Ok(())
    })
}

/// The image of a name; without a name the one in the middle of `images.csv`.
pub(super) fn image_or_middle(files: &mut Files, name: &str) -> Result<String> {
    let table = files.table("images.csv")?;
    let column = table.column("image")?;
    ensure!(table.len() > 0, "images.csv has no row");
    let row = if name.is_empty() { table.len() / 2 } else { table.row_with(column, name)? };
    Ok(table.cell(row, column).to_owned())
}
