//! Cells of the sensor: what measurements err alike by that were made at the same place of it.

use crate::effects::ImageContext;
use crate::problem::Problem;

/// Cells along the long and the short side of a sensor: of a pattern of the sensor that nobody models, each has a
/// part of its own.
const CELLS: [usize; 2] = [16, 12];

/// Cells of the sensors of all cameras.
pub(super) struct SensorCells {
    /// Of each image: the first cell of its camera, the number of cells along x and y, and their sizes in px.
    of_images: Vec<(u32, [usize; 2], [f64; 2])>,
    /// Number of cells.
    pub count: usize,
}

impl SensorCells {
    pub fn new(problem: &Problem) -> Self {
        let each = CELLS[0] * CELLS[1];
        let of_image = |image: &ImageContext| {
            let (width, height) = (image.width_px, image.height_px);
            let [long, short] = CELLS;
            let [nx, ny] = if width >= height { [long, short] } else { [short, long] };
            ((image.camera as usize * each) as u32, [nx, ny], [width / nx as f64, height / ny as f64])
        };
        let of_images = problem.image_contexts.iter().map(of_image).collect();
        Self { of_images, count: problem.camera_free.len() * each }
    }

    /// Cell of a place in an image; beyond the sensor the nearest one.
    pub fn of(&self, image: usize, [x, y]: [f64; 2]) -> u32 {
        let (first, [nx, ny], [width, height]) = self.of_images[image];
        let along = |at: f64, size: f64, n: usize| ((at / size).max(0.0) as usize).min(n - 1);
        first + (along(y, height, ny) * nx + along(x, width, nx)) as u32
    }
}
