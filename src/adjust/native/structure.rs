//! Which unknown stands where in the reduced system: a block of `dim` unknowns per image (pose, then image-wise effect
//! parameters), and a border of the unknowns that images share (cameras, effects).

use super::aligned::LINE;
use super::chunks::chunks;
use super::nonlinear;
use crate::camera::PARAMETER_COUNT;
use crate::effects::Scope;
use crate::measure::Stages;
use crate::problem::Problem;
use std::ops::Range;

/// Marks "not an unknown" in the index tables.
pub const NONE: u32 = u32::MAX;

/// Up to this many shared unknowns every row holds all of them: a sum over whole rows is then faster than one over
/// those that a row touches.
const WIDEST_DENSE_BORDER: usize = 44;

/// Unknowns of a pose, the first of an image.
pub const POSE: usize = 6;

/// First [`LocalColumn::source`] that is an effect parameter: those below are the camera's.
pub const FIRST_THETA: u32 = PARAMETER_COUNT as u32;

/// One shared unknown that a measurement of an image depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalColumn {
    /// Derivative to take: camera parameter, or [`FIRST_THETA`] + position in the image's local list of effect
    /// parameters.
    pub source: u32,
    /// Column of the border.
    pub column: u32,
    /// Raw unit per scaled unit.
    pub scale: f64,
}

/// One image-wise effect parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageColumn {
    /// Position in the local list of effect parameters.
    pub source: u32,
    /// Row within the image's block (6 and up).
    pub row: u32,
    /// Raw unit per scaled unit.
    pub scale: f64,
}

/// The reduced system's structure; depends on the problem alone, not on the state.
#[derive(Debug)]
pub struct Structure {
    /// Effects by stage.
    pub stages: Stages,
    /// Unknowns per image block.
    pub dim: usize,
    /// Numbers from row to row of an image block: whole cache lines.
    pub stride: usize,
    /// Numbers from row to row of the border: with zeros and the misclosure behind its columns, whole cache lines; of a
    /// wide border its columns alone.
    pub width: usize,
    /// Images.
    pub images: usize,
    /// Rank of each image along the block; the image blocks of the reduced system stand in this order.
    pub rank: Vec<u32>,
    /// Layout numbers of the border's unknowns.
    pub border: Vec<usize>,
    /// Their scales.
    pub border_scale: Vec<f64>,
    /// Columns of the border in which predicted measurements are far from linear: see [`nonlinear`].
    pub nonlinear: Vec<usize>,
    /// Layout numbers of the image blocks' unknowns by rank, `usize::MAX` where held.
    pub image_unknowns: Vec<usize>,
    /// Their scales.
    pub image_scales: Vec<f64>,
    /// Per image: shared unknowns of its measurements, by rising column.
    pub local: Vec<Vec<LocalColumn>>,
    /// Whether these, and those of `own`, are the same for all images.
    pub one_list: bool,
    /// Per image, by rank: whether a part of its pose is held.
    pub holds_pose: Vec<bool>,
    /// Per image: image-wise effect parameters.
    pub own: Vec<Vec<ImageColumn>>,
    /// Slots of the row of rank `a`: `row_start[a]..row_start[a + 1]`; the first is the diagonal block.
    pub row_start: Vec<usize>,
    /// Rank of each slot's column.
    pub slot_column: Vec<u32>,
    /// Slot of (a, b): `band[band_start[a] + b - a]`.
    band_start: Vec<usize>,
    band: Vec<u32>,
    /// Points in fixed chunks.
    pub chunks: Vec<Range<usize>>,
    /// Ranks of the images that see the points of each.
    pub chunk_ranks: Vec<Range<usize>>,
}

