//! Which measurements lie near each other in an image.

use rayon::prelude::*;

/// Measurements per cell of the search grid, on average: a neighbourhood of three by three cells then has about
/// eighteen.
const PER_CELL: f64 = 2.0;

/// Grid of one image.
#[derive(Clone, Default)]
struct Grid {
    low: [f64; 2],
    cell: f64,
    shape: [usize; 2],
    starts: Vec<usize>,
    members: Vec<u32>,
}

/// Image points of a block, sorted for search.
pub struct Neighbours {
    places: Vec<(usize, [f64; 2])>,
    grids: Vec<Grid>,
}

impl Neighbours {
    /// Of image points (image, px) of a number of images. Runs in the pool of its caller.
    pub fn new(places: impl Iterator<Item = (usize, [f64; 2])>, images: usize) -> Self {
        let places: Vec<_> = places.collect();
        let mut members = vec![Vec::new(); images];
        for (k, (image, _)) in places.iter().enumerate() {
            members[*image].push(k as u32);
        }
        let grids = members.into_par_iter().map(|members| Grid::new(members, &places)).collect();
        Self { places, grids }
    }

    /// Up to `count` nearest to measurement `k` in its image, nearest first, out of the grid cells around it.
    pub fn nearest(&self, k: usize, count: usize) -> impl Iterator<Item = usize> + use<> {
        let (image, place) = self.places[k];
        let grid = &self.grids[image];
        let [i, j] = grid.cell_of(place);
        let mut near: Vec<(f64, u32)> = Vec::new();
        for row in j.saturating_sub(1)..(j + 2).min(grid.shape[1]) {
            for column in i.saturating_sub(1)..(i + 2).min(grid.shape[0]) {
                let cell = row * grid.shape[0] + column;
                for member in &grid.members[grid.starts[cell]..grid.starts[cell + 1]] {
                    if *member as usize != k {
                        let other = self.places[*member as usize].1;
                        near.push(((other[0] - place[0]).powi(2) + (other[1] - place[1]).powi(2), *member));
                    }
                }
            }
        }
        let nearer = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if count < near.len() {
            near.select_nth_unstable_by(count, nearer);
            near.truncate(count);
        }
        near.sort_unstable_by(nearer);
        near.into_iter().map(|(_, member)| member as usize)
    }
}

impl Grid {
    fn new(members: Vec<u32>, places: &[(usize, [f64; 2])]) -> Self {
        let points = || members.iter().map(|k| places[*k as usize].1);
        let low = points().fold([f64::INFINITY; 2], |low, p| [low[0].min(p[0]), low[1].min(p[1])]);
        let high = points().fold([f64::NEG_INFINITY; 2], |high, p| [high[0].max(p[0]), high[1].max(p[1])]);
        if members.is_empty() {
            return Self { low: [0.0; 2], cell: 1.0, shape: [1, 1], starts: vec![0, 0], members };
        }
        let area = ((high[0] - low[0]) * (high[1] - low[1])).max(1.0);
        let cell = (area * PER_CELL / members.len() as f64).sqrt();
        // No more cells along a side than points, however thin the image's coverage is.
        let side = |k: usize| (((high[k] - low[k]) / cell) as usize + 1).min(members.len());
        let cell = cell.max((high[0] - low[0]) / members.len() as f64).max((high[1] - low[1]) / members.len() as f64);
        let mut grid = Self { low, cell, shape: [side(0), side(1)], starts: Vec::new(), members: Vec::new() };
        let mut cells = vec![Vec::new(); grid.shape[0] * grid.shape[1]];
        for k in &members {
            let [i, j] = grid.cell_of(places[*k as usize].1);
            cells[j * grid.shape[0] + i].push(*k);
        }
        grid.starts.push(0);
        for cell in cells {
            grid.members.extend(cell);
            grid.starts.push(grid.members.len());
        }
        grid
    }

    fn cell_of(&self, place: [f64; 2]) -> [usize; 2] {
        let index = |k: usize| (((place[k] - self.low[k]) / self.cell).max(0.0) as usize).min(self.shape[k] - 1);
        [index(0), index(1)]
    }
}
