//! Every path that the system allows works.

use super::place::{Place, is_whole, odd};
use std::ffi::{OsStr, OsString};
use std::fs;

#[test]
fn a_path_that_is_no_text_serves_as_input_and_as_output() {
    let place = Place::new();
    fs::create_dir(place.at(odd())).unwrap();
    let inside = |name: &str| place.at(odd()).join(name).into_os_string();
    let run = |words: &[&OsStr]| place.run(words).expect(0, "");
    let word = OsStr::new;
    let (block, out) = (inside("block"), inside("out"));
    run(&[word("simulate"), word("closerange"), word("-o"), &inside("truth"), word("--set"), word("points=150")]);
    run(&[word("inject"), &inside("truth"), word("-o"), &block, word("--error"), word("noise:px=0.3"), word("--json")]);
    run(&[word("check"), &block, word("--json")]);
    for command in ["adjust", "diagnose", "improve"] {
        run(&[word(command), &block, word("-o"), &inside(command), word("--json"), word("--solver"), word("native")]);
        is_whole(&place.at(inside(command))).unwrap();
    }
    run(&[word("report"), &inside("adjust"), word("--json")]);
    run(&[word("adjust"), &block, word("-o"), &inside("again"), word("--model"), &inside("adjust/model.toml")]);
    run(&[word("export"), word("colmap"), &inside("adjust"), word("-o"), &out, word("--approximate"), word("--json")]);
    run(&[word("import"), word("colmap"), &out, word("-o"), &inside("back"), word("--json")]);
    run(&[word("import"), &out, word("-o"), &inside("guessed")]);
    run(&[word("validate"), word("pair"), word("--suite"), &inside("suite"), word("--json")]);
    let mut scenario = inside("scenario");
    scenario.push(OsString::from(".toml"));
    fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenarios/closerange.toml"), &scenario).unwrap();
    run(&[word("simulate"), &scenario, word("-o"), &inside("own"), word("--set"), word("points=50")]);
}

#[test]
fn json_has_no_path_as_bytes() {
    // `json!` panics on a path that is not UTF-8, so every path goes through `path_text`.
    let place = Place::new();
    let out = place.at(odd());
    let ended = place.run([
        OsStr::new("import"),
        "colmap".as_ref(),
        "colmap".as_ref(),
        "-o".as_ref(),
        out.as_os_str(),
        "--json".as_ref(),
    ]);
    ended.expect(0, "");
    let json: serde_json::Value = serde_json::from_str(&ended.text).unwrap();
    assert!(json["folder"].as_str().unwrap().ends_with("q\u{fffd}"), "{json}");
}