impl Structure {
    /// Analyses the problem.
    pub fn new(problem: &Problem) -> Self {
        let layout = problem.layout();
        let stages = Stages::new(problem);
        let images = layout.images;
        let rank = problem.image_ranks.clone();

        // Border: free camera parameters, then free effect parameters. Image-wise values with a prior stand in their
        // image's block; without one they may be anything to each other and go to the border too.
        let image_wise = |t: usize| {
            let entry = &problem.theta[t];
            let scope = problem.effects[entry.effect as usize].slots[entry.parameter as usize].0;
            scope == Scope::Image && entry.prior_sigma.is_some()
        };
        let mut border = Vec::new();
        let mut border_scale = Vec::new();
        let mut column_of = vec![NONE; layout.pose(0, 0)];
        let mut add = |unknown: usize, scale: f64| {
            column_of[unknown] = border.len() as u32;
            border.push(unknown);
            border_scale.push(scale);
        };
        for (c, free) in problem.camera_free.iter().enumerate() {
            for k in (0..PARAMETER_COUNT).filter(|k| free[*k]) {
                add(layout.camera(c, k), problem.camera_scales[c][k]);
            }
        }
        for (t, entry) in problem.theta.iter().enumerate() {
            if entry.free && !image_wise(t) {
                add(layout.theta(t), entry.scale);
            }
        }

        let mut local = Vec::with_capacity(images);
        let mut own: Vec<Vec<ImageColumn>> = Vec::with_capacity(images);
        for image in 0..images {
            let camera = problem.image_contexts[image].camera as usize;
            let mut columns = Vec::new();
            for k in 0..PARAMETER_COUNT {
                let column = column_of[layout.camera(camera, k)];
                if column != NONE {
                    columns.push(LocalColumn { source: k as u32, column, scale: problem.camera_scales[camera][k] });
                }
            }
            let mut own_columns = Vec::new();
            for (p, t) in stages.theta_indices(problem, image).into_iter().enumerate() {
                let entry = &problem.theta[t];
                if entry.free && image_wise(t) {
                    let row = 6 + own_columns.len() as u32;
                    own_columns.push(ImageColumn { source: p as u32, row, scale: entry.scale });
                } else if column_of[layout.theta(t)] != NONE {
                    let column = column_of[layout.theta(t)];
                    columns.push(LocalColumn { source: FIRST_THETA + p as u32, column, scale: entry.scale });
                }
            }
            columns.sort_by_key(|column: &LocalColumn| column.column);
            local.push(columns);
            own.push(own_columns);
        }
        let dim = 6 + own.iter().map(Vec::len).max().unwrap_or(0);
        let mut image_unknowns = vec![usize::MAX; images * dim];
        let mut image_scales = vec![1.0; images * dim];
        for image in 0..images {
            let base = rank[image] as usize * dim;
            for k in (0..6).filter(|k| problem.pose_free[image][*k]) {
                image_unknowns[base + k] = layout.pose(image, k);
            }
            let indices = stages.theta_indices(problem, image);
            for column in &own[image] {
                image_unknowns[base + column.row as usize] = layout.theta(indices[column.source as usize]);
                image_scales[base + column.row as usize] = column.scale;
            }
        }

        let holds_pose = image_unknowns.chunks_exact(dim).map(|own| own[..POSE].contains(&usize::MAX)).collect();
        let (row_start, slot_column, band_start, band) = pair_slots(problem, &rank);
        let chunks = chunks(&problem.point_start);
        let width = match border.len() {
            narrow if narrow <= WIDEST_DENSE_BORDER => (narrow + 1).next_multiple_of(LINE),
            wide => wide,
        };
        Self {
            stages,
            dim,
            stride: dim.next_multiple_of(LINE),
            width,
            images,
            rank,
            nonlinear: nonlinear::columns(problem, &border),
            border,
            border_scale,
            image_unknowns,
            image_scales,
            one_list: local.windows(2).all(|pair| pair[0] == pair[1]) && own.windows(2).all(|pair| pair[0] == pair[1]),
            holds_pose,
            local,
            own,
            row_start,
            slot_column,
            band_start,
            band,
            chunk_ranks: chunks.iter().map(|points| ranks_of(problem, points)).collect(),
            chunks,
        }
    }

    /// Ranks of the images of the chunk that touches the most blocks: memory for these is enough for every chunk.
    pub fn largest_part(&self) -> Range<usize> {
        let blocks = |ranks: &&Range<usize>| self.row_start[ranks.end] - self.row_start[ranks.start];
        self.chunk_ranks.iter().max_by_key(blocks).cloned().unwrap_or_default()
    }

