//! The distortion of the cameras beside the one that the network of tie points estimates.

use super::survey::{Network, size_px};
use crate::block::Block;
use crate::camera::undistort::undistort;
use crate::camera::{Camera, K1};
use crate::math::statistics::median;
use crate::mistakes::Mistake;
use crate::mistakes::estimated_distortion::{Estimated, judge};
use crate::mistakes::rays::FEWEST_POINTS;

impl Network<'_> {
    /// Cameras whose measurements have no distortion, or the opposite one.
    pub fn distortions(&self, block: &Block) -> Vec<Mistake> {
        let fit = &self.oriented.fit;
        let interiors = &fit.solution.state.interiors;
        let of_camera = |(number, camera): (usize, &Camera)| {
            // One that is held is as the model has it, and estimates nothing.
            fit.problem.camera_free.get(number).filter(|free| free[K1])?;
            let is_own = |image: usize| block.images[image].camera.index() == number;
            let ties = block.ties.iter().filter(|tie| is_own(tie.image.index()));
            let at: Vec<[f64; 2]> = ties.map(|tie| [tie.x, tie.y]).collect();
            let found = judge(&camera.interior, interiors.get(number)?, &at)?;
            let whole = block.cameras.len() == 1;
            let images = if whole { Vec::new() } else { (0..block.images.len()).filter(|k| is_own(*k)).collect() };
            let names: Vec<String> = images.into_iter().map(|k: usize| block.images[k].name.clone()).collect();
            let both = found.estimated == Estimated::None && self.marks_are_undistorted(block);
            let tables = if both { &["ties.csv", "marks.csv"][..] } else { &["ties.csv"] };
            Some(found.mistake(camera, tables, &names))
        };
        block.cameras.iter().enumerate().filter_map(of_camera).collect()
    }

    /// Do rays of marks meet better as recorded than once the recorded distortion is taken away? Too few points say
    /// nothing: people mark points in the original images.
    fn marks_are_undistorted(&self, block: &Block) -> bool {
        let sizes = |undone: bool| -> Vec<f64> {
            let found = self.intersected(block, |mark| {
                let xy = [mark.x, mark.y];
                let interior = &block.cameras[block.images[mark.image.index()].camera.index()].interior;
                if undone { undistort(interior, xy).unwrap_or(xy) } else { xy }
            });
            found.points.iter().map(size_px).collect()
        };
        let [recorded, undone] = [false, true].map(sizes);
        recorded.len() >= FEWEST_POINTS && median(&recorded) < median(&undone)
    }
}
