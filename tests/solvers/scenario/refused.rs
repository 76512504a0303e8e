//! Wrong parameters and scenarios are refused, and the message names what is wrong.

use misclosure::scenario::{Scenario, preset_text, simulate};
use std::collections::BTreeMap;

#[test]
fn wrong_parameters_are_named() {
    let message = |name: &str, key: &str, value: f64| {
        Scenario::preset(name, &BTreeMap::from([(key.to_string(), value)])).unwrap_err().to_string()
    };
    assert_eq!(
        Scenario::preset("dyke", &BTreeMap::new()).unwrap_err().to_string(),
        "unknown preset \"dyke\": expected one of dike, corridor, mapping, closerange"
    );
    assert_eq!(message("corridor", "length_m", 100.0), "corridor: length_m = 100: expected 200 to 10000");
    assert_eq!(message("corridor", "length_m", f64::NAN), "corridor: length_m = NaN: expected 200 to 10000");
    assert_eq!(
        message("dike", "lenght", 1.0),
        "dike has no parameter \"lenght\": expected one of check, control, control_xy_m, control_z_m, forward_overlap, \
         gnss_xy_m, gnss_z_m, height_m, points, tilt_deg"
    );
    assert_eq!(message("dike", "points", 1000.5), "dike: points = 1000.5: expected a whole number");
}

#[test]
fn wrong_scenarios_are_refused_by_line_or_key() {
    let dike = preset_text("dike").unwrap();
    let message = |from: &str, to: &str| {
        assert!(dike.contains(from), "{from}");
        match Scenario::from_toml(&dike.replacen(from, to, 1), "my.toml") {
            Err(error) => error.to_string(),
            Ok(scenario) => simulate(&scenario, 1).expect_err(to).to_string(),
        }
    };
    let typo = message("speed_mps = 5.0", "sped_mps = 5.0");
    let line = 1 + dike.lines().position(|line| line == "speed_mps = 5.0").unwrap();
    assert!(typo.starts_with("my.toml: ") && typo.contains(&format!("line {line}, column 1")), "{typo}");
    assert!(typo.contains("unknown field `sped_mps`"), "{typo}");
    let unclosed = message("name = \"dike\"", "name = \"dike");
    assert!(unclosed.contains("line "), "{unclosed}");
    let terrain = message("slope_run = 2.5", "slope = 2.5");
    assert!(terrain.contains("column 1") && terrain.contains("unexpected keys in table: slope"), "{terrain}");
    for (from, to, expected) in [
        ("f = 5510.09", "f = -1.0", "camera.0.f = -1.0: expected more than 0"),
        ("height_m = 50.0", "height_m = nan", "flight.0.height_m = NaN: expected more than 0"),
        ("[15, 14, 15]", "[15, 29]", "flight.0.images = [15, 29]: expected 3 numbers from 1 to a million"),
        ("images = [15, 14, 15]", "", "flight.0.images, forward_overlap = (None, None): expected one of the two"),
        ("[15, 14, 15]", "[900000, 900000, 1]", "flight.0.images = 1800001.0: expected at most a million"),
        (
            "control = { count = 10 }",
            "control = { count = 10_001 }",
            "surveyed.control.count = 10001: expected at most 10000",
        ),
        ("side_overlap = 0.7", "side_overlap = 1.0", "flight.0.side_overlap = 1.0: expected more than 0, at most 0.99"),
        ("side_overlap = 0.7", "side_overlap = 0.0", "flight.0.side_overlap = 0.0: expected more than 0, at most 0.99"),
        ("\"nadir50\"", "\"oblique50\"", "flight.name = \"oblique50\": expected a name that no other one has"),
        ("[[flight]]", "[[flight]]\ncamera = \"x\"", "flight.0.camera = Some(\"x\"): expected one of cam"),
        ("tilt_deg = 30.0", "tilt_deg = 80.0", "flight.0.tilt_deg = 80.0: expected -60 to 60"),
        ("best = 0.62", "best = 1.5", "ties.detection.best = 1.5: expected more than 0, at most 1"),
        ("count = 14000", "count = 0", "number of tie points = 0: expected 1 to 100 million"),
        ("length_m = 200.0", "length_m = inf", "terrain.length_m = inf: expected more than 0"),
        ("constant_s = 400.0", "constant_s = 0", "temperature.time_constant_s = 0.0: expected more than 0"),
        ("count = 5000", "count = 5, max_marks = 1", "surveyed.check.max_marks = Some(1): expected at least 3"),
        (
            "[15, 14, 15]",
            "[3, 3, 3]",
            "no image of flight oblique50 shares ground with the next one of its strip. They are 100 m apart, and an \
             image is 46 m long on the ground: fly higher, or take images more often",
        ),
        ("best = 0.62", "best = 1e-9", "no place found for a tie point: none of 1000 is seen by 2 images"),
    ] {
        assert_eq!(message(from, to), format!("dike: {expected}"));
    }
}
