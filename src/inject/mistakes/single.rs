//! One image that was turned; parts of a block without common points.

use super::measurements::{image_or_middle, rewrite_in};
use super::*;
use std::collections::BTreeSet;

/// Behind the name of a point that was split into two.
const OTHER_PART: &str = "-part2";

pub(super) static KINDS: [Kind; 2] = [
    Kind {
        id: "turned",
        subjects: &["images"],
        summary: "one image turned before it was measured",
        parameters: &[
            parameter("image", "", DefaultValue::Name("the one in the middle of the list"), "the image"),
            parameter("degrees", "deg", DefaultValue::Choice("180", &["90", "180", "270"]), "clockwise"),
        ],
        act: |files, values| {
            let image = image_or_middle(files, values.word("image"))?;
            let degrees = values.word("degrees");
            rewrite_in(
                files,
                &["ties.csv", "marks.csv"],
                |name| name == image,
                |camera, [x, y]| {
                    let [width, height] = camera.size;
                    Ok(match degrees {
                        "90" => [height - y, x],
                        "270" => [y, width - x],
                        _ => [width - x, height - y],
                    })
                },
            )?;
            Ok(vec![note("image", image)])
        },
    },
    Kind {
        id: "unconnected",
        subjects: &["images"],
        summary: "two parts without common points: tie points end at the border, and only one part has marks there",
        parameters: &[parameter(
            "from",
            "",
            DefaultValue::Name("the one in the middle of the list"),
            "first image of the second part; the list goes by images.csv",
        )],
        act: unconnected,
    },
];

fn unconnected(files: &mut Files, values: &Values) -> Result<Notes> {
    let from = image_or_middle(files, values.word("from"))?;
    let images = files.table("images.csv")?;
    let image = images.column("image")?;
    let second: BTreeSet<String> = images.cells(image).skip_while(|name| *name != from).map(str::to_owned).collect();
    ensure!(second.len() < images.len(), "parameter `from` names the first image: there would be one part");

    let ties = files.table("ties.csv")?;
    let [image, point] = ties.columns(["image", "point"])?;
    let mut split: BTreeSet<String> = BTreeSet::new();
    for row in 0..ties.len() {
        if second.contains(ties.cell(row, image)) {
            let name = ties.cell(row, point).to_owned();
            ties.set(row, point, &format!("{name}{OTHER_PART}"));
            split.insert(name);
        }
    }
    if files.has("points.csv") {
        let points = files.table("points.csv")?;
        let point = points.column("point")?;
        let rows: Vec<usize> = (0..points.len()).filter(|row| split.contains(points.cell(*row, point))).collect();
        points.append_copies(&rows, point, |name| format!("{name}{OTHER_PART}"));
    }
    if files.has("marks.csv") {
        let marks = files.table("marks.csv")?;
        let [image, point] = marks.columns(["image", "point"])?;
        let is_second = |row: usize| second.contains(marks.cell(row, image));
        let rows = (0..marks.len()).filter(|row| !is_second(*row));
        let in_first: BTreeSet<String> = rows.map(|row| marks.cell(row, point).to_owned()).collect();
        marks.remove(|marks, row| second.contains(marks.cell(row, image)) && in_first.contains(marks.cell(row, point)));
    }
    Ok(vec![note("first image of the second part", from), note("images of the second part", second.len())])
}
