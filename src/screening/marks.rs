//! Marks of surveyed points beside the network of tie points.

use super::survey::{Network, size_px};
use crate::block::edit::Edit;
use crate::block::{Block, Measurement};
use crate::evaluate::intersection::{Failure, Intersection};
use crate::math::statistics::median;
use crate::mistakes::marks::{self, Meeting, Moved, Recorded};
use crate::mistakes::{BEYOND, Mistake};
use std::borrow::Cow;

impl Network<'_> {
    /// The block with marks as they should have been recorded, and what is wrong with all of them.
    pub fn marks<'a>(&self, block: &'a Block, significance: f64) -> (Cow<'a, Block>, Vec<Mistake>) {
        let size = |mark: &Measurement| {
            let camera = &block.cameras[block.images[mark.image.index()].camera.index()];
            [f64::from(camera.width_px), f64::from(camera.height_px)]
        };
        let usual = self.usual_px(block);
        let meeting = |recorded: Recorded| {
            let found = self.intersected(block, |mark| recorded.undone([mark.x, mark.y], size(mark)));
            let missed = found.failed.iter().filter(|point| !matches!(point.reason, Failure::TooFewMarks(_)));
            let sizes = found.points.iter().map(size_px).chain(missed.map(|_| f64::INFINITY)).collect();
            Meeting { recorded, sizes }
        };
        let own = meeting(Recorded::Rightly);
        let meets = own.sizes.iter().filter(|size| **size < BEYOND * usual).count();
        let mut typical = usual;
        // Alternatives are asked for where the rays of most points do not meet.
        if 2 * meets < own.sizes.len() {
            typical = median(&own.sizes);
            let others = Recorded::all().into_iter().skip(1).map(meeting);
            let trials: Vec<Meeting> = std::iter::once(own).chain(others).collect();
            if let Some((recorded, mistake)) = marks::convention(&trials, usual) {
                let rightly = block.marks.iter().map(|mark| {
                    let [x, y] = recorded.undone([mark.x, mark.y], size(mark));
                    Measurement { x, y, ..*mark }
                });
                let rightly = block.with_measurements(block.ties.clone(), rightly.collect());
                let mend = of_each_size(block, recorded);
                return (Cow::Owned(rightly), vec![mistake.undone_by(mend)]);
            }
        }
        // A large offset keeps the rays of all points apart alike.
        let mistake = marks::offset(&self.moved(block, typical), BEYOND * usual, significance);
        (Cow::Borrowed(block), mistake.into_iter().collect())
    }

    /// Residuals of points whose rays meet about as those of most do (`usual`, px), and how they change where all marks
    /// move.
    fn moved(&self, block: &Block, usual: f64) -> Moved {
        let by = |offset: [f64; 2]| self.intersected(block, |mark| [mark.x + offset[0], mark.y + offset[1]]).points;
        let [own, x, y] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(by);
        let mut all = Moved::default();
        for point in own.iter().filter(|point| size_px(point) < BEYOND * usual) {
            let same = |list: &[Intersection]| list.iter().find(|other| other.point == point.point).cloned();
            let (Some(x), Some(y)) = (same(&x), same(&y)) else { continue };
            if [&x, &y].iter().any(|other| other.residuals.len() != point.residuals.len()) {
                continue;
            }
            all.residuals.extend(&point.residuals);
            all.by_x.extend(x.residuals.iter().zip(&point.residuals).map(|(moved, own)| moved - own));
            all.by_y.extend(y.residuals.iter().zip(&point.residuals).map(|(moved, own)| moved - own));
            all.points += 1;
        }
        all
    }
}

/// Edits of the marks of images of each size.
fn of_each_size(block: &Block, recorded: Recorded) -> Vec<Edit> {
    let sizes: Vec<[f64; 2]> =
        block.cameras.iter().map(|camera| [f64::from(camera.width_px), f64::from(camera.height_px)]).collect();
    if sizes.iter().all(|size| *size == sizes[0]) {
        return sizes.first().map_or_else(Vec::new, |size| recorded.edits(*size, &[]));
    }
    let of = |(camera, size): (usize, &[f64; 2])| {
        let images = block.images.iter().filter(|image| image.camera.index() == camera);
        recorded.edits(*size, &images.map(|image| image.name.clone()).collect::<Vec<_>>())
    };
    sizes.iter().enumerate().flat_map(of).collect()
}
