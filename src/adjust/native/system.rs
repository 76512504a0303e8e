//! The reduced normal equations while they are summed: image blocks, border strip, border, right-hand sides.

use super::aligned::Aligned;
use super::structure::Structure;
use std::ops::Range;

/// Part of the reduced system that the images of ranks `rows` and the border touch. Symmetric blocks are kept once
/// (row rank <= column rank; upper triangle of the border). Everything in scaled unknowns.
// Threads have one each, side by side: no two of them in a pair of cache lines.
#[derive(Debug, Clone)]
#[repr(align(128))]
pub struct System {
    /// Ranks.
    pub rows: Range<usize>,
    /// First slot of `rows`.
    pub first_slot: usize,
    /// Numbers from row to row of a block, and of strip and border; see [`Structure::stride`] and [`Structure::width`].
    pub stride: usize,
    /// See `stride`.
    pub width: usize,
    /// Slots, `dim` rows of `stride` each; of the diagonal ones, the upper triangle counts.
    pub blocks: Aligned,
    /// Image-border blocks, `dim` rows of `width` each.
    pub strip: Aligned,
    /// Border, upper triangle, a row of `width` per column.
    pub border: Aligned,
    /// Right-hand side (`J'v` reduced) of the image blocks.
    pub rhs_images: Vec<f64>,
    /// Right-hand side of the border.
    pub rhs_border: Vec<f64>,
    /// Diagonal before elimination of the points, images.
    pub diagonal_images: Vec<f64>,
    /// Diagonal before elimination, border.
    pub diagonal_border: Vec<f64>,
    /// Gradient before elimination, images.
    pub gradient_images: Vec<f64>,
    /// Gradient before elimination, border.
    pub gradient_border: Vec<f64>,
    /// Largest gradient entry of a point.
    pub gradient_points_max: f64,
    /// What the points alone would gain, the images and the border held: `sum g' V^-1 g`.
    pub decrement_points: f64,
    /// `sum rho`.
    pub chi_square: f64,
}

impl System {
    /// Zeros over the given ranks.
    pub fn zeros(structure: &Structure, rows: Range<usize>) -> Self {
        let nothing = || Aligned::zeros(0);
        let mut system = Self {
            rows: 0..0,
            first_slot: 0,
            stride: structure.stride,
            width: structure.width,
            blocks: nothing(),
            strip: nothing(),
            border: nothing(),
            rhs_images: Vec::new(),
            rhs_border: Vec::new(),
            diagonal_images: Vec::new(),
            diagonal_border: Vec::new(),
            gradient_images: Vec::new(),
            gradient_border: Vec::new(),
            gradient_points_max: 0.0,
            decrement_points: 0.0,
            chi_square: 0.0,
        };
        system.restart(structure, rows);
        system
    }

    /// Becomes zeros over other ranks: memory that was asked for once need not be asked for again.
    pub fn restart(&mut self, structure: &Structure, rows: Range<usize>) {
        let Structure { dim, stride, width, ref row_start, ref border, .. } = *structure;
        let (images, border) = (rows.len(), border.len());
        self.first_slot = row_start[rows.start];
        self.blocks.restart((row_start[rows.end] - self.first_slot) * dim * stride);
        self.strip.restart(images * dim * width);
        self.border.restart(border * width);
        for values in [&mut self.rhs_images, &mut self.diagonal_images, &mut self.gradient_images] {
            values.clear();
            values.resize(images * dim, 0.0);
        }
        for values in [&mut self.rhs_border, &mut self.diagonal_border, &mut self.gradient_border] {
            values.clear();
            values.resize(border, 0.0);
        }
        (self.gradient_points_max, self.decrement_points, self.chi_square) = (0.0, 0.0, 0.0);
        self.rows = rows;
    }

