//! Mean residuals over the cells of the sensor.

use super::asked::{Asked, joint_or_worst};
use super::columns::Family;
use super::context::Context;
use super::found::Found;
use super::pictures::{Cell, SensorGrid};
use crate::math::statistics::chi_square_sf;

/// Most cells of a sensor along its long and its short side.
const MOST_CELLS: [usize; 2] = [16, 12];
/// Measurements that a cell should have on average: its mean is normal then, and a coarser grid sees small blocks
/// better.
const PER_CELL: f64 = 30.0;
/// Cells with fewer measurements are not tested.
const LEAST: usize = 8;
/// Most cells over all cameras: the test costs their third power.
const MOST: usize = 800;

/// Columns and rows of cells for a camera.
fn shape(width: f64, height: f64, measurements: usize, cameras: usize) -> [usize; 2] {
    let most = (MOST / cameras).min(MOST_CELLS[0] * MOST_CELLS[1]) as f64;
    let share = ((measurements as f64 / PER_CELL).min(most) / (MOST_CELLS[0] * MOST_CELLS[1]) as f64).sqrt();
    let side = |n: usize| ((n as f64 * share).round() as usize).max(2);
    let [long, short] = MOST_CELLS.map(side);
    if width >= height { [long, short] } else { [short, long] }
}

/// Cells of every camera's sensor.
pub(super) struct Cells {
    sizes: Vec<[f64; 2]>,
    shapes: Vec<[usize; 2]>,
    first: Vec<usize>,
    n: Vec<usize>,
    sum: Vec<[f64; 2]>,
}

impl Cells {
    pub fn new(context: &Context<'_>) -> Self {
        let problem = context.problem;
        let cameras = problem.camera_free.len();
        let camera = |k: usize| problem.image_contexts[problem.observations[k].image as usize].camera as usize;
        let mut counts = vec![0; cameras];
        let mut sizes = vec![[1.0, 1.0]; cameras];
        (0..problem.observations.len()).for_each(|k| counts[camera(k)] += 1);
        for image in &problem.image_contexts {
            sizes[image.camera as usize] = [image.width_px, image.height_px];
        }
        let shapes: Vec<[usize; 2]> =
            (0..cameras).map(|c| shape(sizes[c][0], sizes[c][1], counts[c], cameras)).collect();
        let mut first = vec![0];
        for [nx, ny] in &shapes {
            first.push(first[first.len() - 1] + nx * ny);
        }
        let count = first[cameras];
        let mut cells = Self { sizes, shapes, first, n: vec![0; count], sum: vec![[0.0; 2]; count] };
        for (k, local) in context.measurements.iter().enumerate() {
            let cell = cells.of(camera(k), local.predicted);
            cells.n[cell] += 1;
            cells.sum[cell][0] += local.residual[0];
            cells.sum[cell][1] += local.residual[1];
        }
        cells
    }

    fn of(&self, camera: usize, [x, y]: [f64; 2]) -> usize {
        let ([w, h], [nx, ny]) = (self.sizes[camera], self.shapes[camera]);
        let i = ((x / w * nx as f64).max(0.0) as usize).min(nx - 1);
        let j = ((y / h * ny as f64).max(0.0) as usize).min(ny - 1);
        self.first[camera] + j * nx + i
    }

    /// A displacement of each cell.
    pub fn family(&self) -> Family<'_> {
        let fill = |place: &super::place::Place, to: &mut super::columns::Writer<'_>| {
            let cell = self.of(place.camera, [place.x, place.y]);
            if self.n[cell] >= LEAST {
                to.entry(2 * cell, [1.0, 0.0]);
                to.entry(2 * cell + 1, [0.0, 1.0]);
            }
        };
        Family { against: "sensor", count: 2 * self.n.len(), local: true, fill: Box::new(fill), coordinates: None }
    }

    pub fn judge(&self, asked: &Asked<'_>, found: &mut Found) {
        let Self { sizes, shapes, first, n, sum } = self;
        let all: Vec<usize> = (0..2 * n.len()).collect();
        let variance = asked.variance() * asked.design_effect(&all);
        let mut best: Option<(f64, Cell, usize)> = None;
        let mut tested = 0;
        for c in 0..shapes.len() {
            let [nx, ny] = shapes[c];
            let mut grid = SensorGrid { camera: c, shape: shapes[c], cells: Vec::new() };
            for (place, index) in (first[c]..first[c + 1]).enumerate().filter(|(_, index)| n[*index] > 0) {
                let (i, j) = (place % nx, place / nx);
                let pair = asked.pair(2 * index, 2 * index + 1).filter(|_| n[index] >= LEAST);
                let p_value = pair.map_or(f64::NAN, |(_, chi_square)| chi_square_sf(chi_square / variance, 2.0));
                let middle = [(i, 0, nx), (j, 1, ny)].map(|(at, k, of)| (at as f64 + 0.5) * sizes[c][k] / of as f64);
                let cell = Cell {
                    place: [i, j],
                    centre: middle,
                    n: n[index],
                    mean: sum[index].map(|sum| sum / n[index] as f64),
                    displacement: pair.map_or([f64::NAN; 2], |(displacement, _)| displacement),
                    p_value,
                };
                if let Some((_, chi_square)) = pair {
                    tested += 1;
                    if best.as_ref().is_none_or(|(largest, ..)| chi_square > *largest) {
                        best = Some((chi_square, cell, index));
                    }
                }
                grid.cells.push(cell);
            }
            found.pictures.sensor.push(grid);
        }
        let single = best.as_ref().and_then(|(_, _, index)| asked.test(&[2 * index, 2 * index + 1]));
        let chosen = joint_or_worst(asked.test(&all), single, tested);
        let description = best.map_or(String::new(), |(_, cell, _)| {
            format!(
                "{tested} cells; largest displacement {:.3} px in x and {:.3} px in y about ({:.0}, {:.0}) px",
                cell.displacement[0], cell.displacement[1], cell.centre[0], cell.centre[1]
            )
        });
        found.push("sensor", chosen, description);
    }
}
