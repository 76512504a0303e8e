//! What holds for every cause: zero changes nothing, the same seed gives the same bytes, errors are said clearly.

use crate::inject::fixture::{HEIGHT, WIDTH, distance, inject, pairs, truth};
use misclosure::inject::{DefaultValue, apply, find, parse, registry};

/// Every cause at zero size.
const ZERO: [&str; 30] = [
    "calibration:f=0",
    "start:position_m=0,angle_deg=0",
    "earth-curvature:q=0",
    "refraction:strength=0",
    "flat-port:thickness=0",
    "rolling-shutter:readout=0",
    "forward-motion:exposure=0",
    "vibration:angle=0",
    "temperature-focal:alpha=0",
    "focal-growth:b=0",
    "focal-steps:size=0",
    "focus-hunting:size=0",
    "pp-drift:x=0",
    "pp-steps:size=0",
    "sensor-jitter:size=0",
    "lens-sag:lateral=0",
    "radial-high:corner=0",
    "decentring-high:corner=0",
    "unflatness:saddle=0,bend=0",
    "homothety:lambda=0",
    "local-flaw:lambda=0",
    "sensor-stitch:amplitude=0",
    "gnss-delay:dt=0",
    "gnss-lever-arm:y=0,z=0",
    "gnss-shift:z=0",
    "gnss-drift:offset_m=0,rate=0",
    "map-scale:m=0",
    "control-blunder:size=0",
    "outliers:fraction=0",
    "noise:px=0",
];

/// What a bare id needs beside its defaults to do something on the block of these tests.
fn visible(id: &str) -> String {
    match id {
        "calibration" => "calibration:f=25".into(),
        "forward-motion" => "forward-motion:exposure=0.005".into(),
        "exact-marks" => "exact-marks".into(),
        other => other.into(),
    }
}

#[test]
fn zero_changes_no_bit() {
    let truth = truth();
    assert_eq!(inject(&truth, &[]).block, truth);
    for cause in registry() {
        let zero: Vec<_> = ZERO.iter().filter(|zero| zero.split(':').next() == Some(cause.id())).collect();
        if cause.id() == "exact-marks" {
            continue; // It has no size; alone it changes nothing either, see below.
        }
        assert_eq!(zero.len(), 1, "{} is in the list", cause.id());
        assert_eq!(inject(&truth, &[zero[0]]).block, truth, "{}", zero[0]);
    }
    assert_eq!(inject(&truth, &["exact-marks"]).block, truth);
    assert_eq!(inject(&truth, &ZERO).block, truth, "all together");
}

#[test]
fn every_cause_does_something_and_the_same_again() {
    let truth = truth();
    for cause in registry() {
        let error = visible(cause.id());
        let first = inject(&truth, &[&error]);
        if cause.id() != "exact-marks" {
            assert_ne!(first.block, truth, "{error}");
        }
        assert_eq!(first.block, inject(&truth, &[&error]).block, "{error}");
        assert_eq!(first.report.applied.len(), 1);
        assert!(!cause.summary().is_empty());
    }
}

#[test]
fn order_of_naming_and_number_of_threads_do_not_matter() {
    let truth = truth();
    let errors = ["noise:px=0.3,gnss=1,control=1", "rolling-shutter", "local-flaw", "sensor-jitter", "outliers"];
    let mut reversed = errors;
    reversed.reverse();
    let block = inject(&truth, &errors).block;
    assert_eq!(block, inject(&truth, &reversed).block);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(block, pool.install(|| inject(&truth, &errors).block), "{threads} threads");
    }
    let other_seed = apply(&truth, &truth, &errors.map(|error| parse(error).unwrap()), 8).unwrap();
    assert_ne!(block, other_seed.block);
}

#[test]
fn another_cause_does_not_change_the_noise() {
    let truth = truth();
    let noise = |with: &[&str], without: &[&str]| -> Vec<[f64; 2]> {
        let (with, without) = (inject(&truth, with).block, inject(&truth, without).block);
        with.ties.iter().zip(&without.ties).map(|(a, b)| [a.x - b.x, a.y - b.y]).collect()
    };
    let alone = noise(&["noise:px=0.3"], &[]);
    // A small disturbance that loses no measurement.
    let along = noise(&["noise:px=0.3", "sensor-stitch:amplitude=0.01"], &["sensor-stitch:amplitude=0.01"]);
    assert_eq!(alone.len(), along.len());
    for (a, b) in alone.iter().zip(&along) {
        // Differences of pixel coordinates: rounding of numbers below 8192.
        assert!((a[0] - b[0]).abs() < 1e-11 && (a[1] - b[1]).abs() < 1e-11);
    }
}

