//! GNSS positions of another image, of another instant, of a flight with another base station.

use super::group::Group;
use super::survey::whole;
use super::*;
use std::collections::BTreeMap;

pub(super) static KINDS: [Kind; 3] = [
    Kind {
        id: "paired-with-neighbour",
        subjects: &["gnss"],
        summary: "each image has the GNSS position of the image this many rows further down; the last ones have none",
        parameters: &[parameter("by", "", DefaultValue::Number(1.0), "rows")],
        act: paired_with_neighbour,
    },
    Kind {
        id: "clock-offset",
        subjects: &["gnss"],
        summary: "GNSS positions of another instant: two clocks, or GPS time beside UTC",
        parameters: &[parameter("seconds", "s", DefaultValue::Number(18.0), "how much later the position was taken")],
        act: clock_offset,
    },
    Kind {
        id: "flight-offset",
        subjects: &["gnss"],
        summary: "GNSS positions of one flight are off: its base station, its height system",
        parameters: &[
            parameter("flight", "", DefaultValue::Name("the last one"), "the flight"),
            parameter("x", "m", DefaultValue::Number(0.0), "shift"),
            parameter("y", "m", DefaultValue::Number(0.0), "shift"),
            parameter("z", "m", DefaultValue::Number(15.0), "shift"),
        ],
        act: flight_offset,
    },
];

/// Columns that belong to a position.
const COLUMNS: [&str; 5] = ["gnss_x", "gnss_y", "gnss_z", "gnss_sigma_xy", "gnss_sigma_z"];

/// Somebody deleted cells at the top of the columns, and those below moved up.
fn paired_with_neighbour(files: &mut Files, values: &Values) -> Result<Notes> {
    let by = whole(values, "by")?;
    let table = files.table("images.csv")?;
    table.columns([COLUMNS[0], COLUMNS[1], COLUMNS[2]])?;
    ensure!(by < table.len(), "parameter `by` must be below the number of images, {}; it is {by}", table.len());
    for column in COLUMNS.into_iter().filter_map(|name| table.find_column(name)).collect::<Vec<_>>() {
        let cells: Vec<String> = table.cells(column).skip(by).map(str::to_owned).collect();
        for row in 0..table.len() {
            table.set(row, column, cells.get(row).map_or("", String::as_str));
        }
    }
    Ok(Vec::new())
}

/// A position at an instant.
type Fix = (f64, [f64; 3]);

/// Position of a flight at an instant: between its fixes, or beyond them at the speed of the last two.
fn at(fixes: &[Fix], time: f64) -> [f64; 3] {
    let last = fixes.len() - 2;
    let before = fixes.partition_point(|(own, _)| *own <= time).saturating_sub(1).min(last);
    let ((t0, a), (t1, b)) = (fixes[before], fixes[before + 1]);
    let part = (time - t0) / (t1 - t0);
    [0, 1, 2].map(|axis| a[axis] + part * (b[axis] - a[axis]))
}

fn clock_offset(files: &mut Files, values: &Values) -> Result<Notes> {
    let seconds = values.number("seconds");
    let mut group = Group::of(files, "gnss")?;
    let [flight, time] = group.table.columns(["flight", "time_s"])?;
    let mut flights: BTreeMap<String, Vec<(Fix, usize)>> = BTreeMap::new();
    for member in 0..group.rows.len() {
        let row = group.rows[member];
        if let Some(time) = group.table.number(row, time)? {
            let of_flight = flights.entry(group.table.cell(row, flight).to_owned()).or_default();
            of_flight.push(((time, group.position(member)?), member));
        }
    }
    let mut moved = 0;
    for mut members in flights.into_values() {
        members.sort_by(|((a, _), _), ((b, _), _)| a.total_cmp(b));
        let mut fixes: Vec<Fix> = members.iter().map(|(fix, _)| *fix).collect();
        fixes.dedup_by_key(|(time, _)| *time);
        // Nobody knows how a flight with one position went on.
        if fixes.len() < 2 {
            continue;
        }
        for ((time, _), member) in &members {
            group.put(*member, at(&fixes, time + seconds))?;
        }
        moved += members.len();
    }
    ensure!(moved > 0, "no flight has GNSS positions at two different times");
    Ok(vec![note("positions", moved)])
}

fn flight_offset(files: &mut Files, values: &Values) -> Result<Notes> {
    let by = ["x", "y", "z"].map(|name| values.number(name));
    let mut group = Group::of(files, "gnss")?;
    let flight = group.table.column("flight")?;
    let of: Vec<String> = group.rows.iter().map(|row| group.table.cell(*row, flight).to_owned()).collect();
    let wanted = match values.word("flight") {
        "" => of.last().cloned().unwrap_or_default(),
        given => given.to_owned(),
    };
    ensure!(of.contains(&wanted), "the block has no flight `{wanted}` with GNSS positions");
    group.rewrite(|member, [x, y, z]| match of[member] == wanted {
        true => [x + by[0], y + by[1], z + by[2]],
        false => [x, y, z],
    })?;
    Ok(vec![note("flight", wanted)])
}
