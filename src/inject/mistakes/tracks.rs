//! A false match: two tie points become one.

use super::table::Table;
use super::*;
use std::collections::BTreeSet;

pub(super) static KINDS: [Kind; 1] = [Kind {
    id: "false-match",
    subjects: &["ties"],
    summary: "one false match: the tracks of two tie points in one; of two rows of one image the first stays",
    parameters: &[
        parameter("a", "", DefaultValue::Name("the first one"), "the tie point that stays"),
        parameter(
            "b",
            "",
            DefaultValue::Name("one from the middle of the list, without a common image"),
            "the tie point that goes into it",
        ),
    ],
    act,
}];

fn act(files: &mut Files, values: &Values) -> Result<Notes> {
    let ties = files.table("ties.csv")?;
    let [image, point] = ties.columns(["image", "point"])?;
    let a = match values.word("a") {
        "" => ties.cells(point).next().context("ties.csv has no row")?.to_owned(),
        given => given.to_owned(),
    };
    let images_of = |ties: &Table, name: &str| -> BTreeSet<String> {
        ties.rows_with(point, name).into_iter().map(|row| ties.cell(row, image).to_owned()).collect()
    };
    let of_a = images_of(ties, &a);
    ensure!(!of_a.is_empty(), "ties.csv has no point `{a}`");
    let b = match values.word("b") {
        "" => far_from(ties, [image, point], &of_a)?,
        given => given.to_owned(),
    };
    ensure!(a != b, "parameters `a` and `b` must differ");
    let of_b = ties.rows_with(point, &b);
    ensure!(!of_b.is_empty(), "ties.csv has no point `{b}`");
    for row in of_b {
        if !of_a.contains(ties.cell(row, image)) {
            ties.set(row, point, &a);
        }
    }
    // Those that are left have the name still, in images that see the first one already.
    ties.remove(|ties, row| ties.cell(row, point) == b);
    if files.has("points.csv") {
        let points = files.table("points.csv")?;
        let point = points.column("point")?;
        points.remove(|points, row| points.cell(row, point) == b);
    }
    Ok(vec![note("a", a), note("b", b)])
}

/// A tie point that none of these images sees, from the middle of the list on.
fn far_from(ties: &Table, [image, point]: [usize; 2], images: &BTreeSet<String>) -> Result<String> {
    let rows = || 0..ties.len();
    let seen: BTreeSet<&str> =
        rows().filter(|row| images.contains(ties.cell(*row, image))).map(|row| ties.cell(row, point)).collect();
    let middle = ties.len() / 2;
    let mut names = (middle..ties.len()).chain(0..middle).map(|row| ties.cell(row, point));
    let found = names.find(|name| !seen.contains(name));
    Ok(found.context("every tie point has a common image with `a`; give the parameter `b`")?.to_owned())
}