#[test]
fn small_causes_together_are_the_sum_of_each() {
    let truth = truth();
    // The smooth flaw: at the centre of the other one the smallest shift turns its direction.
    let each = [
        "rolling-shutter:readout=0.01",
        "focal-steps:steps=1/-2",
        "local-flaw:lambda=4,sigma=2000,smooth=1",
        "flat-port",
    ];
    let moved = |errors: &[&str]| {
        let block = inject(&truth, errors).block;
        let moved = pairs(&truth, &block).into_iter().map(|(image, point, before, after)| {
            let key = (image, point.x.to_bits(), point.y.to_bits());
            (key, [after[0] - before[0], after[1] - before[1]])
        });
        moved.collect::<std::collections::HashMap<_, _>>()
    };
    let singles: Vec<_> = each.iter().map(|error| moved(&[error])).collect();
    let mut compared = 0;
    for (key, together) in moved(&each) {
        let parts: Vec<[f64; 2]> = singles.iter().filter_map(|single| single.get(&key).copied()).collect();
        if parts.len() < each.len() {
            continue; // Lost under one of them.
        }
        let sum = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        let size: f64 = parts.iter().map(|part| part[0].hypot(part[1])).sum();
        // Second order: pixels over the size of the flaw, a thousandth of the scale, and the like.
        assert!(distance(together, sum) < 5e-3 * size, "{together:?} {sum:?}");
        compared += 1;
    }
    assert!(compared * 2 > truth.ties.len());
}

#[test]
fn a_ray_that_cannot_be_is_counted() {
    let truth = truth();
    // A window 58 m in front of the lens: points between lens and window, or in it, have no ray through it.
    let dropped = inject(&truth, &["flat-port:distance=58,thickness=0.01"]).report.dropped;
    let seen = truth.ties.iter().map(|tie| (tie.image, truth.tie_points[tie.point.index()].position.unwrap()));
    let seen = seen.chain(truth.marks.iter().map(|mark| (mark.image, truth.surveyed[mark.point.index()].position)));
    let before =
        seen.filter(|(image, point)| truth.images[image.index()].pose.cam_from_world(point).z <= 58.01).count();
    assert!(before > 20);
    assert_eq!(dropped.no_solution, before);
}

#[test]
fn absurd_sizes_are_refused_or_measured_but_never_a_panic() {
    let truth = truth();
    for cause in registry() {
        for parameter in cause.parameters() {
            if !matches!(parameter.default, DefaultValue::Number(_) | DefaultValue::Optional(_)) {
                continue;
            }
            for size in ["1e300", "-1e300", "1e-300", "1e6", "-1", "0", "0.7"] {
                let error = format!("{}:{}={size}", cause.id(), parameter.name);
                let Ok(injected) = apply(&truth, &truth, &[parse(&error).unwrap()], 1) else { continue };
                let block = injected.block;
                let inside = |x: f64, y: f64| (0.0..=WIDTH).contains(&x) && (0.0..=HEIGHT).contains(&y);
                assert!(block.ties.iter().chain(&block.marks).all(|seen| inside(seen.x, seen.y)), "{error}");
                assert!(block.images.iter().all(|image| image.gnss.unwrap().position.iter().all(|v| v.is_finite())));
            }
        }
    }
}

#[test]
fn what_leaves_the_sensor_is_dropped_and_counted() {
    let truth = truth();
    let injected = inject(&truth, &["homothety:lambda=0.3"]);
    let moved_off = |x: f64, y: f64| {
        let away = |value: f64, centre: f64| value + 0.3 * (value - centre);
        let (x, y) = (away(x, 2539.75), away(y, 1945.80));
        !(0.0..=WIDTH).contains(&x) || !(0.0..=HEIGHT).contains(&y)
    };
    let expected = truth.ties.iter().chain(&truth.marks).filter(|seen| moved_off(seen.x, seen.y)).count();
    let dropped = injected.report.dropped;
    assert!(expected > 100);
    assert_eq!(dropped.off_sensor, expected);
    assert_eq!((dropped.behind, dropped.no_solution), (0, 0));

    let block = injected.block;
    assert_eq!(block.ties.len() + block.marks.len(), truth.ties.len() + truth.marks.len() - dropped.total());
    assert_eq!(injected.report.measurements, block.ties.len() + block.marks.len());
    assert_eq!(block.tie_points.len() + injected.report.dropped_tie_points.len(), truth.tie_points.len());
    let mut rays = vec![0; block.tie_points.len()];
    for tie in &block.ties {
        rays[tie.point.index()] += 1;
        // The renumbered point is still the one that was seen here.
        let name = &block.tie_points[tie.point.index()].name;
        let before = truth
            .ties
            .iter()
            .find(|before| before.image == tie.image && truth.tie_points[before.point.index()].name == *name);
        let before = before.expect("the pair was measured before");
        assert!((tie.x - (before.x + 0.3 * (before.x - 2539.75))).abs() < 1e-9);
    }
    assert!(rays.iter().all(|rays| *rays >= 2) && dropped.left_alone > 0);
}

