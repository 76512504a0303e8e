//! A list appended twice, under other names.

use super::measurements::image_or_middle;
use super::*;

/// Behind a name that stands twice.
const COPY: &str = "-copy";

pub(super) static KINDS: [Kind; 1] = [Kind {
    id: "duplicated",
    subjects: &["ties", "marks", "images"],
    summary: "the same measurements twice under other names: all tie points, all surveyed points, or one image",
    parameters: &[
        parameter(
            "of",
            "",
            DefaultValue::Choice("ties", &["ties", "marks", "images"]),
            "marks: surveyed points with their marks; images: one image with all that was measured in it",
        ),
        parameter(
            "image",
            "",
            DefaultValue::Name("the one in the middle of the list"),
            "the image that is there twice, with of=images",
        ),
    ],
    act,
}];

fn act(files: &mut Files, values: &Values) -> Result<Notes> {
    let (of, given) = (values.word("of"), values.word("image"));
    ensure!(of == "images" || given.is_empty(), "parameter `image` goes with of=images");
    match of {
        "images" => {
            let image = image_or_middle(files, given)?;
            copy(files, &["images.csv", "ties.csv", "marks.csv"], "image", |name| name == image)?;
            Ok(vec![note("image", image)])
        }
        "marks" => {
            ensure!(files.has("marks.csv"), "the block has no marks.csv");
            copy(files, &["control.csv", "marks.csv"], "point", |_| true)
        }
        _ => copy(files, &["ties.csv", "points.csv"], "point", |_| true),
    }
}

/// Appends copies of the rows whose name in a column is wanted.
fn copy(files: &mut Files, tables: &[&'static str], column: &str, is_wanted: impl Fn(&str) -> bool) -> Result<Notes> {
    files.each_table(tables, |table| {
        let column = table.column(column)?;
        let rows: Vec<usize> = (0..table.len()).filter(|row| is_wanted(table.cell(*row, column))).collect();
        table.append_copies(&rows, column, |name| format!("{name}{COPY}"));
        Ok(())
    })?;
    Ok(Vec::new())
}
