//! Receiver, survey, noise and outliers.

use crate::inject::fixture::{distance, inject, pairs, truth};
use misclosure::block::{Block, Role};
use nalgebra::Vector3;

fn antenna_changes(before: &Block, after: &Block) -> Vec<Vector3<f64>> {
    assert_eq!(before.ties, after.ties, "images are not touched");
    let position = |block: &Block, index: usize| block.images[index].gnss.unwrap().position;
    (0..before.images.len()).map(|index| position(after, index) - position(before, index)).collect()
}

#[test]
fn gnss_shift_of_all_and_of_one_flight() {
    let truth = truth();
    let shift = Vector3::new(0.04, -0.02, 0.06);
    for change in antenna_changes(&truth, &inject(&truth, &["gnss-shift:x=0.04,y=-0.02,z=0.06"]).block) {
        assert!((change - shift).norm() < 1e-13);
    }
    let east = inject(&truth, &["gnss-shift:x=0.04,y=-0.02,z=0.06,flight=east"]).block;
    for (image, change) in antenna_changes(&truth, &east).into_iter().enumerate() {
        assert!((change - if image < 12 { Vector3::zeros() } else { shift }).norm() < 1e-13);
    }
}

#[test]
fn gnss_delay_runs_along_the_flight() {
    let truth = truth();
    let block = inject(&truth, &["gnss-delay:dt=0.02"]).block;
    for (change, image) in antenna_changes(&truth, &block).into_iter().zip(&truth.images) {
        assert!((change - image.velocity.unwrap() * 0.02).norm() < 1e-12);
    }
}

#[test]
fn lever_arm_turns_with_the_camera() {
    let truth = truth();
    let block = inject(&truth, &["gnss-lever-arm:x=0.05,y=-0.03,z=0.1"]).block;
    for (change, image) in antenna_changes(&truth, &block).into_iter().zip(&truth.images) {
        // Seen from the camera the antenna is always in the same place.
        assert!((image.pose.rotation * change - Vector3::new(0.05, -0.03, 0.1)).norm() < 1e-13);
    }
    // Together with a delay both are there.
    let both = inject(&truth, &["gnss-lever-arm:x=0.05,y=-0.03,z=0.1", "gnss-delay:dt=0.02"]).block;
    for (change, image) in antenna_changes(&block, &both).into_iter().zip(&truth.images) {
        assert!((change - image.velocity.unwrap() * 0.02).norm() < 1e-12);
    }
}

#[test]
fn gnss_drift_is_a_line_in_each_flight() {
    let truth = truth();
    let changes = antenna_changes(&truth, &inject(&truth, &["gnss-drift:offset_m=0.2,rate=0.01"]).block);
    let time = |image: usize| truth.images[image].time_s.unwrap();
    let mut rates = Vec::new();
    for flight in [0..12_usize, 12..20] {
        let (first, last) = (flight.start, flight.end - 1);
        let rate = (changes[last] - changes[first]) / (time(last) - time(first));
        for image in flight {
            let line = changes[first] + rate * (time(image) - time(first));
            assert!((changes[image] - line).norm() < 1e-12);
        }
        rates.push(rate);
    }
    assert!((rates[0] - rates[1]).norm() > 1e-3, "each flight has its own");
    assert!(changes[0].norm() > 1e-3);
}

#[test]
fn map_scale_about_the_centre_of_the_survey() {
    let truth = truth();
    let block = inject(&truth, &["map-scale:m=4e-4"]).block;
    let length =
        |block: &Block, i: usize, j: usize| (block.surveyed[i].position - block.surveyed[j].position).xy().norm();
    for i in 0..12 {
        assert_eq!(block.surveyed[i].position.z, truth.surveyed[i].position.z);
        for j in 0..i {
            assert!((length(&block, i, j) / length(&truth, i, j) - 1.0004).abs() < 1e-12);
        }
    }
    let mean = |block: &Block| block.surveyed.iter().map(|point| point.position).sum::<Vector3<f64>>() / 12.0;
    assert!((mean(&block) - mean(&truth)).norm() < 1e-12);
    assert_eq!(block.marks, truth.marks);
    let antennas = |block: &Block| block.images.iter().map(|image| image.gnss.unwrap().position).collect::<Vec<_>>();
    let (drawn, placed) = (antennas(&block), antennas(&truth));
    for (i, j) in [(0, 5), (3, 17)] {
        let ratio = (drawn[i] - drawn[j]).xy().norm() / (placed[i] - placed[j]).xy().norm();
        assert!((ratio - 1.0004).abs() < 1e-12 && drawn[i].z == placed[i].z, "{ratio}");
    }
    let survey = inject(&truth, &["map-scale:m=4e-4,in=control"]).block;
    assert!(survey.surveyed == block.surveyed && antennas(&survey) == placed);
    let receiver = inject(&truth, &["map-scale:m=4e-4,in=gnss"]).block;
    assert!(receiver.surveyed == truth.surveyed && antennas(&receiver) == drawn);
}

