//! Images most of whose measurements are wrong. Robust estimation breaks down where more than half is: such an image
//! has no orientation, or several in which other measurements agree by chance, and a search at one of them takes back
//! what a search at the next rejects. It is set aside whole.

use super::{Kept, Rejected, Snooping};
use crate::block::{Block, ImageId};
use crate::problem::MeasurementKind;

/// Share of an image's tie measurements, which orient it, beyond which no estimate tells the wrong ones from the
/// others: the breakdown point.
const BREAKDOWN: f64 = 0.5;

impl Snooping {
    /// Leaves out every measurement of images of whose tie measurements more than half are out. Was any in? They do not
    /// come back: by an image that has no orientation nothing can be judged. To be asked after a judgement at a robust
    /// fit, which takes back what agrees there.
    pub fn set_aside_images(&mut self, block: &Block) -> bool {
        let (mut had, mut out) = (vec![0.0; block.images.len()], vec![0.0; block.images.len()]);
        for (row, left) in block.ties.iter().zip(&self.left.ties) {
            had[row.image.index()] += 1.0;
            out[row.image.index()] += if *left { 0.0 } else { 1.0 };
        }
        let is_wrong = |image: ImageId| out[image.index()] > BREAKDOWN * had[image.index()];
        let Self { left: Kept { ties, marks }, outliers, .. } = self;
        let before = outliers.rejected.len();
        let kinds = [(MeasurementKind::Tie, &block.ties, ties), (MeasurementKind::Mark, &block.marks, marks)];
        for (kind, rows, left) in kinds {
            for (measurement, row) in rows.iter().enumerate().filter(|(_, row)| is_wrong(row.image)) {
                if std::mem::replace(&mut left[measurement], false) {
                    let (image, point, round) = (row.image, row.point, outliers.rounds.len());
                    outliers.rejected.push(Rejected { kind, measurement, image, point, normalised: f64::NAN, round });
                }
            }
        }
        outliers.rejected.len() > before
    }
}
