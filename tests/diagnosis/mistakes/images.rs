//! Mistakes of single images.

use super::made::{block, named};
use misclosure::block::Block;

/// Mirrors what was measured in one image.
fn mirror(block: &mut Block, image: usize) {
    let camera = &block.cameras[block.images[image].camera.index()];
    let width = f64::from(camera.width_px);
    let all = block.ties.iter_mut().chain(&mut block.marks).filter(|row| row.image.index() == image);
    all.for_each(|row| row.x = width - row.x);
}

/// A mirrored image can spoil the network that would show it: not each one is named, but no other image, and nothing
/// else, ever is.
#[test]
fn a_mirrored_image_is_named_or_nothing_is() {
    let mut count = 0;
    for (preset, seed) in [("dike", 1), ("mapping", 3)] {
        let sound = block(preset, seed);
        for image in [10, 20, 30, 40] {
            let mut mirrored = sound.clone();
            mirror(&mut mirrored, image);
            let found = named(&mirrored);
            let name = &mirrored.images[image].name;
            let is_it = |kind: &str, names: &[String]| kind == "mirrored" && names == std::slice::from_ref(name);
            let brief: Vec<_> = found.iter().map(|own| (&own.kind, &own.names)).collect();
            println!("{preset} {image}: {brief:?}");
            assert!(found.iter().all(|own| is_it(&own.kind, &own.names)), "{preset} {image}: {brief:?}");
            count += found.len();
        }
    }
    assert!(count >= 4, "{count} of 8 named");
}