/// The map the other way round: on a sphere of the radius `RADIUS` about a point below the survey, the drawn arc and
/// height lead back to the place.
#[test]
fn a_map_of_a_sphere_leads_back_to_the_world() {
    // A small Earth, so that it is seen.
    const RADIUS: f64 = 20_000.0;
    let truth = truth();
    let block = inject(&truth, &["earth-curvature:radius=20000,height=2"]).block;
    let same = inject(&truth, &["earth-curvature:radius=10000,q=0.5,height=2"]).block;
    assert_eq!(block.surveyed, same.surveyed);
    let mut foot = truth.surveyed.iter().map(|point| point.position).sum::<Vector3<f64>>() / 12.0;
    foot.z = 2.0;
    let world = |drawn: Vector3<f64>| {
        let on_map = (drawn - foot).xy();
        let (angle, height) = (on_map.norm() / RADIUS, drawn.z - foot.z);
        let out = on_map.normalize() * ((RADIUS + height) * angle.sin());
        foot + Vector3::new(out.x, out.y, (RADIUS + height) * angle.cos() - RADIUS)
    };
    let mut largest = 0.0_f64;
    for (drawn, placed) in block.surveyed.iter().zip(&truth.surveyed) {
        largest = largest.max(drawn.position.z - placed.position.z);
        assert!((world(drawn.position) - placed.position).norm() < 1e-10, "{}", placed.name);
    }
    assert!(largest > 0.03, "the ground falls away from the plane: {largest}");
    for (drawn, placed) in block.images.iter().zip(&truth.images) {
        let (drawn, placed) = (drawn.gnss.unwrap().position, placed.gnss.unwrap().position);
        assert!((world(drawn) - placed).norm() < 1e-10);
        // What stands 60 m high is drawn at its foot.
        let shrunk = (drawn - foot).xy().norm() / (placed - foot).xy().norm();
        assert!((shrunk - 1.0 / (1.0 + (placed.z - 2.0) / RADIUS)).abs() < 1e-4, "{shrunk}");
    }
    assert_eq!((block.ties.clone(), block.marks.clone()), (truth.ties.clone(), truth.marks.clone()));
    let survey = inject(&truth, &["earth-curvature:radius=20000,height=2,in=control"]).block;
    assert!(survey.surveyed == block.surveyed && survey.images == truth.images);
    let receiver = inject(&truth, &["earth-curvature:radius=20000,height=2,in=gnss"]).block;
    assert!(receiver.surveyed == truth.surveyed && receiver.images == block.images);
}

#[test]
fn blunders_hit_the_points_named() {
    let truth = truth();
    let moved = inject(&truth, &["control-blunder:size=0.7,axis=z,point=s03"]).block;
    let swapped = inject(&truth, &["control-blunder:swap=1,point=s01,with=s04"]).block;
    for (index, point) in truth.surveyed.iter().enumerate() {
        let lift = if point.name == "s03" { Vector3::z() * 0.7 } else { Vector3::zeros() };
        assert!((moved.surveyed[index].position - point.position - lift).norm() < 1e-14);
        let other = match index {
            1 => 4,
            4 => 1,
            same => same,
        };
        assert_eq!(swapped.surveyed[index].position, truth.surveyed[other].position);
        assert_eq!(swapped.surveyed[index].name, point.name);
    }
    let drawn = inject(&truth, &["control-blunder:size=0.7"]).block;
    let hit: Vec<_> = (0..12).filter(|i| drawn.surveyed[*i].position != truth.surveyed[*i].position).collect();
    assert_eq!(hit.len(), 1);
    assert_eq!(truth.surveyed[hit[0]].role, Role::Control);
    assert!(((drawn.surveyed[hit[0]].position - truth.surveyed[hit[0]].position).norm() - 0.7).abs() < 1e-12);
}

