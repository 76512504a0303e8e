//! Missions of DJI, written by hand.

use super::wpml::*;
use super::{Given, Mission, Result};

/// A waypoint, metres north of 48 degrees (111.2 km a degree).
fn waypoint(index: u32, north_m: f64, inside: &str) -> String {
    format!(
        "<Placemark><Point><coordinates>7,{}</coordinates></Point><wpml:index>{index}</wpml:index>\
         <wpml:executeHeight>60</wpml:executeHeight>{inside}</Placemark>",
        48.0 + north_m / 111_200.0
    )
}

fn group(from: u32, to: u32, trigger: &str, actions: &[(&str, &str)]) -> String {
    let actions: String = actions
        .iter()
        .map(|(name, param)| {
            format!(
                "<wpml:action><wpml:actionActuatorFunc>{name}</wpml:actionActuatorFunc>\
                 <wpml:actionActuatorFuncParam>{param}</wpml:actionActuatorFuncParam></wpml:action>"
            )
        })
        .collect();
    format!(
        "<wpml:actionGroup><wpml:actionGroupStartIndex>{from}</wpml:actionGroupStartIndex>\
         <wpml:actionGroupEndIndex>{to}</wpml:actionGroupEndIndex><wpml:actionTrigger>{trigger}\
         </wpml:actionTrigger>{actions}</wpml:actionGroup>"
    )
}

fn folder(mode: &str, placemarks: &str) -> String {
    format!(
        "<Folder><wpml:executeHeightMode>{mode}</wpml:executeHeightMode>\
         <wpml:autoFlightSpeed>8</wpml:autoFlightSpeed>{placemarks}</Folder>"
    )
}

fn planned(folders: &str, given: Given) -> Result<Mission> {
    let text = format!("<kml xmlns:wpml=\"http://www.dji.com/wpmz/1.0.2\"><Document>{folders}</Document></kml>");
    read("m.wpml", &text, &given)
}

const START: &str = "relativeToStartPoint";
const REACH: &str = "<wpml:actionTriggerType>reachPoint</wpml:actionTriggerType>";
const PHOTO: (&str, &str) = ("takePhoto", "");

fn every(kind: &str, param: f64) -> String {
    format!(
        "<wpml:actionTriggerType>{kind}</wpml:actionTriggerType>\
         <wpml:actionTriggerParam>{param}</wpml:actionTriggerParam>"
    )
}

fn pitch(angle: f64) -> String {
    format!(
        "<wpml:gimbalPitchRotateEnable>1</wpml:gimbalPitchRotateEnable>\
         <wpml:gimbalPitchRotateAngle>{angle}</wpml:gimbalPitchRotateAngle>"
    )
}

#[test]
fn distance_and_time_trigger_images_between_their_waypoints() {
    let down = pitch(-90.0);
    for (trigger, count) in [(every("multipleDistance", 25.0), 5), (every("multipleTiming", 2.5), 6)] {
        let groups = group(0, 0, REACH, &[("gimbalRotate", &down)]) + &group(0, 1, &trigger, &[PHOTO]);
        // The order is that of the index, not of the file.
        let placemarks = waypoint(2, 200.0, "") + &waypoint(0, 0.0, &groups) + &waypoint(1, 100.0, "");
        let mission = planned(&folder(START, &placemarks), Given::default()).unwrap();
        assert_eq!((mission.exposures.len(), mission.speed_mps), (count, Some(8.0)), "{trigger}");
        assert!(mission.exposures.iter().all(|own| own.tilt_deg == Some(0.0) && own.height_m == 60.0));
        assert!(mission.exposures.iter().all(|own| own.heading_deg.is_some_and(|h| h.abs() < 1e-6)));
    }
}

#[test]
fn images_at_waypoints_have_the_camera_turned_before() {
    let heading = "<wpml:waypointHeadingParam><wpml:waypointHeadingMode>smoothTransition</wpml:waypointHeadingMode>\
                   <wpml:waypointHeadingAngle>30</wpml:waypointHeadingAngle></wpml:waypointHeadingParam>";
    let between = "<wpml:actionTriggerType>betweenAdjacentPoints</wpml:actionTriggerType>";
    let (tilted, level) = (pitch(-60.0), pitch(-70.0));
    let first = group(0, 0, REACH, &[("gimbalRotate", &tilted), PHOTO, ("hover", "")])
        + &group(0, 1, between, &[("gimbalEvenlyRotate", &level)]);
    let turned = ("rotateYaw", "<wpml:aircraftHeading>-90</wpml:aircraftHeading>");
    let second = group(1, 1, REACH, &[PHOTO, turned, PHOTO]);
    let placemarks =
        waypoint(0, 0.0, &(heading.to_owned() + &first)) + &waypoint(1, 20.0, &(heading.to_owned() + &second));
    // Each folder is a path of its own.
    let mission = planned(&folder(START, &placemarks).repeat(2), Given::default()).unwrap();
    let aims: Vec<_> = mission.exposures.iter().map(|own| (own.heading_deg.unwrap(), own.tilt_deg.unwrap())).collect();
    let once = [(30.0, 30.0), (30.0, 20.0), (270.0, 20.0)];
    assert_eq!(aims, [once, once].concat());
    assert!(mission.exposures.iter().all(|own| !own.follows_path));
}

