//! What is recorded beside the measurements: standard deviations, times, velocities, temperatures.

use super::*;

const KELVIN: f64 = 273.15;
const SECONDS_TO_MILLISECONDS: f64 = 1000.0;
/// km/h of 1 m/s.
const KMH: f64 = 3.6;
/// Knots of 1 m/s.
const KNOTS: f64 = 3600.0 / 1852.0;
/// ft/s of 1 m/s.
const FEET: f64 = 1.0 / 0.3048;

pub(super) static KINDS: [Kind; 4] = [
    Kind {
        id: "precision",
        subjects: &["ties", "marks", "control", "gnss"],
        summary: "stated standard deviations that are not true",
        parameters: &[
            parameter(
                "of",
                "",
                DefaultValue::Choice("ties", &["ties", "marks", "control", "gnss"]),
                "whose standard deviations",
            ),
            parameter("factor", "", DefaultValue::Number(0.1), "factor on the stated standard deviations"),
        ],
        act: precision,
    },
    Kind {
        id: "time",
        subjects: &["images"],
        summary: "times that are equal, in milliseconds, or not in the order of the flight",
        parameters: &[parameter(
            "change",
            "",
            DefaultValue::Choice("equal", &["equal", "milliseconds", "reversed"]),
            "reversed: the column from bottom to top",
        )],
        act: time,
    },
    Kind {
        id: "velocity-unit",
        subjects: &["images"],
        summary: "velocities in another unit, or backwards",
        parameters: &[parameter(
            "unit",
            "",
            DefaultValue::Choice("kmh", &["kmh", "knots", "feet", "reversed"]),
            "kmh: km/h; feet: ft/s",
        )],
        act: |files, values| {
            let factor = match values.word("unit") {
                "kmh" => KMH,
                "knots" => KNOTS,
                "feet" => FEET,
                _ => -1.0,
            };
            let table = files.table("images.csv")?;
            table.columns(["vx", "vy", "vz"])?.into_iter().try_for_each(|column| table.multiply(column, factor))?;
            Ok(Vec::new())
        },
    },
    Kind {
        id: "temperature-unit",
        subjects: &["images"],
        summary: "temperatures in kelvin or degrees Fahrenheit",
        parameters: &[parameter(
            "unit",
            "",
            DefaultValue::Choice("kelvin", &["kelvin", "fahrenheit"]),
            "given instead of degrees Celsius",
        )],
        act: |files, values| {
            let kelvin = values.word("unit") == "kelvin";
            let table = files.table("images.csv")?;
            let column = table.column("temperature_c")?;
            for row in 0..table.len() {
                if let Some(own) = table.number(row, column)? {
                    table.put(row, [column], [if kelvin { own + KELVIN } else { 1.8 * own + 32.0 }])?;
                }
            }
            Ok(Vec::new())
        },
    },
];

fn precision(files: &mut Files, values: &Values) -> Result<Notes> {
    let factor = values.positive("factor")?;
    let (keys, file, columns): (&[&'static str], &'static str, &[&str]) = match values.word("of") {
        "ties" => (&["tie_px"], "ties.csv", &["sigma"]),
        "marks" => (&["mark_px"], "marks.csv", &["sigma"]),
        "control" => (&["control_xy_m", "control_z_m"], "control.csv", &["sigma_xy", "sigma_z"]),
        _ => (&["gnss_xy_m", "gnss_z_m"], "images.csv", &["gnss_sigma_xy", "gnss_sigma_z"]),
    };
    if values.word("of") == "gnss" {
        // Without a position nothing has the precision.
        files.table("images.csv")?.column("gnss_x")?;
    }
    files.multiply_sigmas(keys, factor)?;
    files.each_table(&[file], |table| {
        let there: Vec<usize> = columns.iter().filter_map(|name| table.find_column(name)).collect();
        there.into_iter().try_for_each(|column| table.multiply(column, factor))
    })?;
    Ok(Vec::new())
}

fn time(files: &mut Files, values: &Values) -> Result<Notes> {
    let table = files.table("images.csv")?;
    let column = table.column("time_s")?;
    match values.word("change") {
        "milliseconds" => table.multiply(column, SECONDS_TO_MILLISECONDS)?,
        change => {
            let cells: Vec<String> = table.cells(column).map(str::to_owned).collect();
            for row in 0..table.len() {
                let from = if change == "equal" { 0 } else { cells.len() - 1 - row };
                table.set(row, column, &cells[from]);
            }
        }
    }
    Ok(Vec::new())
}
