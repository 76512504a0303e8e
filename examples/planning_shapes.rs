//! The pictures of docs/planning-shapes.md: plans of blocks of many shapes. `cargo run --release --example
//! planning_shapes` writes them to docs/, and prints the numbers of their curves.
//!
//! 1. The bowl of random errors against the tilt of the oblique flight and against cross strips, on control and with
//!    GNSS.
//! 2. The precision of points against the number of control points, where control limits it and where it does not.
//! 3. The dike against the tilt of its oblique flight: the bowl, and what an effect does that is just not seen.

use misclosure::adjust::Options;
use misclosure::diagnose::settings::Settings;
use misclosure::model::{Datum, Model};
use misclosure::plan::{Plan, plan};
use misclosure::report::figures::{Axis, LineChart, LineStyle, Panel, Series, line_chart};
use misclosure::scenario::{Scenario, simulate};
use std::error::Error;
use std::fs::write;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// A corridor of one kilometre with four control points.
const CORRIDOR: [(&str, f64); 4] = [("length_m", 1000.0), ("points", 2000.0), ("check", 100.0), ("control", 4.0)];
/// An area with four control points.
const AREA: [(&str, f64); 3] = [("points", 2000.0), ("check", 100.0), ("control", 4.0)];
/// A short corridor.
const SHORT: [(&str, f64); 3] = [("length_m", 400.0), ("points", 1500.0), ("check", 100.0)];
/// The dike.
const DIKE: [(&str, f64); 2] = [("points", 1000.0), ("check", 100.0)];

fn main() -> Result<()> {
    let bowl = |planned: &Plan| planned.precision.check.as_ref().and_then(|own| own.dome_m);
    let tilts = [0.0, 10.0, 20.0, 30.0, 40.0];
    let strips = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0];
    let bowl_against = |preset: &str, set: &[(&str, f64)], name: &str, values: &[f64]| -> Result<Vec<Series>> {
        [(Datum::Control, "four control points"), (Datum::All, "the same with GNSS")]
            .into_iter()
            .map(|(datum, label)| Ok(Series::new(label, curve(preset, set, name, values, datum, &bowl)?)))
            .collect()
    };
    let panels = vec![
        panel("A corridor of 1 km", Axis::new("tilt of the oblique flight", "deg"), bowl_axis(), {
            bowl_against("corridor", &CORRIDOR, "tilt_deg", &tilts)?
        }),
        panel("An area of 200 m by 150 m", Axis::new("cross strips", ""), bowl_axis(), {
            bowl_against("mapping", &AREA, "cross_strips", &strips)?
        }),
    ];
    draw("bowl", "Bowl or dome of random errors", panels)?;

    let counts = [4.0, 8.0, 16.0, 32.0, 64.0];
    let height = |planned: &Plan| planned.precision.height_m.map(|own| own.typical);
    let of_survey = |sigma_m: f64| -> Result<Vec<[f64; 2]>> {
        let mut set = SHORT.to_vec();
        set.extend([("control_xy_m", sigma_m), ("control_z_m", sigma_m)]);
        curve("corridor", &set, "control", &counts, Datum::Control, &height)
    };
    let (coarse, fine) = (of_survey(0.1)?, of_survey(0.005)?);
    let law = counts.map(|n| [n, coarse[0][1] * (n / counts[0]).powf(-0.5)]).to_vec();
    let series = vec![
        Series::new("control of 100 mm", coarse),
        Series::new("falls with the root of their number", law).style(LineStyle::Dashed),
        Series::new("control of 5 mm", fine),
    ];
    let axes = [Axis::new("control points", "").log(), Axis::new("standard deviation of a height", "mm").log()];
    let [x, y] = axes;
    draw("control", "Heights of tie points on a corridor of 400 m", vec![panel("", x, y, series)])?;

    let unseen = |planned: &Plan| planned.precision.check.as_ref().map(|own| own.height_unseen_m);
    let tilts = [0.0, 15.0, 30.0, 45.0];
    let series = vec![
        Series::new("bowl of random errors", curve("dike", &DIKE, "tilt_deg", &tilts, Datum::Control, &bowl)?),
        Series::new("RMS with an effect not seen", curve("dike", &DIKE, "tilt_deg", &tilts, Datum::Control, &unseen)?),
    ];
    let x = Axis::new("tilt of the oblique flight", "deg");
    draw("tilt", "Heights of check points on the dike", vec![panel("", x, bowl_axis(), series)])
}

fn bowl_axis() -> Axis {
    Axis::new("in height", "mm").from_zero()
}

fn panel(title: &str, x: Axis, y: Axis, series: Vec<Series>) -> Panel {
    Panel { title: title.into(), x, y, series }
}

/// A number of the plans of a preset, mm, against a parameter.
fn curve(
    preset: &str,
    set: &[(&str, f64)],
    name: &str,
    values: &[f64],
    datum: Datum,
    of: &dyn Fn(&Plan) -> Option<f64>,
) -> Result<Vec<[f64; 2]>> {
    let settings =
        Settings { plugins: &[], options: Options::default(), significance: 1e-3, snoop: true, tell: &|_| {} };
    let model = Model { datum, ..Model::default() };
    let point = |value: &f64| {
        let set = set.iter().copied().chain([(name, *value)]).map(|(name, value)| (name.to_owned(), value));
        let block = simulate(&Scenario::preset(preset, &set.collect())?, 1)?.block;
        let found = 1e3 * of(&plan(&block, &model, &settings)?).ok_or("a plan without this number")?;
        println!("{preset}, {datum:?}, {name} = {value}: {found:.2} mm");
        Ok([*value, found])
    };
    values.iter().map(point).collect()
}

fn draw(name: &str, title: &str, panels: Vec<Panel>) -> Result<()> {
    let chart = LineChart { title: title.into(), columns: panels.len(), panels, ..LineChart::default() };
    Ok(write(format!("docs/planning-shapes-{name}.svg"), line_chart(&chart))?)
}