    /// Adds a part. `self` covers at least the part's ranks.
    pub fn add(&mut self, structure: &Structure, part: &System) {
        let (dim, width) = (structure.dim, self.width);
        let image_offset = part.rows.start - self.rows.start;
        let add = |to: &mut [f64], from: &[f64]| {
            for (a, b) in to.iter_mut().zip(from) {
                *a += b;
            }
        };
        add(&mut self.blocks[(part.first_slot - self.first_slot) * dim * self.stride..], &part.blocks);
        add(&mut self.strip[image_offset * dim * width..], &part.strip);
        add(&mut self.border, &part.border);
        add(&mut self.rhs_images[image_offset * dim..], &part.rhs_images);
        add(&mut self.rhs_border, &part.rhs_border);
        add(&mut self.diagonal_images[image_offset * dim..], &part.diagonal_images);
        add(&mut self.diagonal_border, &part.diagonal_border);
        add(&mut self.gradient_images[image_offset * dim..], &part.gradient_images);
        add(&mut self.gradient_border, &part.gradient_border);
        self.gradient_points_max = self.gradient_points_max.max(part.gradient_points_max);
        self.decrement_points += part.decrement_points;
        self.chi_square += part.chi_square;
    }

    /// The Newton decrement `g' N^-1 g`: by what chi-square would fall along the solution (`images`, `border`) of this
    /// system, were the problem linear. With damping in system and solution it is the smaller value under that damping.
    pub fn decrement(&self, (images, border): &(Vec<f64>, Vec<f64>)) -> f64 {
        let product = |x: &[f64], rhs: &[f64]| x.iter().zip(rhs).map(|(x, r)| x * r).sum::<f64>();
        self.decrement_points + product(images, &self.rhs_images) + product(border, &self.rhs_border)
    }

    /// Holds columns of the border: in every solution they stay where they are.
    pub fn hold(&mut self, columns: &[usize]) {
        let (width, count) = (self.width, self.rhs_border.len());
        for column in columns {
            for row in self.strip.chunks_exact_mut(width) {
                row[*column] = 0.0;
            }
            for other in (0..count).filter(|other| other != column) {
                self.border[other.min(*column) * width + other.max(*column)] = 0.0;
            }
            self.rhs_border[*column] = 0.0;
            self.gradient_border[*column] = 0.0;
        }
    }

    /// Entry of a block: row `k`, column `l`.
    #[inline]
    pub fn block(&self, slot: usize, dim: usize, k: usize, l: usize) -> f64 {
        self.blocks[((slot - self.first_slot) * dim + k) * self.stride + l]
    }

    /// Entry of an image unknown (counted from the first of `rows`) and a column of the border.
    #[inline]
    pub fn strip(&self, unknown: usize, column: usize) -> f64 {
        self.strip[unknown * self.width + column]
    }

    /// Entry of two columns of the border, the first no larger than the second.
    #[inline]
    pub fn border(&self, a: usize, b: usize) -> f64 {
        self.border[a * self.width + b]
    }

    /// Adds one row `a` of the weighted design matrix with misclosure `v` that touches no point: `image` is the rank
    /// and its `dim` derivatives, `shared` border columns and derivatives (ascending columns).
    pub fn add_row(&mut self, structure: &Structure, image: Option<(usize, &[f64])>, shared: &[(u32, f64)], v: f64) {
        let (dim, width, stride) = (structure.dim, self.width, self.stride);
        if let Some((rank, row)) = image {
            let i = rank - self.rows.start;
            let slot = structure.row_start[rank] - self.first_slot;
            let block = &mut self.blocks[slot * dim * stride..][..dim * stride];
            for (p, a) in row.iter().enumerate() {
                for (q, b) in row.iter().enumerate() {
                    block[p * stride + q] += a * b;
                }
                for (column, b) in shared {
                    self.strip[(i * dim + p) * width + *column as usize] += a * b;
                }
                self.rhs_images[i * dim + p] += a * v;
                self.gradient_images[i * dim + p] += a * v;
                self.diagonal_images[i * dim + p] += a * a;
            }
        }
        for (i, (column, a)) in shared.iter().enumerate() {
            let column = *column as usize;
            for (other, b) in &shared[i..] {
                self.border[column * width + *other as usize] += a * b;
            }
            self.rhs_border[column] += a * v;
            self.gradient_border[column] += a * v;
            self.diagonal_border[column] += a * a;
        }
        self.chi_square += v * v;
    }
}
