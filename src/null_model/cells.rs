//! Cells of the sensor: measurements at the same place, in the same rows or in the same columns of it may err alike.

use crate::effects::ImageContext;
use crate::problem::Problem;

/// Cells along the long and the short side of a sensor: bands that are narrow beside the waves of a sensor's pattern,
/// and enough of them to know a variance by.
const CELLS: [usize; 2] = [64, 48];
/// Cells along each side of a place, in which an unmodelled pattern of the sensor is nearly constant.
const PLACE: usize = 4;

/// Ways to put cells together that may err alike: to places, to bands of rows, and to bands of columns. A sensor is
/// made of parts and read out by rows: its patterns may be the same along a whole row or column, and add up there.
pub(super) const GROUPINGS: usize = 3;
/// Cells of a camera.
const EACH: usize = CELLS[0] * CELLS[1];
/// Groups of a camera; the sensor may lie or stand.
const GROUPS_EACH: [usize; GROUPINGS] = [EACH / (PLACE * PLACE), CELLS[0], CELLS[0]];

/// Cells of the sensors of all cameras.
pub(super) struct SensorCells {
    /// Of each image: the first cell of its camera, the number of cells along x and y, and their sizes in px.
    of_images: Vec<(u32, [usize; 2], [f64; 2])>,
    /// Number of cells.
    pub count: usize,
    /// Number of groups of each grouping, all cameras together.
    pub group_counts: [usize; GROUPINGS],
    /// Of each camera: the number of cells along x.
    across: Vec<usize>,
}

impl SensorCells {
    pub fn new(problem: &Problem) -> Self {
        let cameras = problem.camera_free.len();
        let mut across = vec![CELLS[0]; cameras];
        let of_image = |image: &ImageContext| {
            let (width, height) = (image.width_px, image.height_px);
            let [long, short] = CELLS;
            let [nx, ny] = if width >= height { [long, short] } else { [short, long] };
            across[image.camera as usize] = nx;
            ((image.camera as usize * EACH) as u32, [nx, ny], [width / nx as f64, height / ny as f64])
        };
        let of_images = problem.image_contexts.iter().map(of_image).collect();
        Self { of_images, count: cameras * EACH, group_counts: GROUPS_EACH.map(|groups| cameras * groups), across }
    }

    /// Groups of a cell. The number behind the last group stands for rows that belong to no cell.
    pub fn groups_of(&self, cell: usize) -> [usize; GROUPINGS] {
        let camera = cell / EACH;
        let Some(nx) = self.across.get(camera) else { return self.group_counts };
        let (x, y) = (cell % EACH % nx, cell % EACH / nx);
        let own = [y / PLACE * (nx / PLACE) + x / PLACE, y, x];
        std::array::from_fn(|grouping| camera * GROUPS_EACH[grouping] + own[grouping])
    }

    /// Cell of a place in an image; beyond the sensor the nearest one.
    pub fn of(&self, image: usize, [x, y]: [f64; 2]) -> u32 {
        let (first, [nx, ny], [width, height]) = self.of_images[image];
        let along = |at: f64, size: f64, n: usize| ((at / size).max(0.0) as usize).min(n - 1);
        first + (along(y, height, ny) * nx + along(x, width, nx)) as u32
    }
}
