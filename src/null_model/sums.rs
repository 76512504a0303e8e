//! Sums over the rows of all points: normal matrices of columns among each other and with the base, in an order that
//! depends neither on the number of threads nor on how the columns are split.
//!
//! Each part of the sums is added up by one thread at a time, over the batches in their order (`waves`): that thread
//! has a batch in its own cache for all the parts of a bundle.

use super::ColumnPlace;
use super::batch::Batch;
use super::dense_columns::Multiply;
use super::families::Families;
use super::products::{ImageLines, ImagesDense, ImagesLocal, LocalLines, add};
use super::source::Source;
use super::waves::{Task, waves};
use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::{MAX_DIM, zeros};
use crate::math::vectors::dispatch;

/// Columns of a product that one task sums.
const TASK_COLUMNS: usize = 48;
/// Bundles of tasks per thread: what one is late with the others make up for. Each has its share of the images, and of
/// the local columns.
const BUNDLES: usize = 2;

/// Sums over all rows. `d` dense columns (the base's border first), `l` local ones.
pub(super) struct Sums {
    pub dense: usize,
    pub local: usize,
    /// `D'D`, d x d, column by column; the lower triangle counts.
    pub dense_dense: Vec<f64>,
    /// `L'D`, l x d, row by row.
    pub local_dense: Vec<f64>,
    /// `L'L`, l x l, row by row; the upper triangle counts. Of the diagonal alone, one number per column, where asked
    /// for.
    pub local_local: Vec<f64>,
    /// Image unknowns with dense columns, row by row.
    pub image_dense: Vec<f64>,
    /// Image unknowns with local columns: by image, then column, then unknown of the image, which are summed side by
    /// side.
    image_local: Vec<f64>,
    /// `D'v`.
    pub score_dense: Vec<f64>,
    /// `L'v`.
    pub score_local: Vec<f64>,
    /// Sum of squares of dense columns before anything is taken out.
    pub length_dense: Vec<f64>,
    /// The same of local columns.
    pub length_local: Vec<f64>,
    /// Sum over the points of the squared part that each has of a dense column's score.
    pub squares_dense: Vec<f64>,
    /// The same of local columns.
    pub squares_local: Vec<f64>,
    diagonal_alone: bool,
}

impl Sums {
    /// Image unknown `row` (by rank, then unknown) with a local column.
    pub fn image_local(&self, row: usize, dim: usize, column: usize) -> f64 {
        self.image_local[(row / dim * self.local + column) * dim + row % dim]
    }

    /// Product of two columns.
    pub fn product(&self, a: ColumnPlace, b: ColumnPlace) -> f64 {
        use ColumnPlace::{Dense, Local};
        match (a, b) {
            (Dense(a), Dense(b)) => self.dense_dense[a.min(b) * self.dense + a.max(b)],
            (Dense(dense), Local(local)) | (Local(local), Dense(dense)) => self.local_dense[local * self.dense + dense],
            (Local(a), Local(b)) if self.diagonal_alone => {
                if a == b {
                    self.local_local[a]
                } else {
                    0.0
                }
            }
            (Local(a), Local(b)) => self.local_local[a.min(b) * self.local + a.max(b)],
        }
    }

    /// Gives the sums with image unknowns back.
    pub fn forget_images(&mut self) {
        (self.image_dense, self.image_local) = (Vec::new(), Vec::new());
    }

