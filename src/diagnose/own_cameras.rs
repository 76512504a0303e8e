//! Two cameras under one name: the base model predicts a focal length and a principal point for each image. An effect
//! scatters them from image to image; a second camera splits them into two groups.

use super::linearised::Linearised;
use crate::block::Block;
use crate::block::edit::Change;
use crate::mistakes::Mistake;
use crate::mistakes::several_cameras::{Images, Own, judge};
use crate::model::{Model, Prior};
use crate::score::random;
use crate::screening::with_conventions;
use nalgebra::{DMatrix, DVector, Matrix2};

/// Random effects by image, and what each says of a camera.
pub const OF_IMAGES: [(&str, Own); 2] = [("focal-image", Own::FocalLength), ("pp-image", Own::PrincipalPoint)];

/// Two cameras under one name, at a level `alpha`. `base`: the block linearised without what may be found in it.
pub fn several_cameras(block: &Block, base: &Linearised, alpha: f64) -> Vec<Mistake> {
    let of_effect = |(effect, own): &(&str, Own)| {
        let values = values(base, effect, block.images.len());
        let of_camera = |camera: usize| judge(&images(block, camera, values.as_ref()?), *own, alpha);
        (0..block.cameras.len()).filter_map(of_camera).collect::<Vec<_>>()
    };
    // Two cameras may differ in both; either names the same images.
    OF_IMAGES.iter().map(of_effect).find(|found| !found.is_empty()).unwrap_or_default()
}

/// Best linear predictions of random values by image: `(M + phi / t^2)^-1 s`. `None` where the block does not tell
/// them.
fn values(base: &Linearised, effect: &str, images: usize) -> Option<Vec<[f64; 2]>> {
    let set = &base.sets.iter().find(|set| set.id == effect)?.columns;
    // The first coordinate of all images, then the second one.
    let of_second = (set.len() == 2 * images).then_some(images);
    if of_second.is_none() && set.len() != images {
        return None;
    }
    let component = random::test(&base.system, set, 1.0).filter(|component| component.deviation > 0.0)?;
    let system = base.system.excerpt(set);
    let ridge = component.variance / component.deviation.powi(2);
    let normal = DMatrix::clone(&system.information) + DMatrix::identity(set.len(), set.len()) * ridge;
    let values: DVector<f64> = normal.cholesky()?.solve(&system.score);
    Some((0..images).map(|image| [values[image], of_second.map_or(0.0, |second| values[second + image])]).collect())
}

fn images<'a>(block: &'a Block, camera: usize, values: &[[f64; 2]]) -> Images<'a> {
    let own: Vec<usize> = (0..block.images.len()).filter(|k| block.images[*k].camera.index() == camera).collect();
    Images {
        camera: &block.cameras[camera].id,
        cameras: block.cameras.iter().map(|camera| camera.id.as_str()).collect(),
        names: own.iter().map(|k| block.images[*k].name.as_str()).collect(),
        values: own.iter().map(|k| values[*k]).collect(),
        // One for all: their part of the scatter is the same for each.
        covariances: vec![Matrix2::identity(); own.len()],
        are_all: true,
        flights: own.iter().map(|k| block.images[*k].flight.index()).collect(),
    }
}

/// Block and model with the cameras that the images have: what the model says of the one holds for its copy.
pub fn with_own_cameras(block: &Block, model: &Model, mistakes: &[Mistake]) -> (Block, Model) {
    let mut model = model.clone();
    for edit in mistakes.iter().flat_map(|mistake| &mistake.mend) {
        let (Change::Copy { id }, [rows]) = (&edit.change, &edit.rows[..]) else { continue };
        for before in &rows.values {
            if let Some(values) = model.camera_values.get(before).cloned() {
                model.camera_values.insert(id.clone(), values);
            }
            let priors: Vec<_> = model.priors.iter().filter(|prior| prior.camera == *before).cloned().collect();
            model.priors.extend(priors.into_iter().map(|prior| Prior { camera: id.clone(), ..prior }));
        }
    }
    (with_conventions(block, mistakes).into_owned(), model)
}
