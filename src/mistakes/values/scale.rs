//! Measurements in a reduced image.

use super::extent::{self, Extent};
use super::tables::{Camera, Measured, Table, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// Sizes of reduced images, as shares of the original: powers of two, and what programs offer beside these.
const SHARES: [f64; 6] = [0.125, 0.25, 1.0 / 3.0, 0.5, 2.0 / 3.0, 0.75];
/// Measurements must reach so far into the reduced image, as a share of it, that no smaller one is meant.
const REACHED: f64 = 0.9;
/// From here on the share is certain: two of [`SHARES`] differ by more than a tenth.
const EXACT: f64 = 0.97;
/// Blunders may exceed the reduced image by this share of it, also where few images leave none out.
const EXCESS: f64 = 0.01;
/// Probability that chance leaves right and bottom of all images empty. Small: measurements are no uniform sample.
const LEVEL: f64 = 1e-6;
/// How far the principal point may be from the centre, as a share of the sides: else the sensor's size is in doubt.
const CENTRED: f64 = 0.1;

/// Size of a reduced image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Of the original size.
    pub of: f64,
    /// Is it certain which one?
    pub exact: bool,
}

/// Size of the image that was measured in; `None` where the measurements may be of the whole sensor.
pub fn share(camera: &Camera, extent: &Extent) -> Option<Share> {
    if extent.count == 0 {
        return None;
    }
    let reach = [0, 1].map(|axis| extent.filled[axis] / camera.sides[axis]);
    let farthest = reach[0].max(reach[1]);
    let of = SHARES.into_iter().find(|share| farthest <= share * (1.0 + EXCESS))?;
    let reached = reach.iter().all(|reach| *reach >= REACHED * of);
    (reached && ln_chance(camera, extent) < (LEVEL / SHARES.len() as f64).ln())
        .then_some(Share { of, exact: reach.iter().all(|reach| *reach >= EXACT * of) })
}

/// Logarithm of the probability that so many measurements leave right and bottom empty by chance. Where they keep away
/// from the edges, they do so by the same margin on both sides of the sensor.
fn ln_chance(camera: &Camera, extent: &Extent) -> f64 {
    let one = |axis: usize| {
        let [low, high] = [extent.low[axis], extent.filled[axis]].map(|value| value / camera.sides[axis]);
        let margin = low.max(0.0);
        let share = (high - margin) / (1.0 - 2.0 * margin);
        // Beyond half a side there is no such margin.
        if share > 0.0 && margin < 0.5 { share.min(1.0).ln() } else { 0.0 }
    };
    extent.independent as f64 * (one(0) + one(1))
}

fn is_centred(camera: &Camera) -> bool {
    (0..2).all(|axis| (camera.principal[axis] - camera.centre()[axis]).abs() < CENTRED * camera.sides[axis])
}

/// Measurements of a table that were made in reduced images.
pub fn judge(table: &Table, tables: &Tables, extents: &[Extent]) -> Vec<Mistake> {
    let check = |camera: &Camera, extent: &Extent| share(camera, extent).filter(|_| is_centred(camera));
    let found = extent::by_finding(tables, extents, check);
    let name =
        |(share, cameras): &(Share, Vec<usize>)| mistake(table.of, *share, extent::images(tables, extents, cameras));
    found.iter().map(name).collect()
}

fn mistake(of: Measured, share: Share, images: Vec<String>) -> Mistake {
    let sentence = format!(
        "{}: they fill {:.3} of the width and of the height of the images{}, from the upper left corner. They were \
         measured in images of that size.",
        of.words(),
        share.of,
        if images.is_empty() { String::new() } else { format!(" ({} images)", images.len()) },
    );
    let remedy = format!(
        "Multiply x and y of {} by {:.4}, if the camera in block.toml is that of the original images.",
        of.file(),
        1.0 / share.of
    );
    let edit = |column: &str| {
        let edit = Edit::all(of.file(), Change::times(column, 1.0 / share.of));
        if images.is_empty() { edit } else { edit.of("image", &images) }
    };
    let mend = if share.exact { ["x", "y"].map(edit).into() } else { Vec::new() };
    Mistake::new("image-scale", of.key(), sentence, remedy).of(images).sized(share.of, None, "1").undone_by(mend)
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Row, made};
    use super::*;

    fn judged(rows: Vec<Row>) -> Vec<Mistake> {
        let tables = made::with_rows(rows);
        judge(&tables.ties, &tables, &extent::of(&tables.ties, &tables))
    }

    fn moved(images: usize, change: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Row> {
        made::rows(images).into_iter().map(|row| Row { xy: change(row.xy), ..row }).collect()
    }

    #[test]
    fn reduced_images_are_known_by_their_size() {
        for of in SHARES {
            let found = judged(moved(10, |xy| xy.map(|value| of * value)));
            assert_eq!((found.len(), found[0].value), (1, Some(of)), "{found:?}");
            assert_eq!(found[0].mend[1].change, Change::times("y", 1.0 / of));
        }
    }

    #[test]
    fn a_few_marks_in_the_middle_are_no_reduced_image() {
        // Between 30 and 70 % of each side.
        assert!(judged(moved(10, |[x, y]| [1200.0 + 0.4 * x, 900.0 + 0.4 * y])).is_empty());
        // In the upper left, but in two images alone.
        assert!(judged(moved(2, |xy| xy.map(|value| 0.75 * value))).is_empty());
    }

    #[test]
    fn one_direction_alone_is_no_scale() {
        assert!(judged(moved(10, |[x, y]| [x, 0.5 * y])).is_empty());
        assert!(judged(moved(10, |xy| xy)).is_empty());
        assert!(judged(Vec::new()).is_empty());
    }

    #[test]
    fn a_camera_of_the_reduced_image_is_left_to_the_sensor() {
        let mut tables = made::with_rows(moved(10, |xy| xy.map(|value| 0.5 * value)));
        tables.cameras[0].principal = [1005.0, 747.0];
        assert!(judge(&tables.ties, &tables, &extent::of(&tables.ties, &tables)).is_empty());
    }
}
