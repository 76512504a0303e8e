//! Mean residuals over the cells of the sensor.

use super::columns::Entry;
use super::pictures::{Cell, SensorGrid};
use super::{Context, Found, joint_or_worst};
use crate::math::statistics::chi_square_sf;

/// Most cells of a sensor along its long and its short side.
const MOST_CELLS: [usize; 2] = [16, 12];
/// Measurements that a cell should have on average: its mean is normal then, and a coarser grid sees small blocks better.
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

pub(super) fn test(context: &Context<'_>, found: &mut Found) {
    let problem = context.base.problem;
    let cameras = problem.camera_free.len();
    let mut counts = vec![0; cameras];
    let mut sizes = vec![[1.0, 1.0]; cameras];
    for place in context.places {
        counts[place.camera] += 1;
    }
    for image in &problem.image_contexts {
        sizes[image.camera as usize] = [image.width_px, image.height_px];
    }
    let shapes: Vec<[usize; 2]> = (0..cameras).map(|c| shape(sizes[c][0], sizes[c][1], counts[c], cameras)).collect();
    let mut first = vec![0];
    for [nx, ny] in &shapes {
        first.push(first[first.len() - 1] + nx * ny);
    }
    let cell_of = |k: usize| {
        let place = &context.places[k];
        let ([w, h], [nx, ny]) = (sizes[place.camera], shapes[place.camera]);
        let i = ((place.x / w * nx as f64).max(0.0) as usize).min(nx - 1);
        let j = ((place.y / h * ny as f64).max(0.0) as usize).min(ny - 1);
        first[place.camera] + j * nx + i
    };
    let cells = first[cameras];
    let (mut n, mut sum) = (vec![0usize; cells], vec![[0.0; 2]; cells]);
    for (k, residual) in context.base.residual.iter().enumerate() {
        let cell = cell_of(k);
        n[cell] += 1;
        sum[cell][0] += residual[0];
        sum[cell][1] += residual[1];
    }
    let columns = context.columns(2 * cells, |k, entries| {
        let cell = cell_of(k);
        if n[cell] >= LEAST {
            entries.push(Entry { column: 2 * cell as u32, x: 1.0, y: 0.0 });
            entries.push(Entry { column: 2 * cell as u32 + 1, x: 0.0, y: 1.0 });
        }
    });
    let score = context.base.score(&columns);
    let all: Vec<usize> = (0..2 * cells).collect();
    let variance = context.base.variance() * score.design_effect(&all, context.base.variance());
    let mut best: Option<(f64, Cell, usize)> = None;
    let mut tested = 0;
    for c in 0..cameras {
        let [nx, ny] = shapes[c];
        let mut grid = SensorGrid { camera: c, shape: shapes[c], cells: Vec::new() };
        for (place, index) in (first[c]..first[c + 1]).enumerate().filter(|(_, index)| n[*index] > 0) {
            let (i, j) = (place % nx, place / nx);
            let pair = score.pair(2 * index, 2 * index + 1).filter(|_| n[index] >= LEAST);
            let p_value = pair.map_or(f64::NAN, |(_, chi_square)| chi_square_sf(chi_square / variance, 2.0));
            let cell = Cell {
                place: [i, j],
                centre: [(i as f64 + 0.5) * sizes[c][0] / nx as f64, (j as f64 + 0.5) * sizes[c][1] / ny as f64],
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
    let single = best.as_ref().and_then(|(_, _, index)| context.test(&score, &[2 * index, 2 * index + 1]));
    let chosen = joint_or_worst(context.test(&score, &all), single, tested);
    let description = best.map_or(String::new(), |(_, cell, _)| {
        format!(
            "{tested} cells; largest displacement {:.3} px in x and {:.3} px in y about ({:.0}, {:.0}) px",
            cell.displacement[0], cell.displacement[1], cell.centre[0], cell.centre[1]
        )
    });
    found.push("sensor", chosen, description);
}
