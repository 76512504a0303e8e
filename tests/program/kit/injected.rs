//! An effect of one's own as an error: what is injected is what is found, and everything made of it says whose formula
//! it is.

use super::place::{Place, example};
use serde_json::Value;

const SHARED: &str = "was injected by its own formula, which the estimator has too";

fn simulated(place: &Place) {
    let made = place.run("simulate closerange -o exact");
    assert_eq!(made.code, Some(0), "{}", made.errors);
}

#[test]
fn what_is_injected_is_taken_out_to_rounding() {
    let place = Place::new();
    simulated(&place);
    place.build("sensor-pattern", &example("sensor-pattern.h"));
    let error = "sensor-pattern:a=0.3,b=-0.2,wavelength=300";
    let told = place.run(&format!("inject exact -o block --plugin sensor-pattern.so --error {error}"));
    assert_eq!(told.code, Some(0), "{}", told.errors);
    assert!(told.text.replace('\n', " ").contains(SHARED), "{}", told.text);
    let truth = std::fs::read_to_string(place.path("block/truth/errors.json")).expect("the truth");
    let truth: Value = serde_json::from_str(&truth).expect("JSON");
    let told = truth["errors"][0]["shared_formula"].as_str().expect("whose formula");
    assert!(told.starts_with(SHARED) && told.contains("plug-in sensor-pattern.so, SHA-256 "), "{told}");
    // In x alone, by 0.36 / sqrt(2) px in the mean over all phases; over x and y by half of its square.
    let change = truth["change_rms_px"].as_f64().expect("a number");
    assert!((change - 0.18).abs() < 0.01, "{change}");
    let found = place.json("adjust block -o run --plugin sensor-pattern.so --add sensor-pattern:wavelength=300");
    assert!(found["tie_rms_px"].as_f64().expect("a number") < 1e-6, "{}", found["tie_rms_px"]);
    for (parameter, expected) in [("a", 0.3), ("b", -0.2)] {
        let value = found["effects"]["sensor-pattern"][parameter]["value"].as_f64().expect("a value");
        assert!((value - expected).abs() < 1e-6, "{parameter}: {value}");
    }
}

#[test]
fn what_cannot_be_injected_is_refused() {
    let place = Place::new();
    simulated(&place);
    place.build("sensor-pattern", &example("sensor-pattern.h"));
    place.build("noise", &example("sensor-pattern.h").replace("\"sensor-pattern\"", "\"noise\""));
    let refused = |arguments: &str, expected: &str| {
        let run = place.run(&format!("inject exact -o block {arguments}"));
        assert!(run.code == Some(2) && run.errors.contains(expected), "{arguments}: {}", run.errors);
    };
    let plugin = "--plugin sensor-pattern.so --error";
    refused(
        &format!("{plugin} sensor-pattern"),
        "no size is given, so nothing would happen: give one, as sensor-pattern:a=0.2",
    );
    refused(
        &format!("{plugin} sensor-pattern:c=1"),
        "--error sensor-pattern:c=1: `sensor-pattern` has no parameter `c`",
    );
    refused(&format!("{plugin} noise:px=0.1"), "no --error names its effect, `sensor-pattern`");
    refused(
        "--plugin noise.so --error noise:px=0.1",
        "`noise` is an error of this program: give the effect another id",
    );
    assert!(!place.path("block").exists());
}
