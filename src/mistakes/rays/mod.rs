//! Rays know the conventions of the images: where rays of tie points do not meet as recorded, and meet once a habit of
//! another program is undone, this habit is the mistake.
//!
//! ```text
//! scene (plain values) ──► alternatives, the most common first ──► misfit of each ──► the best, if it is alone and far better
//! network of good images ──► images that do not fit ──► each resected alone under its own alternatives
//! ```
//!
//! **A block of which nothing is wrong names nothing.** Poses that are off by degrees and metres let rays miss each
//! other under every alternative. On forty simulated and seven real blocks the best wrong alternative is 1.1 times
//! better than the recorded values, while the right one of blocks with a mistake is 14 to 100 000 times better:
//! [`BEYOND`](super::BEYOND) stands between the two.

mod alternatives;
mod cause;
mod compete;
mod coordinates;
mod focal;
mod lens;
#[cfg(test)]
mod made;
mod meet;
mod orientation;
mod own;
mod same;
mod scene;
mod sensor;
pub mod single;
#[cfg(test)]
mod tests;
mod words;

pub use meet::FEWEST_POINTS;
pub use scene::{Scene, Sight, View};

use super::Mistake;
use cause::{Cause, Table};
use compete::{Found, judge};
use coordinates::Coordinates;
use nalgebra::Vector3;
use scene::Scope;

/// Conventions that are wrong of all images, or of all images of one camera. `ties`: some tie points of a block, of
/// many rays each; `marks`: its surveyed points.
pub fn conventions(ties: &Scene, marks: &Scene) -> Vec<Mistake> {
    let found = of_table(ties, marks, Table::Ties);
    if !found.is_empty() {
        return found;
    }
    let mut found = of_table(marks, ties, Table::Marks);
    if found.is_empty() {
        found.extend(sensor::sides_exchanged(ties));
    }
    found
}

/// What is wrong where tie points are missed at the orientation that a file of another program gives them. `places`:
/// their coordinates, in the order of the scene; `marks`: the surveyed points; `reported_px`: what that program says
/// that tie points are missed by.
pub fn own_points(scene: &Scene, places: &[Vector3<f64>], marks: &Scene, reported_px: Option<f64>) -> Vec<Mistake> {
    match own::judge(scene, places, reported_px) {
        None => Vec::new(),
        Some(own::Verdict::Told(mistake)) => vec![mistake],
        Some(own::Verdict::Convention(found)) => {
            let tables = tables(&found, marks, Table::Ties);
            words::mistakes(&found, &Scope { scene, camera: None }, Table::Ties, &tables)
        }
    }
}

/// Mistakes of one table of measurements; `other`: the other table, which may share them.
fn of_table(scene: &Scene, other: &Scene, table: Table) -> Vec<Mistake> {
    let all = Scope { scene, camera: None };
    if let Some(found) = judge(scene, table) {
        return words::mistakes(&found, &all, table, &tables(&found, other, table));
    }
    let cameras = all.cameras();
    if cameras.len() < 2 {
        return Vec::new();
    }
    let of = |camera: usize| {
        let found = judge(&scene.of_camera(camera), table)?;
        let scope = Scope { scene, camera: Some(camera) };
        Some(words::mistakes(&found, &scope, table, &tables(&found, &other.of_camera(camera), table)))
    };
    cameras.into_iter().filter_map(of).flatten().collect()
}

/// Tables of measurements that share a convention. Marks that were measured in another program may be right; too few
/// of them follow the tie points, but not into undistorted images: those are made for matching, and people mark points
/// in the original ones.
fn tables(found: &Found, other: &Scene, table: Table) -> Vec<&'static str> {
    if table == Table::Marks {
        return vec![Table::Marks.file()];
    }
    let is_shared = || {
        if other.sights().next().is_none()
            || found.alternative.causes.iter().any(|c| !matches!(c, Cause::Coordinates(_)))
        {
            return false;
        }
        let undone = found.alternative.undone(other).and_then(|scene| meet::misfit(&scene));
        match (meet::misfit(other), undone) {
            (Some(own), Some(undone)) => own.times_by_share(&undone) > 1.0,
            _ => found.alternative.causes != [Cause::Coordinates(Coordinates::Undistorted)],
        }
    };
    let mut tables = vec![Table::Ties.file()];
    if is_shared() {
        tables.push(Table::Marks.file());
    }
    tables
}
