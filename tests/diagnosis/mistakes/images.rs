//! Mistakes of single images.

use super::made::{assert_value, block, named};
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

/// Crops one image.
fn crop(block: &mut Block, image: usize, [dx, dy]: [f64; 2]) {
    let all = block.ties.iter_mut().chain(&mut block.marks).filter(|row| row.image.index() == image);
    all.for_each(|row| (row.x, row.y) = (row.x - dx, row.y - dy));
}

/// A pose absorbs most of a crop: where it hides the rest, too, nothing is named; else this image, by how much.
#[test]
fn a_cropped_image_is_named_with_its_shift_or_nothing_is() {
    let mut count = 0;
    for (preset, seed) in [("dike", 1), ("mapping", 3)] {
        let sound = block(preset, seed);
        for image in [10, 20, 30, 40] {
            let mut cropped = sound.clone();
            crop(&mut cropped, image, [60.0, 80.0]);
            let found = named(&cropped);
            let name = &cropped.images[image].name;
            let brief: Vec<_> = found.iter().map(|own| (&own.kind, &own.names, own.value, own.sigma)).collect();
            println!("{preset} {image}: {brief:?}");
            for own in &found {
                assert_eq!((&*own.kind, &own.names[..]), ("offset", std::slice::from_ref(name)), "{preset}: {brief:?}");
                assert_value(own, 100.0, name);
            }
            count += found.len();
        }
    }
    assert!(count >= 4, "{count} of 8 named");
}
