//! Steps: the error falls when the right effect is added, comes back when it is removed, and what is shown is what the
//! report shows.

use super::program::{Lab, block};
use serde_json::{Value, json};
use std::fs;

fn check_mm(node: &Value) -> f64 {
    1e3 * node["figures"]["check_rms_m"].as_f64().expect("check points")
}

#[test]
fn an_effect_is_added_removed_and_the_error_follows() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    let base = lab.done(1);
    assert_eq!(base["verdict"], "missing");
    assert_eq!(base["agree"], true);
    assert!((check_mm(&base) - 17.5).abs() < 0.1, "{base}");

    // Before any refit the null model says what will come.
    let predicted = lab.get("nodes/1/predicted/rolling-shutter").json();
    assert!((1e3 * predicted["check_rms_m"].as_f64().expect("a number") - 4.4).abs() < 0.3, "{predicted}");
    assert!((predicted["tie_rms_px"].as_f64().expect("a number") - 0.241).abs() < 0.003, "{predicted}");

    let right = lab.step(1, json!({ "kind": "add", "effect": "rolling-shutter" }));
    let right = lab.done(right);
    assert!((check_mm(&right) - 4.4).abs() < 0.1, "{right}");
    assert!(right["delta_words"].as_str().expect("words").starts_with("check points 17.5 → 4.4 mm"), "{right}");

    // The sentence of the report, which the report of the step has, too.
    let moved = right["moved"].as_str().expect("a sentence");
    assert!(moved.starts_with("Rolling shutter (19.") && moved.contains(" moved your points by "), "{moved}");
    assert!(moved.contains("With it in the model the check-point error falls from 17.5 to 4.4 mm"), "{moved}");
    let page = fs::read_to_string(folder.path().join("lab/step-0002/report.html")).expect("a page");
    let told: String = page.split('<').map(|part| part.split_once('>').map_or(part, |(_, text)| text)).collect();
    assert!(told.contains(moved), "{moved}");
    assert_eq!(base["moved"], Value::Null);

    let wrong = lab.done(lab.step(1, json!({ "kind": "add", "effect": "gnss-shift" })));
    assert!(check_mm(&wrong) > 10.0, "{wrong}");
    let removed = lab
        .done(lab.step(wrong["id"].as_u64().expect("a number"), json!({ "kind": "remove", "effect": "gnss-shift" })));
    assert!((check_mm(&removed) - check_mm(&base)).abs() < 0.1 && removed["moved"].is_null(), "{removed}");

    // What cannot be is said, and leaves no folder.
    for (change, said) in [
        (json!({ "kind": "remove", "effect": "rolling-shutter" }), "is not in the model"),
        (json!({ "kind": "datum", "datum": "all" }), "is so already"),
        (json!({ "kind": "set_aside", "measurements": [{ "image": "nowhere", "point": "1" }] }), "nowhere"),
        (json!({ "kind": "free", "parameters": ["q"] }), "no camera parameter or group"),
    ] {
        let node = lab.wait(lab.step(1, change), &["failed", "done"]);
        assert_eq!(node["state"], "failed", "{node}");
        assert!(node["error"].as_str().is_some_and(|error| error.contains(said)), "{node}");
        assert!(!folder.path().join(format!("lab/step-{:04}", node["id"].as_u64().expect("a number"))).exists());
    }
    for body in [
        json!({ "parent": 1, "change": { "kind": "add", "effect": "nothing" } }),
        json!({ "parent": 1, "change": { "kind": "dance" } }),
        json!({ "parent": 1, "change": { "kind": "base" } }),
        json!({ "change": { "kind": "improve" } }),
    ] {
        assert_eq!(lab.post("steps", &body).status, 400, "{body}");
    }
    assert_eq!(lab.post("steps", &json!({ "parent": 99, "change": { "kind": "improve" } })).status, 404);
}

