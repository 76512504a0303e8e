//! Single members of a survey: one coordinate, one position, one mark; and too few control points, or those in a line.

use super::group::{Group, SUBJECTS, axis, axis_of, of};
use super::survey::whole;
use super::*;

const OF_POINTS: ParameterSpec =
    parameter("of", "", DefaultValue::Choice("control", &["control", "check"]), "control or check points");
const NAME: ParameterSpec = parameter("name", "", DefaultValue::Name("the middle one of the list"), "the member");

pub(super) static KINDS: [Kind; 5] = [
    Kind {
        id: "wrong-coordinate",
        subjects: &["control", "check"],
        summary: "one coordinate of one point is off",
        parameters: &[OF_POINTS, NAME, axis("z"), parameter("by", "m", DefaultValue::Number(1.0), "added to it")],
        act: |files, values| {
            let mut by = [0.0; 3];
            by[axis_of(values)] = values.number("by");
            move_one(files, values, by)
        },
    },
    Kind {
        id: "wrong-position",
        subjects: SUBJECTS,
        summary: "one position is off as a whole",
        parameters: &[
            of("gnss"),
            NAME,
            parameter("x", "m", DefaultValue::Number(-8.0), "added to it"),
            parameter("y", "m", DefaultValue::Number(0.0), "added to it"),
            parameter("z", "m", DefaultValue::Number(5.0), "added to it"),
        ],
        act: |files, values| move_one(files, values, ["x", "y", "z"].map(|name| values.number(name))),
    },
    Kind {
        id: "wrong-mark",
        subjects: &["marks"],
        summary: "one mark of a surveyed point lies beside it",
        parameters: &[
            parameter("point", "", DefaultValue::Name("that of the first mark"), "the surveyed point"),
            parameter("image", "", DefaultValue::Name("the first one with a mark of it"), "the image"),
            parameter("x", "px", DefaultValue::Number(20.0), "added to the mark"),
            parameter("y", "px", DefaultValue::Number(-15.0), "added to the mark"),
        ],
        act: wrong_mark,
    },
    Kind {
        id: "too-few",
        subjects: &["control"],
        summary: "only a few control points; the others are check points",
        parameters: &[parameter("keep", "", DefaultValue::Number(2.0), "number of control points, the first ones")],
        act: |files, values| {
            let keep = whole(values, "keep")?;
            let group = Group::of(files, "control")?;
            let kept = (0..keep.min(group.rows.len())).collect();
            keep_control(group, kept)
        },
    },
    Kind {
        id: "in-line",
        subjects: &["control"],
        summary: "control points in a line; the others are check points",
        parameters: &[parameter("keep", "", DefaultValue::Number(3.0), "number of control points, nearest the line")],
        act: |files, values| {
            let keep = whole(values, "keep")?;
            let group = Group::of(files, "control")?;
            let mut kept = by_distance_from_line(&group.positions()?);
            kept.truncate(keep);
            keep_control(group, kept)
        },
    },
];

fn move_one(files: &mut Files, values: &Values, by: [f64; 3]) -> Result<Notes> {
    let mut group = Group::given(files, values)?;
    let member = group.member(values.word("name"))?;
    let [x, y, z] = group.position(member)?;
    group.put(member, [x + by[0], y + by[1], z + by[2]])?;
    Ok(vec![note("name", group.name(member))])
}

fn wrong_mark(files: &mut Files, values: &Values) -> Result<Notes> {
    let table = files.table("marks.csv")?;
    let [image, point, x, y] = table.columns(["image", "point", "x", "y"])?;
    let [wanted_image, wanted_point] = ["image", "point"].map(|name| values.word(name));
    let fits = |row: &usize| {
        (wanted_image.is_empty() || table.cell(*row, image) == wanted_image)
            && (wanted_point.is_empty() || table.cell(*row, point) == wanted_point)
    };
    let row = (0..table.len()).find(fits).context("marks.csv has no such mark")?;
    let [old_x, old_y] = table.numbers(row, [x, y])?.context("the mark has no coordinates")?;
    table.put(row, [x, y], [old_x + values.number("x"), old_y + values.number("y")])?;
    Ok(vec![note("point", table.cell(row, point)), note("image", table.cell(row, image))])
}

/// Makes check points of all control points but those kept.
fn keep_control(group: Group<'_>, mut kept: Vec<usize>) -> Result<Notes> {
    kept.sort_unstable();
    let names: Vec<&str> = kept.iter().map(|member| group.name(*member)).collect();
    let names = names.join(", ");
    let role = group.table.column("role")?;
    for member in (0..group.rows.len()).filter(|member| !kept.contains(member)) {
        group.table.set(group.rows[member], role, "check");
    }
    Ok(vec![note("control", names)])
}

/// Members by their distance from the line through the two that are farthest apart, in plan.
fn by_distance_from_line(positions: &[[f64; 3]]) -> Vec<usize> {
    let squared = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let (mut ends, mut longest) = ([0, 0], -1.0);
    for (a, first) in positions.iter().enumerate() {
        for (b, second) in positions.iter().enumerate().skip(a) {
            if squared(*first, *second) > longest {
                (ends, longest) = ([a, b], squared(*first, *second));
            }
        }
    }
    let [a, b] = ends.map(|end| positions.get(end).copied().unwrap_or_default());
    // Twice the area of the triangle: proportional to the distance.
    let area = |p: [f64; 3]| ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])).abs();
    let distance = |member: &usize| if ends.contains(member) { -1.0 } else { area(positions[*member]) };
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    order
}