#[test]
fn earlier_errors_are_replaced_and_the_report_says_so() {
    let truth = truth();
    let noisy = inject(&truth, &["noise:px=0.3"]).block;
    let again = apply(&noisy, &truth, &[], 1).unwrap();
    assert!((again.report.replaced_rms_px - 0.3).abs() < 0.02, "{}", again.report.replaced_rms_px);
    assert_eq!(again.report.change_max_px, 0.0);
    // One tie or another may have left the sensor with the noise; the rest is exact again.
    for tie in &again.block.ties {
        assert!(truth.ties.iter().any(|exact| (exact.x, exact.y) == (tie.x, tie.y)));
    }
}

#[test]
fn registry_is_well_formed() {
    for (index, cause) in registry().iter().enumerate() {
        assert!(registry()[..index].iter().all(|other| other.id() != cause.id()));
        assert!(cause.id().chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{}", cause.id());
        assert_eq!(find(cause.id()).unwrap().id(), cause.id());
        for parameter in cause.parameters() {
            assert!(!parameter.help.is_empty(), "{}:{}", cause.id(), parameter.name);
            let default = parameter.default.to_string();
            assert!(!default.is_empty(), "{}:{}", cause.id(), parameter.name);
        }
    }
    assert_eq!(registry().last().unwrap().id(), "noise");
}

fn message(text: &str) -> String {
    format!("{:#}", parse(text).expect_err(text))
}

#[test]
fn errors_of_the_command_line_are_clear() {
    assert!(message("rolling-shuter").contains("nearest: rolling-shutter"), "{}", message("rolling-shuter"));
    assert!(message("local-flaw:lamda=1").contains("no parameter `lamda`; it has centre_x"));
    assert!(message("local-flaw:lambda=abc").contains("`abc` is not a number"));
    assert!(message("local-flaw:lambda=inf").contains("not a finite number"));
    assert!(message("local-flaw:lambda").contains("key=value"));
    assert!(message("local-flaw:lambda=1,lambda=2").contains("given twice"));
    assert!(message("local-flaw:smooth=yes").contains("neither 0 nor 1"));
    assert!(message("homothety:centre=middle").contains("none of pp, dc, xy"));
    assert_eq!(parse("local-flaw").unwrap().cause.id(), "local-flaw");
    assert!(parse("calibration:f=+25").is_ok());
    assert!(parse("focal-steps:steps=0/1.5/-2").is_ok());
}

#[test]
fn errors_of_the_block_are_clear() {
    let truth = truth();
    let fails = |error: &str| {
        let injected = apply(&truth, &truth, &[parse(error).unwrap()], 0);
        format!("{:#}", injected.map(|_| ()).expect_err(error))
    };
    assert!(fails("forward-motion").contains("no exposure time"));
    assert!(fails("focal-steps:steps=1/2/3").contains("3 values are listed, the block has 2 flights"));
    assert!(fails("gnss-shift:flight=west").contains("no flight `west`"));
    assert!(fails("control-blunder:point=x").contains("no surveyed point `x`"));
    assert!(fails("noise:px=-1").contains("must not be negative"));
    assert!(fails("local-flaw:sigma=0").contains("must be positive"));
    assert!(fails("outliers:fraction=1.5").contains("must be 1 or less"));
    assert!(fails("homothety:cx=1").contains("centre=xy"));
    assert!(fails("temperature-focal:from=1").contains("both of `from` and `to`"));

    let mut without_times = truth.clone();
    for image in &mut without_times.images {
        (image.time_s, image.velocity) = (None, None);
    }
    let rolling = apply(&without_times, &without_times, &[parse("rolling-shutter").unwrap()], 0);
    assert!(format!("{:#}", rolling.unwrap_err()).contains("has no velocity"));
    let mut stranger = truth.clone();
    stranger.images[3].name = "unknown".into();
    let missing = apply(&stranger, &truth, &[], 0).unwrap_err();
    assert!(format!("{missing:#}").contains("no image `unknown`"));
}
