//! Cells of the sensor: what measurements err alike by that were made at the same place, in the same rows or in the
//! same columns of it.

use crate::effects::ImageContext;
use crate::problem::Problem;

/// Cells along the long and the short side of a sensor: bands that are narrow beside the waves of a sensor's pattern,
/// and enough of them to know a variance by.
const CELLS: [usize; 2] = [64, 48];
/// Cells along each side of a place: of a pattern of the sensor that nobody models, each place has a part of its own.
const PLACE: usize = 4;

/// Ways to put cells together that may err alike: to places, to bands of rows, and to bands of columns. A sensor is
/// made of parts and read out by rows: its patterns may be the same along a whole row or column, and add up there.
pub(super) const GROUPINGS: usize = 3;

/// Cells of the sensors of all cameras.
pub(super) struct SensorCells {
    /// Of each image: the first cell of its camera, the number of cells along x and y, and their sizes in px.
    of_images: Vec<(u32, [usize; 2], [f64; 2])>,
    /// Number of cells.
    pub count: usize,
    /// Number of groups of each grouping.
    pub group_counts: [usize; GROUPINGS],
    /// Groups of each cell.
    groups: Vec<[usize; GROUPINGS]>,
}

impl SensorCells {
    pub fn new(problem: &Problem) -> Self {
        let [long, short] = CELLS;
        let each = long * short;
        let groups_each = [each / (PLACE * PLACE), long, long];
        let cameras = problem.camera_free.len();
        let mut groups = vec![[0; GROUPINGS]; cameras * each];
        let mut of_image = |image: &ImageContext| {
            let (width, height) = (image.width_px, image.height_px);
            let [nx, ny] = if width >= height { [long, short] } else { [short, long] };
            let camera = image.camera as usize;
            for (cell, to) in groups[camera * each..][..each].iter_mut().enumerate() {
                let (x, y) = (cell % nx, cell / nx);
                let own = [y / PLACE * (nx / PLACE) + x / PLACE, y, x];
                *to = std::array::from_fn(|grouping| camera * groups_each[grouping] + own[grouping]);
            }
            ((camera * each) as u32, [nx, ny], [width / nx as f64, height / ny as f64])
        };
        let of_images = problem.image_contexts.iter().map(&mut of_image).collect();
        Self { of_images, count: cameras * each, group_counts: groups_each.map(|count| cameras * count), groups }
    }

    /// Groups of a cell; what is in no cell is in none.
    pub fn groups_of(&self, cell: usize) -> [usize; GROUPINGS] {
        self.groups.get(cell).copied().unwrap_or(self.group_counts)
    }

    /// Cell of a place in an image; beyond the sensor the nearest one.
    pub fn of(&self, image: usize, [x, y]: [f64; 2]) -> u32 {
        let (first, [nx, ny], [width, height]) = self.of_images[image];
        let along = |at: f64, size: f64, n: usize| ((at / size).max(0.0) as usize).min(n - 1);
        first + (along(y, height, ny) * nx + along(x, width, nx)) as u32
    }
}