    /// Whether rows hold the columns of the border that they touch, and not all of them.
    pub fn wide_border(&self) -> bool {
        self.border.len() > WIDEST_DENSE_BORDER
    }

    /// Sets the derivatives by what is held of a pose to zero, in the row of an image.
    #[inline(always)]
    pub fn hold_pose(&self, rank: u32, row: &mut [f64]) {
        let rank = rank as usize;
        if self.holds_pose[rank] {
            let unknowns = &self.image_unknowns[rank * self.dim..][..POSE];
            row.iter_mut()
                .zip(unknowns)
                .filter(|(_, u)| **u == usize::MAX)
                .for_each(|(derivative, _)| *derivative = 0.0);
        }
    }

    /// Slot of the block of ranks `a <= b`, which share a point.
    #[inline]
    pub fn slot(&self, a: u32, b: u32) -> usize {
        self.band[self.band_start[a as usize] + (b - a) as usize] as usize
    }

    /// Slots of the blocks of rank `a` with the ranks from `a` on.
    #[inline]
    pub fn slots(&self, a: u32) -> &[u32] {
        &self.band[self.band_start[a as usize]..]
    }

    /// Rank and row within its block of an unknown of `image`; `None` where it is none of the image's unknowns.
    pub fn image_position(&self, unknown: usize, image: usize) -> Option<(usize, usize)> {
        let rank = *self.rank.get(image)? as usize;
        let block = &self.image_unknowns[rank * self.dim..(rank + 1) * self.dim];
        block.iter().position(|u| *u == unknown).map(|row| (rank, row))
    }
}

/// Slots of all pairs of images that share a point: row starts, columns, band starts, band.
fn pair_slots(problem: &Problem, rank: &[u32]) -> (Vec<usize>, Vec<u32>, Vec<usize>, Vec<u32>) {
    let images = rank.len();
    let mut last: Vec<u32> = (0..images as u32).collect();
    let mut ranks = Vec::new();
    let each_point = |visit: &mut dyn FnMut(&[u32]), ranks: &mut Vec<u32>| {
        for j in 0..problem.point_sources.len() {
            ranks.clear();
            let range = problem.point_start[j]..problem.point_start[j + 1];
            ranks.extend(problem.observations[range].iter().map(|o| rank[o.image as usize]));
            ranks.sort_unstable();
            visit(ranks);
        }
    };
    each_point(
        &mut |ranks| {
            for a in ranks {
                last[*a as usize] = last[*a as usize].max(*ranks.last().unwrap_or(a));
            }
        },
        &mut ranks,
    );
    let mut band_start = Vec::with_capacity(images);
    let mut length = 0;
    for a in 0..images {
        band_start.push(length);
        length += last[a] as usize - a + 1;
    }
    let mut band = vec![NONE; length];
    for start in &band_start {
        band[*start] = 0;
    }
    each_point(
        &mut |ranks| {
            for (i, a) in ranks.iter().enumerate() {
                for b in &ranks[i..] {
                    band[band_start[*a as usize] + (b - a) as usize] = 0;
                }
            }
        },
        &mut ranks,
    );
    let mut row_start = Vec::with_capacity(images + 1);
    let mut slot_column = Vec::new();
    for a in 0..images {
        row_start.push(slot_column.len());
        for b in a..=last[a] as usize {
            let entry = &mut band[band_start[a] + b - a];
            if *entry != NONE {
                *entry = slot_column.len() as u32;
                slot_column.push(b as u32);
            }
        }
    }
    row_start.push(slot_column.len());
    (row_start, slot_column, band_start, band)
}

/// Ranks of the images that see the points.
fn ranks_of(problem: &Problem, points: &Range<usize>) -> Range<usize> {
    let observations = &problem.observations[problem.point_start[points.start]..problem.point_start[points.end]];
    let ranks = observations.iter().map(|o| problem.image_ranks[o.image as usize] as usize);
    let first = ranks.clone().min().unwrap_or(0);
    first..ranks.max().map_or(first, |last| last + 1)
}