#[test]
fn do_all_goes_the_way_of_improve_step_by_step_and_ends_when_cancelled() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    lab.done(1);
    let cancelled = lab.step(1, json!({ "kind": "add", "effect": "rolling-shutter" }));
    assert_eq!(lab.post(&format!("steps/{cancelled}/cancel"), &json!({})).status, 200);
    assert_eq!(lab.wait(cancelled, &["cancelled", "done", "failed"])["state"], "cancelled");
    assert!(!folder.path().join(format!("lab/step-{cancelled:04}")).exists());

    let first = lab.done(lab.step(1, json!({ "kind": "improve" })));
    assert_eq!(first["words"], "+ rolling-shutter");
    let last = loop {
        let tree = lab.get("tree").json();
        let nodes = tree["nodes"].as_array().expect("nodes");
        let at_work = nodes.iter().any(|node| node["state"] == "running" || node["state"] == "waiting");
        let last = nodes.iter().rfind(|node| node["state"] == "done").expect("a step");
        if !at_work && last["verdict"] != "missing" {
            break last.clone();
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    };
    let words: Vec<String> = {
        let tree = lab.get("tree").json();
        tree["nodes"]
            .as_array()
            .expect("nodes")
            .iter()
            .map(|node| node["words"].as_str().unwrap_or("").into())
            .collect()
    };
    // This block cannot tell the two apart.
    let growing = ["+ focal-temperature", "+ focal-time"];
    assert!(words.iter().any(|words| growing.contains(&words.as_str())), "{words:?}");
    // 3.4 mm with the one, 4.3 mm with the other, 17.5 mm before.
    assert!(check_mm(&last) < 5.0, "{last}");
}

