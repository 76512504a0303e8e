//! Plans of QGroundControl, written by hand.

use super::qgroundcontrol::*;
use super::{Given, Mission};

/// An item; latitudes are given in metres north of 48 degrees (111.2 km a degree).
fn item(command: u64, frame: u64, params: &str) -> String {
    format!(r#"{{"type":"SimpleItem","command":{command},"frame":{frame},"params":[{params}]}}"#)
}

fn fly(frame: u64, north_m: f64, height: f64) -> String {
    item(16, frame, &format!("0,0,0,null,{},7,{height}", 48.0 + north_m / 111_200.0))
}

fn plan(items: &[String]) -> String {
    let items = items.join(",");
    format!(
        r#"{{"fileType":"Plan","mission":{{"firmwareType":12,"vehicleType":2,"cruiseSpeed":15,"hoverSpeed":6,
        "plannedHomePosition":[48,7,100],"items":[{items}]}}}}"#
    )
}

fn planned(items: &[String]) -> Mission {
    read("m.plan", &plan(items), &Given::default()).unwrap()
}

fn survey(items: &[String]) -> String {
    let items = items.join(",");
    format!(r#"{{"type":"ComplexItem","complexItemType":"survey","TransectStyleComplexItem":{{"Items":[{items}]}}}}"#)
}

const EVERY: &str = "20,0,1,0,0,0,0";
const NONE: &str = "0,0,0,0,0,0,0";

#[test]
fn a_survey_has_an_image_each_trigger_distance() {
    let strip = [fly(3, 0.0, 60.0), item(206, 2, EVERY), fly(3, 100.0, 60.0), item(206, 2, NONE), fly(3, 150.0, 60.0)];
    let gimbal = item(205, 2, "-70,0,0,0,0,0,2");
    let mission =
        planned(&[item(22, 3, "0,0,0,null,0,0,60"), gimbal, item(530, 2, NONE), item(115, 2, NONE), survey(&strip)]);
    assert_eq!((mission.exposures.len(), mission.speed_mps), (6, Some(6.0)));
    let first = mission.exposures[0];
    assert_eq!((first.height_m, first.tilt_deg, first.follows_path), (60.0, Some(20.0), true));
    assert_eq!(mission.notes, ["Commands that are not read (how often): 115 (1)."]);
}

#[test]
fn single_images_and_images_by_time_are_read() {
    let single = [item(203, 2, "0,0,0,0,1,0,0"), item(2000, 2, "0,0,1,0,null,null,null")];
    let yaw = item(16, 3, "0,0,0,90,48,7,50");
    let mission = planned(&[yaw.clone(), single[0].clone(), fly(3, 10.0, 50.0), single[1].clone()]);
    let headings: Vec<_> = mission.exposures.iter().map(|own| own.heading_deg.map(f64::round)).collect();
    assert_eq!(headings, [Some(90.0), Some(0.0)]);
    let lock = item(1000, 2, "-90,45,null,null,16,0,0");
    let north = planned(&[lock, yaw, single[1].clone()]);
    assert_eq!(north.exposures[0].heading_deg, Some(45.0));
    // 5 m/s and 4 s: 20 m.
    let timed = [item(178, 2, "1,5,-1,0,0,0,0"), fly(3, 0.0, 50.0), item(2000, 2, "0,4,0,0,null,null,null")];
    let mission = planned(&[&timed[..], &[fly(3, 100.0, 50.0)]].concat());
    assert_eq!((mission.exposures.len(), mission.speed_mps), (6, Some(5.0)));
}

#[test]
fn heights_are_above_the_ground() {
    let shot = item(2000, 2, "0,0,1,0,null,null,null");
    let height = |frame: u64, given: Given| {
        let text = plan(&[fly(frame, 0.0, 150.0), shot.clone()]);
        read("m.plan", &text, &given).unwrap().exposures[0].height_m
    };
    let follows = survey(&[fly(0, 0.0, 150.0), shot.clone()])
        .replace("\"Items\"", "\"CameraCalc\":{\"DistanceMode\":3,\"DistanceToSurface\":30},\"Items\"");
    assert_eq!(planned(&[follows]).exposures[0].height_m, 30.0);
    let ground = |ground_m| Given { ground_m: Some(ground_m), ..Given::default() };
    assert_eq!([height(0, Given::default()), height(3, Given::default())], [50.0, 150.0]);
    assert_eq!([height(0, ground(120.0)), height(3, ground(-5.0)), height(10, ground(9.0))], [30.0, 155.0, 150.0]);
    let homeless = plan(&[fly(0, 0.0, 150.0), shot]).replace("[48,7,100]", "null");
    let error = read("m.plan", &homeless, &Given::default()).unwrap_err().to_string();
    assert!(error.starts_with("m.plan: mission.items[0]: ") && error.contains("--ground"), "{error}");
}

#[test]
fn what_is_not_read_is_refused_with_its_place() {
    for (text, expected) in [
        ("{\n\"a\":}".to_owned(), "m.plan:2:5: not JSON"),
        ("{}".into(), "m.plan: fileType: expected \"Plan\""),
        (
            plan(&["{}".into()]),
            "m.plan: mission.items[0]: type: expected \"SimpleItem\" or \"ComplexItem\", found null",
        ),
        (plan(&[survey(&[item(16, 3, "0")])]), "TransectStyleComplexItem.Items[0]: expected seven params"),
        (plan(&[item(201, 3, NONE)]), "command 201 aims at a place"),
        (plan(&[item(177, 2, NONE)]), "command 177 repeats"),
        (plan(&[item(2000, 2, "0,2,7,0,0,0,0")]), "expected one image"),
        (plan(&[item(16, 3, "0,0,0,0,null,7,5")]), "expected latitude and longitude"),
        (plan(&[fly(7, 0.0, 5.0)]), "frame: expected 0, 3 or 10, found 7"),
        (plan(&[item(205, 2, "-90,5,0,0,0,0,2")]), "without roll"),
    ] {
        let error = read("m.plan", &text, &Given::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}