#[test]
fn a_mapping_flight_takes_images_by_time_with_the_camera_locked() {
    let between = "<wpml:actionTriggerType>betweenAdjacentPoints</wpml:actionTriggerType>";
    let tilted = pitch(-45.0);
    let lapse = ("startTimeLapse", "<wpml:minShootInterval>2.5</wpml:minShootInterval>");
    let groups = group(0, 1, between, &[("gimbalAngleLock", ""), ("gimbalRotate", &tilted), lapse])
        + &group(0, 1, &every("multipleTiming", 2.5), &[("gimbalRotate", &tilted)])
        + &group(1, 1, REACH, &[("stopTimeLapse", ""), ("gimbalAngleUnlock", "")]);
    let placemarks = waypoint(0, 0.0, &groups) + &waypoint(1, 100.0, "") + &waypoint(2, 200.0, "");
    let mission = planned(&folder(START, &placemarks), Given::default()).unwrap();
    // 8 m/s and 2.5 s: 20 m.
    assert_eq!(mission.exposures.len(), 6, "{mission:?}");
    assert!(mission.exposures.iter().all(|own| own.tilt_deg == Some(45.0)));
}

#[test]
fn the_gimbal_of_a_waypoint_counts_where_no_action_turns_it() {
    let gimbal = "<wpml:waypointGimbalHeadingParam>\
                  <wpml:waypointGimbalPitchAngle>-80</wpml:waypointGimbalPitchAngle>\
                  </wpml:waypointGimbalHeadingParam>";
    let tilt = |action: (&str, &str)| {
        let inside = gimbal.to_owned() + &group(0, 0, REACH, &[action, PHOTO]);
        planned(&folder(START, &waypoint(0, 0.0, &inside)), Given::default()).unwrap().exposures[0].tilt_deg
    };
    assert_eq!(tilt(("hover", "")), Some(10.0));
    assert_eq!(tilt(("gimbalRotate", &pitch(-75.0))), Some(15.0));
}

#[test]
fn what_is_not_read_is_refused_with_its_place() {
    let shot = group(0, 0, REACH, &[PHOTO]);
    let one = |mode: &str, inside: &str| folder(mode, &waypoint(0, 0.0, inside));
    let ground = Given { ground_m: Some(45.0), ..Given::default() };
    assert_eq!(planned(&one("WGS84", &shot), ground).unwrap().exposures[0].height_m, 15.0);
    let (timing, odd) = (every("multipleDistance", 9.0), every("odd", 1.0));
    let mode = |mode: &str| {
        format!("<waypointHeadingParam><waypointHeadingMode>{mode}</waypointHeadingMode></waypointHeadingParam>")
    };
    for (folders, expected) in [
        (String::new(), "<kml>: expected a <Folder> with waypoints"),
        (one("WGS84", &shot), "--ground"),
        (one("EGM96", &shot), "executeHeightMode \"EGM96\": expected relativeToStartPoint"),
        (one(START, &group(0, 0, REACH, &[("panoShot", "")])), "\"panoShot\" is not read"),
        (one(START, &group(0, 1, &timing, &[("rotateYaw", "")])), "\"rotateYaw\" is not read where distance"),
        (one(START, &group(0, 1, &odd, &[PHOTO])), "actionTriggerType \"odd\": expected reachPoint"),
        (one(START, &group(7, 9, REACH, &[PHOTO])), "actionGroupStartIndex: expected the index of a waypoint"),
        (one(START, &mode("odd")), "waypointHeadingMode \"odd\" is not known"),
        (one(START, &mode("towardPOI")), "waypointPoiPoint: expected latitude"),
        (folder(START, "<Placemark><index>0</index></Placemark>"), "<Placemark>: expected <Point> in it"),
        (folder(START, "<Placemark/>"), "<Placemark>: expected <index> in it"),
    ] {
        let error = planned(&folders, Given::default()).unwrap_err().to_string();
        assert!(error.starts_with("m.wpml:1:") && error.contains(expected), "{error}");
    }
}
