//! Error-free twins of blocks.

use crate::beside;
use crate::scenario::exact::assert_exact;
use crate::scenario::simulation;
use misclosure::block::{Block, Measurement};
use misclosure::io::block::read_block;
use misclosure::scenario::{add_noise, twin_of};
use nalgebra::Vector3;
use std::collections::BTreeMap;

#[test]
fn twin_of_an_exact_block_is_the_block() {
    let exact = simulation("dike", 1);
    let twin = twin_of(&exact.block).unwrap();
    assert_eq!(twin.report.dropped.total(), 0);
    for (a, b) in [(&twin.block.ties, &exact.block.ties), (&twin.block.marks, &exact.block.marks)] {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a.x - b.x).hypot(a.y - b.y) < 1e-7));
    }
    for (a, b) in twin.truth.surveyed.iter().zip(&exact.truth.surveyed) {
        assert!((a.position - b.position).norm() < 1e-9 && a.role == b.role);
    }
}

#[test]
fn twin_of_a_noisy_block_is_exact_and_counts_what_it_leaves_out() {
    let mut block = simulation("dike", 1).block;
    add_noise(&mut block, 0.5, 9).unwrap();
    // The first point keeps a single ray; the rays of the second run apart.
    let (lonely, apart) = (block.ties[0].point, block.tie_points[1].name.clone());
    let mut kept = 0;
    block.ties.retain(|tie| {
        kept += usize::from(tie.point == lonely);
        tie.point != lonely || kept == 1
    });
    for (number, tie) in block.ties.iter_mut().filter(|tie| tie.point.index() == 1).enumerate() {
        (tie.x, tie.y) = if number % 2 == 0 { (5.0, 5.0) } else { (5115.0, 3835.0) };
    }
    let twin = twin_of(&block).unwrap();
    println!("{}", twin.report);
    assert_eq!(twin.report.dropped.too_few_rays, 1);
    assert_eq!(twin.block.tie_points.len() + twin.block.surveyed.len() + twin.report.dropped.total(), 14_000 + 5010);
    assert!((2..100).contains(&twin.report.dropped.total()), "{:?}", twin.report.dropped);
    let gone = [&block.tie_points[lonely.index()].name, &apart];
    assert!(twin.block.tie_points.iter().all(|point| !gone.contains(&&point.name)));
    assert_exact(&twin, 0.0);
    // Antenna positions are error-free too.
    assert!(twin.block.images.iter().all(|image| image.gnss.is_some_and(|gnss| gnss.position == image.pose.centre)));
}

#[test]
fn twin_without_orientation_is_refused() {
    let mut block = simulation("closerange", 1).block;
    block.images.iter_mut().for_each(|image| image.pose.centre = Vector3::zeros());
    assert_eq!(
        twin_of(&block).unwrap_err().to_string(),
        "block closerange: no tie point intersects in front of its cameras: is the orientation given?"
    );
}

#[test]
fn twins_of_real_blocks_are_exact_and_complete() {
    let Some(data) = beside::shared("data") else { return };
    for name in ["dbat-camcal", "dbat-camcal-exom", "dbat-prague-cam", "dbat-sxb", "uav-caliterra", "uav-seneca"] {
        let block = read_block(&data.join(name)).unwrap_or_else(|error| panic!("{error}")).block;
        let twin = twin_of(&block).unwrap_or_else(|error| panic!("{error}"));
        println!("{name}\n{}", twin.report);
        assert_exact(&twin, 0.0);
        let points = block.tie_points.len() + block.surveyed.len();
        assert_eq!(twin.block.tie_points.len() + twin.block.surveyed.len() + twin.report.dropped.total(), points);
        // Nearly all of a measured block meets in front of its cameras; what is left out lies at the sensor's edges or
        // is far away.
        assert!(twin.report.dropped.total() * 20 <= points, "{:?} of {points}", twin.report.dropped);
        // The twin is the block without its errors, not another block.
        let mut distances: Vec<f64> = Vec::new();
        let names = |block: &Block, tie: &Measurement| {
            let (image, point) = (&block.images[tie.image.index()].name, &block.tie_points[tie.point.index()].name);
            (image.clone(), point.clone())
        };
        let measured: BTreeMap<_, _> = block.ties.iter().map(|tie| (names(&block, tie), [tie.x, tie.y])).collect();
        for tie in &twin.block.ties {
            let [x, y] = measured[&names(&twin.block, tie)];
            distances.push((tie.x - x).hypot(tie.y - y));
        }
        distances.sort_by(f64::total_cmp);
        let median = distances[distances.len() / 2];
        println!("median {median:.3} px");
        // One block comes with a coarse orientation; the others are within 1 px.
        assert!(median < 0.02 * block.cameras[0].half_diagonal_px(), "{median}");
    }
}
