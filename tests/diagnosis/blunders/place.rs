//! Where blunders lie.

use misclosure::block::Block;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

#[derive(Debug, Clone, Copy)]
pub enum Place {
    Random,
    /// Points at the corners of the block: few others hold their images.
    Corners,
    /// Points of two and three rays: nothing, or little, says which one is wrong.
    FewRays,
}

impl Place {
    /// Positions in [`Block::ties`] of as many measurements, at most one of a point where there are enough points.
    pub fn choose(self, block: &Block, count: usize, random: &mut ChaCha8Rng) -> Vec<usize> {
        let mut order: Vec<(f64, usize)> = (0..block.ties.len()).map(|k| (self.rank(block, k, random), k)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut taken = vec![false; block.tie_points.len()];
        let first_of_point = |k: &usize| !std::mem::replace(&mut taken[block.ties[*k].point.index()], true);
        order.into_iter().map(|(_, k)| k).filter(first_of_point).take(count).collect()
    }

    /// The worst first, chance among equals.
    fn rank(self, block: &Block, measurement: usize, random: &mut ChaCha8Rng) -> f64 {
        let chance: f64 = random.random();
        let point = block.ties[measurement].point;
        match self {
            Place::Random => chance,
            Place::Corners => {
                let centres = block.images.iter().map(|image| image.pose.centre);
                let mean = centres.sum::<nalgebra::Vector3<f64>>() / block.images.len() as f64;
                let image = &block.images[block.ties[measurement].image.index()];
                // Images far out, in each of them the point as it comes.
                -(image.pose.centre - mean).norm() + 1e-3 * chance
            }
            Place::FewRays => block.ties.iter().filter(|row| row.point == point).count() as f64 + chance,
        }
    }
}