    /// Sums over everything; products of columns of two `families` may be missing. `diagonal_alone`: of `L'L` its
    /// diagonal.
    pub fn of(source: &Source<'_>, families: &Families, diagonal_alone: bool) -> Result<Self, AdjustError> {
        let (d, l) = (source.dense(), source.local());
        let unknowns = source.structure.images * source.structure.dim;
        let mut sums = Self {
            dense: d,
            local: l,
            dense_dense: zeros(d * d),
            local_dense: zeros(l * d),
            local_local: zeros(if diagonal_alone { l } else { l * l }),
            image_dense: zeros(unknowns * d),
            image_local: zeros(unknowns * l),
            score_dense: vec![0.0; d],
            score_local: vec![0.0; l],
            length_dense: vec![0.0; d],
            length_local: vec![0.0; l],
            squares_dense: vec![0.0; d],
            squares_local: vec![0.0; l],
            diagonal_alone,
        };
        let bundles = BUNDLES * rayon::current_num_threads();
        let mut dealt: Vec<Vec<Part<'_>>> = (0..bundles).map(|_| Vec::new()).collect();
        for (number, part) in sums.parts(source, families, bundles).into_iter().enumerate() {
            dealt[number % bundles].push(part);
        }
        let tasks = dealt.into_iter().map(|mut parts| -> Task<'_> {
            Box::new(move |batches| {
                for batch in batches {
                    parts.iter_mut().for_each(|add| add(batch));
                }
            })
        });
        waves(source, tasks.collect())?;
        Ok(sums)
    }

    /// What adds a batch to a part of the sums, for each of their parts; images and local columns are split into
    /// `split` of them.
    fn parts<'s>(&'s mut self, source: &Source<'_>, families: &'s Families, split: usize) -> Vec<Part<'s>> {
        let (d, l, dim) = (self.dense, self.local, source.structure.dim);
        let [images, locals] = [source.structure.images, l].map(|lines| lines.div_ceil(split).max(1));
        let width = if self.diagonal_alone { 1 } else { l };
        let mut added: Vec<Part<'s>> = Vec::new();
        let (score, length, squares) = (&mut self.score_dense, &mut self.length_dense, &mut self.squares_dense);
        added.push(Box::new(move |batch| {
            add(score, 1.0, &batch.score);
            add(length, 1.0, &batch.length);
            add(squares, 1.0, &batch.squares);
        }));
        for (task, columns) in self.dense_dense.chunks_mut((TASK_COLUMNS * d).max(1)).enumerate() {
            let first = task * TASK_COLUMNS;
            added.push(Box::new(move |batch| {
                dispatch(Multiply { rows: &batch.panel, d, first, columns, until: &families.dense[first..] });
            }));
        }
        for (task, lines) in self.image_dense.chunks_mut((images * dim * d).max(1)).enumerate() {
            added.push(Box::new(move |batch| {
                let lines = ImageLines { batch, columns: d, first: task * images, lines };
                match dim {
                    6 => dispatch(ImagesDense::<6>(lines)),
                    7 => dispatch(ImagesDense::<7>(lines)),
                    8 => dispatch(ImagesDense::<8>(lines)),
                    _ => dispatch(ImagesDense::<MAX_DIM>(lines)),
                }
            }));
        }
        for (task, lines) in self.image_local.chunks_mut((images * dim * l).max(1)).enumerate() {
            added.push(Box::new(move |batch| {
                let lines = ImageLines { batch, columns: l, first: task * images, lines };
                match dim {
                    6 => dispatch(ImagesLocal::<6>(lines)),
                    7 => dispatch(ImagesLocal::<7>(lines)),
                    8 => dispatch(ImagesLocal::<8>(lines)),
                    _ => dispatch(ImagesLocal::<MAX_DIM>(lines)),
                }
            }));
        }
        let dense = self.local_dense.chunks_mut((locals * d).max(1));
        let local = self.local_local.chunks_mut((locals * width).max(1));
        let scores = self.score_local.chunks_mut(locals);
        let lengths = self.length_local.chunks_mut(locals);
        let squares = self.squares_local.chunks_mut(locals);
        let lines = dense.zip(local).zip(scores).zip(lengths).zip(squares);
        for (task, ((((dense, local), score), length), squares)) in lines.enumerate() {
            let first = task * locals;
            added.push(Box::new(move |batch| {
                dispatch(LocalLines { batch, first, d, width, families, dense, local, score, length, squares });
            }));
        }
        added
    }
}

/// Adds a batch to a part of the sums.
type Part<'a> = Box<dyn FnMut(&Batch) + Send + 'a>;
