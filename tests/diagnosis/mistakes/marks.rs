//! Mistakes of the marks of surveyed points.

use super::made::{BLOCKS, assert_value, block, expect, named, only};
use misclosure::block::Block;

/// Rewrites every mark; the size of its image stands with it.
fn marks(block: &mut Block, rewrite: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) {
    for mark in &mut block.marks {
        let camera = &block.cameras[block.images[mark.image.index()].camera.index()];
        let size = [f64::from(camera.width_px), f64::from(camera.height_px)];
        [mark.x, mark.y] = rewrite([mark.x, mark.y], size);
    }
}

#[test]
fn conventions() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut up = block(preset, seed);
        marks(&mut up, |[x, y], [_, height]| [x, height - y]);
        only(&named(&up), "y-up", "marks", &what);
        let mut half = block(preset, seed);
        marks(&mut half, |[x, y], _| [x / 2.0, y / 2.0]);
        assert_value(only(&named(&half), "image-scale", "marks", &what), 0.5, &what);
    }
}

#[test]
fn offsets() {
    for (preset, seed) in BLOCKS {
        for (offset, known) in [([0.5, 0.5], true), ([1.5, -0.2], false), ([0.0, 4.0], false)] {
            let what = format!("{preset} {seed}, {offset:?} px");
            let mut moved = block(preset, seed);
            marks(&mut moved, |[x, y], _| [x + offset[0], y + offset[1]]);
            let found = named(&moved);
            let mistake = only(&found, "offset", "marks", &what);
            assert_value(mistake, offset[0].hypot(offset[1]), &what);
            assert_eq!(mistake.sentence.contains("half a pixel"), known, "{what}: {}", mistake.sentence);
        }
    }
}

#[test]
fn marks_of_two_points_exchanged() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut swapped = block(preset, seed);
        for mark in &mut swapped.marks {
            let other = [(1, 3), (3, 1)].into_iter().find(|(own, _)| mark.point.index() == *own);
            if let Some((_, other)) = other {
                mark.point = other.into();
            }
        }
        let names = [1, 3].map(|k: usize| swapped.surveyed[k].name.clone());
        assert_eq!(expect(&named(&swapped), "exchanged", "control", &what).names, names, "{what}");
    }
}
