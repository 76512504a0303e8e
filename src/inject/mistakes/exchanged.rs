//! Two names exchanged: of surveyed points, of their marks, of images.

use super::group::Group;
use super::survey::whole;
use super::table::Table;
use super::*;

pub(super) static KINDS: [Kind; 1] = [Kind {
    id: "exchanged",
    subjects: &["control", "check", "marks", "images"],
    summary: "two names exchanged: coordinates of two points, their marks, or the measurements of two images",
    parameters: &[
        parameter(
            "of",
            "",
            DefaultValue::Choice("control", &["control", "check", "marks", "images"]),
            "marks: the names of two points in marks.csv",
        ),
        parameter("a", "", DefaultValue::Name("the first one"), "a name"),
        parameter("b", "", DefaultValue::Name("the next one"), "another name"),
        parameter(
            "shift",
            "",
            DefaultValue::Optional("two names alone"),
            "of control or check points: each one gets the coordinates of the point this many rows further down",
        ),
    ],
    act,
}];

fn act(files: &mut Files, values: &Values) -> Result<Notes> {
    let of = values.word("of");
    if values.optional("shift").is_some() {
        ensure!(matches!(of, "control" | "check"), "parameter `shift` goes with of=control or of=check");
        ensure!(values.word("a").is_empty() && values.word("b").is_empty(), "parameter `shift` needs no names");
        return shift(Group::of(files, of)?, whole(values, "shift")?);
    }
    let [a, b] = match of {
        "images" => two(files.table("images.csv")?, "image", values)?,
        "marks" => two(files.table("control.csv")?, "point", values)?,
        _ => return exchange_coordinates(Group::of(files, of)?, values),
    };
    let (tables, column): (&[&str], &str) = match of {
        "images" => (&["ties.csv", "marks.csv"], "image"),
        _ => (&["marks.csv"], "point"),
    };
    files.each_table(tables, |table| {
        let column = table.column(column)?;
        let (of_a, of_b) = (table.rows_with(column, &a), table.rows_with(column, &b));
        of_a.into_iter().for_each(|row| table.set(row, column, &b));
        of_b.into_iter().for_each(|row| table.set(row, column, &a));
        Ok(())
    })?;
    Ok(vec![note("names", format!("{a}, {b}"))])
}

/// Two different names in a column of a table: as given, or the first ones.
fn two(table: &Table, column: &str, values: &Values) -> Result<[String; 2]> {
    let column = table.column(column)?;
    let (a, b) = (values.word("a"), values.word("b"));
    let pick = |given: &str, other: &str| -> Result<String> {
        if !given.is_empty() {
            table.row_with(column, given)?;
            return Ok(given.to_owned());
        }
        let first = table.cells(column).find(|name| *name != other);
        Ok(first.context("the block has too few of them to exchange two")?.to_owned())
    };
    let a = pick(a, b)?;
    let b = pick(b, &a)?;
    ensure!(a != b, "parameters `a` and `b` must differ");
    Ok([a, b])
}

fn exchange_coordinates(mut group: Group<'_>, values: &Values) -> Result<Notes> {
    ensure!(group.rows.len() >= 2, "the group has one point alone");
    let (a, b) = (values.word("a"), values.word("b"));
    let first = if a.is_empty() { None } else { Some(group.member(a)?) };
    let second = if b.is_empty() { None } else { Some(group.member(b)?) };
    let free = |taken: Option<usize>| usize::from(taken == Some(0));
    let first = first.unwrap_or_else(|| free(second));
    let second = second.unwrap_or(usize::from(first == 0));
    ensure!(first != second, "parameters `a` and `b` must differ");
    let (of_first, of_second) = (group.position(first)?, group.position(second)?);
    group.put(first, of_second)?;
    group.put(second, of_first)?;
    Ok(vec![note("names", format!("{}, {}", group.name(first), group.name(second)))])
}

/// The list of names has slipped against that of coordinates.
fn shift(mut group: Group<'_>, by: usize) -> Result<Notes> {
    let positions = group.positions()?;
    group.rewrite(|member, _| positions[(member + by) % positions.len()])?;
    Ok(Vec::new())
}
