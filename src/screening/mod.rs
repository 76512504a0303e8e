//! The screening for mistakes that people made, before an adjustment or a diagnosis judges anything: the values of the
//! tables, then the block oriented by its tie points alone and its surveyed groups beside that.

mod aside;
mod focal;
mod heights;
mod lens;
mod lost;
mod marks;
mod meeting;
mod network;
mod places;
mod rays;
mod surroundings;
mod survey;
mod undone;
mod values;

pub use aside::{of_outliers, without};
pub use focal::of_focal_lengths;
pub use rays::of_own_points;
pub use undone::with_conventions;
pub use values::{of_datum, of_values};

use crate::adjust::Options;
use crate::block::Block;
use crate::mistakes::{self, Mistake};
use crate::model::Model;
use network::{Oriented, free_network};
use std::borrow::Cow;
use survey::Network;

/// Mistakes in a block: in the values of its tables, and in its surveyed groups where the images can be oriented
/// without them. Each kind of a subject once, the first that found it.
pub fn mistakes(block: &Block, model: &Model, significance: f64, options: &Options) -> Vec<Mistake> {
    let mut found = values::of_values(block);
    found.extend(values::of_datum(block, model));
    let of_rays = rays::of_rays(&with_conventions(block, &found));
    add(&mut found, of_rays);
    // What is surveyed is held against images as they should be.
    let block = with_conventions(block, &found);
    let of_survey = of_survey(&block, model, significance, options);
    add(&mut found, places::with_network(values::of_places(&block), of_survey));
    found
}

/// What the survey of a diagnosed block may be wrong in where the diagnosis contradicts it: see
/// [`mistakes::doubtful`].
pub fn doubtful(block: &Block, model: &Model, significance: f64, options: &Options) -> Vec<Mistake> {
    let Some(oriented) = free_network(block, model, options) else { return Vec::new() };
    let Some(network) = Network::new(&oriented) else { return Vec::new() };
    mistakes::doubtful(&network.screened(block, significance).0, significance)
}

/// Adds mistakes of a kind and subject that nothing found before.
fn add(found: &mut Vec<Mistake>, mut others: Vec<Mistake>) {
    others.retain(|other| !found.iter().any(|own| (&own.kind, &own.subject) == (&other.kind, &other.subject)));
    found.append(&mut others);
}

fn of_survey(block: &Block, model: &Model, significance: f64, options: &Options) -> Vec<Mistake> {
    let has_gnss = block.images.iter().any(|image| image.gnss.is_some());
    if !has_gnss && block.surveyed.is_empty() {
        return Vec::new();
    }
    let network_of = |block: &Block| free_network(block, model, options);
    let Some(oriented) = network_of(block) else { return Vec::new() };
    let mut found = Network::new(&oriented).map_or_else(Vec::new, |network| network.distortions(block));
    match with_conventions(block, &found) {
        Cow::Borrowed(block) => found.extend(of_groups(block, &oriented, model, significance, options)),
        // Everything else is held against a network of right measurements.
        Cow::Owned(undone) => {
            let oriented = network_of(&undone);
            found.extend(oriented.iter().flat_map(|own| of_groups(&undone, own, model, significance, options)));
        }
    }
    found
}

/// Marks, single images and surveyed groups against a network.
fn of_groups(block: &Block, oriented: &Oriented, model: &Model, significance: f64, options: &Options) -> Vec<Mistake> {
    let Some(network) = Network::new(oriented) else { return Vec::new() };
    let of_images = rays::of_images(block, &oriented.fit, model, significance, options);
    let (mut block, mut found) = network.marks(block, significance);
    found.extend(of_images);
    // An image that was measured wrongly stands elsewhere in the network than its antenna says.
    let wrong = |name: &String| found.iter().any(|own| own.subject == "images" && own.names.contains(name));
    if block.images.iter().any(|image| wrong(&image.name)) {
        let images = block.to_mut().images.iter_mut();
        images.filter(|image| wrong(&image.name)).for_each(|image| image.gnss = None);
    }
    let (survey, wrong) = network.screened(&block, significance);
    found.extend(wrong);
    heights::refined(found, &block, model, &survey, options)
}