#[test]
fn exact_marks_are_those_of_the_undisturbed_images() {
    let truth = truth();
    let block = inject(&truth, &["local-flaw:sigma=2000", "exact-marks:role=check"]).block;
    let control = |point: usize| truth.surveyed[point].role == Role::Control;
    let mut disturbed = 0;
    for mark in &block.marks {
        let exact = truth.marks.iter().find(|exact| (exact.image, exact.point) == (mark.image, mark.point)).unwrap();
        let moved = distance([mark.x, mark.y], [exact.x, exact.y]);
        if control(mark.point.index()) {
            disturbed += usize::from(moved > 0.1);
        } else {
            assert_eq!(moved, 0.0);
        }
    }
    assert!(disturbed > 10, "{disturbed}");
}

#[test]
fn noise_has_the_size_asked_for() {
    let truth = truth();
    let injected = inject(&truth, &["noise:px=0.3,marks_px=0,gnss=1,control=1"]);
    let changes: Vec<f64> = pairs(&truth, &injected.block)
        .iter()
        .flat_map(|(_, _, before, after)| [after[0] - before[0], after[1] - before[1]])
        .collect();
    let n = changes.len() as f64;
    let mean = changes.iter().sum::<f64>() / n;
    let rms = (changes.iter().map(|change| change * change).sum::<f64>() / n).sqrt();
    assert!(mean.abs() < 4.0 * 0.3 / n.sqrt(), "{mean}");
    assert!((rms / 0.3 - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "{rms}");
    assert_eq!(injected.block.marks, truth.marks);

    let gnss: Vec<Vector3<f64>> = truth
        .images
        .iter()
        .zip(&injected.block.images)
        .map(|(a, b)| b.gnss.unwrap().position - a.gnss.unwrap().position)
        .collect();
    let rms = |values: Vec<f64>| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    // 40 and 20 numbers: four standard deviations of their RMS.
    assert!((rms(gnss.iter().flat_map(|v| [v.x, v.y]).collect()) / 0.03 - 1.0).abs() < 0.45);
    assert!((rms(gnss.iter().map(|v| v.z).collect()) / 0.05 - 1.0).abs() < 0.63);
    assert!(truth.surveyed.iter().zip(&injected.block.surveyed).all(|(a, b)| a.position != b.position));
    // Without a size it is each measurement's own sigma.
    let own = inject(&truth, &["noise"]);
    assert!((own.report.change_rms_px / 0.3 - 1.0).abs() < 0.05, "{}", own.report.change_rms_px);
}

#[test]
fn outliers_are_as_many_and_as_far_as_asked() {
    let truth = truth();
    let injected = inject(&truth, &["outliers:fraction=0.05,min=8,max=20"]);
    let far: Vec<_> =
        pairs(&truth, &injected.block).into_iter().filter(|(_, _, before, after)| before != after).collect();
    let wanted = (0.05 * truth.ties.len() as f64).round() as usize;
    let lost = injected.report.dropped.total();
    assert!(far.len() <= wanted && far.len() + lost >= wanted, "{} of {wanted}, {lost} lost", far.len());
    for (_, _, before, after) in &far {
        assert!((8.0..20.0).contains(&distance(*before, *after)));
    }
    let sum = far.iter().fold([0.0; 2], |sum, (_, _, a, b)| [sum[0] + b[0] - a[0], sum[1] + b[1] - a[1]]);
    // Directions all round: each coordinate of the mean within four of its standard deviations, some 10 px / sqrt(n).
    assert!(sum[0].hypot(sum[1]) < 6.0 * 10.5 * (far.len() as f64).sqrt());

    let one = inject(&truth, &["outliers:fraction=0.01,spread=image,image=i05"]);
    assert_eq!(one.report.outliers.len(), (0.01 * truth.ties.len() as f64).round() as usize);
    assert!(one.report.outliers.iter().all(|(image, _)| image == "i05"));
    for (image, _, before, after) in pairs(&truth, &one.block) {
        assert!(image == 5 || before == after);
    }
}
