//! The worked examples, each from a clean build outside of the source tree.

use super::place::{Place, example, root};
use misclosure::inject;
use misclosure::io::block::write_block;
use misclosure::scenario::{SurveyNoise, add_survey_noise};
use serde_json::Value;

/// Names of what a diagnosis added.
fn recommended(diagnosis: &Value) -> Vec<&str> {
    diagnosis["recommended"].as_array().expect("a list").iter().filter_map(Value::as_str).collect()
}

/// Estimate and standard deviation of a parameter in the final adjustment of a run.
fn estimated(place: &Place, run: &str, effect: &str, parameter: &str) -> (f64, f64) {
    let summary = std::fs::read_to_string(place.path(run).join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    let found = &summary["effects"][effect][parameter];
    (found["value"].as_f64().expect("a value"), found["sigma"].as_f64().expect("a sigma"))
}

/// A block that no effect of the catalogue explains is explained by one of one's own: the sizes of the recipe are
/// found.
#[test]
fn a_sensor_pattern_explains_what_was_unexplained() {
    let place = Place::new();
    let recipe = root().join("data/hidden/unknown-closerange-stitch.toml");
    let made = place.run(&format!("inject {} -o block", recipe.display()));
    assert_eq!(made.code, Some(0), "{}", made.errors);
    let without = place.json("diagnose block -o without");
    assert_eq!(without["verdict"], "unexplained");
    place.build("sensor-pattern", &example("sensor-pattern.h"));
    let with = place.json("improve block -o with --plugin sensor-pattern.so");
    assert_eq!((&with["verdict"], recommended(&with)), (&"missing".into(), vec!["sensor-pattern"]), "{}", with["left"]);
    assert_eq!(with["ledger"][1]["added"], "sensor-pattern");
    // The recipe: x + 0.15 sin(2 pi x / 250 px) is read where light falls on x.
    for (parameter, expected) in [("a", 0.15), ("b", 0.0)] {
        let (value, sigma) = estimated(&place, "with", "sensor-pattern", parameter);
        assert!((value - expected).abs() < 4.0 * sigma && sigma < 0.02, "{parameter}: {value} ± {sigma}");
    }
    let summary = std::fs::read_to_string(place.path("with/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["agreement"]["one_derivation"], serde_json::json!(["sensor-pattern"]));
    let plugin = &summary["plugins"][0];
    assert_eq!((&plugin["effect"], &plugin["path"]), (&"sensor-pattern".into(), &"sensor-pattern.so".into()));
    // Where a long word may be broken is none of its letters.
    let page = std::fs::read_to_string(place.path("with/report.html")).expect("a page").replace("<wbr>", "");
    for told in
        [plugin["sha256"].as_str().expect("a hash"), "one derivation: solvers not independent here (sensor-pattern)"]
    {
        assert!(page.contains(told), "{told}");
    }
}

/// Vibration at a known frequency, beside the rolling shutter without which it would not show.
#[test]
fn a_vibration_of_known_frequency_is_found_beside_the_rolling_shutter() {
    let place = Place::new();
    let truth = crate::common::preset("dike", &[("points", 500.0), ("check", 40.0)], 7);
    let (amplitude, readout) = (2e-4, 0.02);
    let errors = [format!("vibration:frequency=80,angle={amplitude},readout={readout}"), "noise:px=0.3".into()];
    let errors: Vec<_> = errors.iter().map(|text| inject::parse(text).expect("an error")).collect();
    let mut block = inject::apply(&truth.block, &truth.truth, &errors, 7).expect("a block").block;
    block.sigma.tie_px = 0.3;
    block.sigma.mark_px = 0.3;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, 7);
    write_block(&block, &place.path("block")).expect("written");
    place.build("mount-vibration", &example("mount-vibration.h"));
    let found = place.json("improve block -o run --plugin mount-vibration.so");
    let mut added = recommended(&found);
    added.sort_unstable();
    assert_eq!(
        (&found["verdict"], added),
        (&"missing".into(), vec!["mount-vibration", "rolling-shutter"]),
        "{}",
        found["left"]
    );
    for axis in ["x", "y"] {
        let [(s, sigma), (c, _)] =
            ["s", "c"].map(|part| estimated(&place, "run", "mount-vibration", &format!("{axis}{part}")));
        assert!((s.hypot(c) - amplitude).abs() < 4.0 * sigma, "{axis}: {} ± {sigma}", s.hypot(c));
    }
    let (t, sigma) = estimated(&place, "run", "rolling-shutter", "t");
    assert!((t - readout).abs() < 4.0 * sigma, "{t} ± {sigma}");
}

/// The example in Rust: its derivatives are those of its values, and the program loads it as any other.
#[test]
fn the_rust_example_keeps_the_laws() {
    let place = Place::new();
    for (from, to) in [
        ("examples/rust-effect/Cargo.toml", "lens/Cargo.toml"),
        ("examples/rust-effect/src/lib.rs", "lens/src/lib.rs"),
        ("rust/effect.rs", "lens/src/effect.rs"),
        ("rust/number.rs", "lens/src/number.rs"),
    ] {
        let text = std::fs::read_to_string(root().join(from)).expect("a file of the example");
        std::fs::create_dir_all(place.path("lens/src")).expect("a folder");
        // Outside of the source tree the contract is a copy beside it, as `effects new --rust` writes it.
        place.write(to, &text.replace("#[path = \"../../../rust/effect.rs\"]", ""));
    }
    let built = place.run("effects build lens -o lens-warm-up.so");
    assert_eq!(built.code, Some(0), "{}", built.errors);
    let checked = place.json("effects check lens-warm-up.so");
    assert_eq!((&checked["holds"], &checked["effect"]), (&true.into(), &"lens-warm-up".into()), "{checked}");
    assert_eq!(checked["remarks"], serde_json::json!([]), "{checked}");
    assert_eq!(checked["parameters"][0]["plausible"]["max"], 100.0);
    assert_eq!(checked["picture"], "scale of each image against the time");
    assert!(checked["words"]["what"].as_str().is_some_and(|what| what.starts_with("The lens warms up")), "{checked}");
}