#[test]
fn figures_are_those_of_the_report_and_a_brush_stands_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    lab.done(1);
    for (name, file, keys) in [
        (
            "sensor",
            "sensor-final-1",
            &[" data-view=\"sensor\" data-camera=\"0\"", " data-xkey=\"x\"", " data-ykey=\"y\""][..],
        ),
        ("histogram", "residual-histogram", &[" data-view=\"histogram\" data-component=\"x\"", " data-xkey=\"range\""]),
        ("images", "image-rms", &[" data-view=\"images\"", " data-xkey=\"range\""]),
        ("gnss", "gnss-plan", &[" data-view=\"flights\"", " data-xkey=\"e\"", " data-ykey=\"n\""]),
        ("plan", "check-plan", &[" data-view=\"plan\"", " data-xkey=\"e\"", " data-ykey=\"n\""]),
    ] {
        let mut shown = lab.get(&format!("nodes/1/figures/{name}.svg")).text();
        for key in keys {
            assert!(shown.contains(key), "{name}: {key}");
            shown = shown.replace(key, "");
        }
        let path = folder.path().join(format!("lab/step-0001/figures/{file}.svg"));
        let kept = fs::read_to_string(&path).expect("a figure");
        assert!(kept.contains(shown.trim_end()), "{name}: one drawing of each picture");
    }
    // The cells of the sensor hold every measurement that was adjusted, whether or not some are brushed.
    let of_cells = |query: &str| -> u64 {
        let shown = lab.get(&format!("nodes/1/figures/sensor.svg?{query}")).text();
        let words = shown.split("<title>").skip(2).filter_map(|rest| rest.split_once(" measurement"));
        words.filter_map(|(n, _)| n.trim_start_matches("brushed: ").parse::<u64>().ok()).sum()
    };
    // A tenth of the rows, in every figure and in the summary.
    let all = lab.get("nodes/1/measurements?limit=0").json();
    let brush = "brush=%7B%22view%22:%22profile%22,%22against%22:%22row%22,%22range%22:%5B0,384%5D%7D";
    let some = lab.get(&format!("nodes/1/measurements?limit=7&{brush}")).json();
    let (n, total) = (some["n"].as_u64().expect("a number"), all["total"].as_u64().expect("a number"));
    assert!(n > 0 && n < total / 5, "{n} of {total}");
    assert_eq!(all["n"], all["total"]);
    assert_eq!(some["rows"].as_array().expect("rows").len(), 7);
    assert!(some["rows"].as_array().expect("rows").iter().all(|row| row["y"].as_f64().is_some_and(|y| y <= 384.0)));
    let marks = |answer: &Value| answer["marks"]["n"].as_u64().expect("a number");
    assert!((n - marks(&some)..n).contains(&of_cells(brush)), "of tie points, and of control points");
    let everything = "brush=%7B%22view%22:%22profile%22,%22against%22:%22order%22,%22range%22:%5B0,1e9%5D%7D";
    assert_eq!(of_cells(""), of_cells(everything));
    assert!((total - marks(&all)..total).contains(&of_cells("")));
    // What cannot be predicted is refused with the reason.
    let refused = lab.get("nodes/1/predicted/nothing/figures/sensor.svg");
    assert_eq!(refused.status, 400);
    assert!(refused.text().contains("is no candidate"), "{}", refused.text());
    assert_eq!(lab.get("nodes/1/predicted/image-grid/figures/sensor.svg").status, 200);
    let shown = |what: &str, query: &str| {
        let answer = lab.get(&format!("nodes/1/figures/{what}{query}"));
        assert_eq!(answer.status, 200, "{what}: {}", answer.text());
        assert!(answer.text().contains("<svg"), "{what}");
        answer.text()
    };
    // These rows are in every image, and not in the first one alone.
    let first = "brush=%7B%22view%22:%22images%22,%22ids%22:%5B0%5D%7D";
    for (what, brush) in [
        ("sensor.svg?", brush),
        ("image.svg?", brush),
        ("images.svg?", first),
        ("plan.svg?", brush),
        ("height.svg?", brush),
        ("flights.svg?", first),
        ("gnss.svg?show=plan&", first),
        ("gnss.svg?show=height&", first),
        ("gnss.svg?show=time&", first),
        ("gnss.svg?show=heading&", first),
        ("profile.svg?", brush),
        ("histogram.svg?", brush),
        ("checks.svg?", brush),
    ] {
        assert_ne!(shown(what, ""), shown(what, brush), "{what}");
    }
    for (show, file) in [("height", "gnss-height"), ("time", "gnss-time"), ("heading", "gnss-heading")] {
        let kept = fs::read_to_string(folder.path().join(format!("lab/step-0001/figures/{file}.svg"))).expect(file);
        let without_keys = |svg: String| -> String {
            svg.split(' ').filter(|word| !word.starts_with("data-view") && !word.contains("key=")).collect()
        };
        let own = shown(&format!("gnss.svg?show={show}"), "").replace(&format!(" data-against=\"{show}\""), "");
        assert!(without_keys(kept).contains(without_keys(own).trim_end()), "{show}: one drawing of each picture");
    }
    assert_eq!(lab.get("nodes/1/figures/gnss.svg?show=sideways").status, 400);
    let predicted = lab.get("nodes/1/predicted/gnss-shift/figures/gnss.svg").text();
    assert!(predicted.contains("Predicted: GNSS positions"), "{}", &predicted[..300]);
    let locked = lab.get("nodes/1/figures/sensor.svg?scale=123.5").text();
    assert!(locked.contains("data-scale=\"123.5\""));
    let narrow = lab.get("nodes/1/figures/profile.svg?width=400&against=row").text();
    assert!(narrow.contains("width=\"400\""), "{}", &narrow[..300]);
    let space = lab.get("nodes/1/space").body;
    let length = u32::from_le_bytes(space[..4].try_into().expect("four bytes")) as usize;
    let header: Value = serde_json::from_slice(&space[4..4 + length]).expect("a header");
    let numbers: u64 = (header["arrays"].as_array().expect("arrays").iter())
        .map(|array| array["rows"].as_u64().unwrap_or(0) * array["columns"].as_array().map_or(0, |c| c.len() as u64))
        .sum();
    assert_eq!(space.len() as u64, 4 + length as u64 + 4 * numbers);
    let ties = header["arrays"].as_array().and_then(|all| all.iter().find(|array| array["name"] == "ties"));
    assert_eq!(ties.expect("tie points")["rows"], header["ties"]["rows"], "no more of them than are drawn");
    // Half of the picture of a camera high above, as one would drag it in 3D: the points east of the middle.
    let above = "%7B%22view%22:%22space%22,%22matrix%22:%5B1,0,0,0,0,1,0,0,0,0,0,-1,0,0,0,1000%5D,\
                 %22x%22:%5B0,1%5D,%22y%22:%5B-1,1%5D%7D";
    let east = lab.get(&format!("nodes/1/measurements?limit=1000&brush={above}")).json();
    let block = lab.get("block").json();
    let origin = block["origin"][0].as_f64().expect("an origin");
    let plan = "%7B%22view%22:%22plan%22,%22e%22:%5BLOW,1e9%5D%7D".replace("LOW", &format!("{origin}"));
    let same = lab.get(&format!("nodes/1/measurements?limit=0&brush={plan}")).json();
    assert!(east["n"].as_u64().is_some_and(|n| n > 0 && n < total), "{east}");
    assert_eq!(east["n"], same["n"]);
}
