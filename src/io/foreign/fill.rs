//! What receivers and cameras recorded, put into the images of a block where these have nothing: what is there stays.

use super::Note;
use super::system::BlockSystem;
use crate::block::{Block, Gnss, ImageId};
use crate::geodesy::geographic::Geographic;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Positions (m) and times (s) that differ by less were written down with fewer digits, no more.
const SAME: f64 = 1e-6;

/// What is known of one image.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Recorded {
    pub time_s: Option<f64>,
    pub place: Option<Geographic>,
    /// Something stands where the position does, and is none: 0, 0, or a receiver without a solution.
    pub nowhere: bool,
    pub sigma_xy: Option<f64>,
    pub sigma_z: Option<f64>,
    /// East, north, up, m/s.
    pub velocity: Option<Vector3<f64>>,
    pub temperature_c: Option<f64>,
    pub exposure_s: Option<f64>,
    pub focus_m: Option<f64>,
    /// For columns that a block keeps and does not use: name and cell.
    pub extra: Vec<(&'static str, String)>,
}

/// Fills the images.
///
/// # Errors
/// Positions that the block's coordinate system has no place for.
pub(super) fn fill(block: &mut Block, recorded: &[(ImageId, Recorded)], notes: &mut Vec<Note>) -> Result<(), String> {
    let nowhere = recorded.iter().filter(|(_, recorded)| recorded.nowhere).count();
    if nowhere > 0 {
        let text = format!("{nowhere} positions are none (0, 0 or no solution of the receiver): left out");
        notes.push(Note::loss(text));
    }
    let places: Vec<Geographic> = recorded.iter().filter_map(|(_, recorded)| recorded.place).collect();
    let system = match places.is_empty() {
        true => None,
        false => Some(BlockSystem::of(block, &places, notes)?),
    };
    // Times have one origin for the whole block: theirs must not be mixed with another.
    let takes_times = block.images.iter().all(|image| image.time_s.is_none());
    let mut kept = Kept::default();
    for (id, recorded) in recorded {
        let image = &mut block.images[id.index()];
        if takes_times {
            image.time_s = recorded.time_s;
        } else {
            kept.times += usize::from(differ(image.time_s, recorded.time_s));
        }
        if let (Some(place), Some(system)) = (&recorded.place, &system) {
            let position = system.position(place)?;
            let given =
                image.gnss.get_or_insert(Gnss { position, sigma_xy: recorded.sigma_xy, sigma_z: recorded.sigma_z });
            kept.positions += usize::from((given.position - position).norm() > SAME);
        }
        image.velocity = image.velocity.or(recorded.velocity);
        for (own, new) in [
            (&mut image.temperature_c, recorded.temperature_c),
            (&mut image.exposure_s, recorded.exposure_s),
            (&mut image.focus_m, recorded.focus_m),
        ] {
            kept.others += usize::from(own.is_some() && differ(*own, new));
            *own = own.or(new);
        }
        for (name, cell) in &recorded.extra {
            kept.others += usize::from(!fill_extra(block, *id, name, cell));
        }
    }
    for (count, what) in [(kept.times, "times"), (kept.positions, "positions"), (kept.others, "other values")] {
        if count > 0 {
            notes.push(Note::loss(format!("{count} images have other {what} already, which stay")));
        }
    }
    Ok(())
}

/// Numbers of values that were there.
#[derive(Default)]
struct Kept {
    times: usize,
    positions: usize,
    others: usize,
}

fn differ(own: Option<f64>, new: Option<f64>) -> bool {
    new.is_some_and(|new| own.is_none_or(|own| (own - new).abs() > SAME))
}

/// Fills a cell of a column that is made where there is none; false where another content stays.
fn fill_extra(block: &mut Block, id: ImageId, name: &str, cell: &str) -> bool {
    let position = block.extra_image_columns.iter().position(|(other, _)| other == name).unwrap_or_else(|| {
        block.extra_image_columns.push((name.to_owned(), vec![String::new(); block.images.len()]));
        block.extra_image_columns.len() - 1
    });
    let own = &mut block.extra_image_columns[position].1[id.index()];
    if own.is_empty() {
        cell.clone_into(own);
    }
    own == cell
}

/// The images of a block by their names.
pub(super) struct ImagesByName {
    whole: HashMap<String, ImageId>,
    /// By the last part of the name; `None` where several images have it.
    last: HashMap<String, Option<ImageId>>,
}

impl ImagesByName {
    pub(super) fn of(block: &Block) -> Self {
        let (mut whole, mut by_last) = (HashMap::new(), HashMap::new());
        for (k, image) in block.images.iter().enumerate() {
            whole.insert(image.name.clone(), k.into());
            let same = by_last.entry(last(&image.name).to_owned());
            same.and_modify(|only| *only = None).or_insert(Some(k.into()));
        }
        Self { whole, last: by_last }
    }

    /// An image by its name, or by the last part of it where only one has that.
    pub(super) fn find(&self, name: &str) -> Option<ImageId> {
        self.whole.get(name).copied().or_else(|| self.last.get(last(name)).copied().flatten())
    }
}

fn last(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or_default()
}
