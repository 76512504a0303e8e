//! What lies on the sensor: mean residuals in cells of all images, and every residual of one image.

use super::{Scene, brushed};
use crate::block::{Block, Role};
use crate::lab::longest::longest_arrow;
use crate::lab::measurements::set_aside_in;
use crate::lab::state::Lab;
use crate::report::figures::{Arrow, ArrowSet, Cell, VectorField, vector_field};
use crate::report::pictures;
use crate::report::style::{BLUE, CHOSEN, GREEN, GREY};
use crate::run::CELLS;
use crate::run::folder::FINAL;
use anyhow::{Result, bail};

/// Measurements that are set aside and are named in the figure of an image.
const MOST_NAMED: usize = 6;

impl Scene<'_> {
    pub(super) fn sensor(&self, lab: &Lab, id: u32) -> Result<String> {
        let source = lab.source(id)?;
        let Some(camera) = source.block.cameras.get(self.asked.camera) else {
            bail!("camera={}: the block has {} cameras, counted from 0", self.asked.camera, source.block.cameras.len());
        };
        let title = self.title(&format!("Mean residual, camera {}", camera.id));
        let of_report = pictures::sensor(&self.view.run, &camera.id, FINAL, &title);
        let size = [camera.width_px, camera.height_px].map(f64::from);
        let of_base = of_report.as_ref().and_then(|field| field.cells.first());
        let cell = of_base.map_or([size[0].max(size[1]) / CELLS; 2], |cell| cell.size);
        let mut field = match (&of_report, self.chosen.is_some() || self.predicted) {
            (Some(field), false) => field.clone(),
            _ => self.field(&title, self.adjusted(&source.block), size, cell),
        };
        field.width = self.asked.width;
        // What is brushed or predicted has the scale of what is there.
        let there = of_report.map(|of_report| VectorField { width: field.width, ..of_report });
        let shown = there.as_ref().unwrap_or(&field);
        let own = shown.sets.iter().map(|set| longest_arrow(&set.arrows)).fold(0.0, f64::max);
        field.scale = self.scale(shown.natural_scale(), own);
        let attributes = format!("data-view=\"sensor\" data-camera=\"{}\"", self.asked.camera);
        Ok(brushed(vector_field(&field), &attributes, &[("x", "x", "x"), ("y", "y", "y")]))
    }

    /// Measurements in images of the camera that an adjustment takes: those of tie points and of control points.
    fn adjusted(&self, block: &Block) -> Vec<usize> {
        let columns = self.columns;
        let taken = |k: &usize| {
            let camera = columns.images[columns.image[*k] as usize].camera as usize;
            let is_control = || block.surveyed[columns.point[*k] as usize].role == Role::Control;
            camera == self.asked.camera && (columns.tie[*k] || is_control())
        };
        (0..columns.len()).filter(taken).collect()
    }

    fn field(&self, title: &str, adjusted: Vec<usize>, size: [f64; 2], cell: [f64; 2]) -> VectorField {
        let mut field = VectorField::single(title, size, Vec::new(), "px");
        let (all, cells) = self.cells(adjusted.iter().copied(), size, cell);
        match &self.chosen {
            None => (field.sets, field.cells) = (vec![all], cells),
            Some(chosen) => {
                let (brushed, own) = self.cells(adjusted.iter().copied().filter(|k| chosen[*k]), size, cell);
                let label = format!("brushed ({})", own.iter().map(|cell| cell.n).sum::<usize>());
                field.cells = of_both(cells, own);
                field.sets = vec![
                    ArrowSet { dimmed: true, label: "all".into(), significant: Vec::new(), ..all },
                    ArrowSet { label, ..brushed },
                ];
            }
        }
        field
    }

    /// Mean residuals in cells; significant as if measurements were independent and equally precise.
    fn cells(&self, of: impl Iterator<Item = usize>, size: [f64; 2], cell: [f64; 2]) -> (ArrowSet, Vec<Cell>) {
        // Not one more for the rounding of a quotient.
        let shape = [0, 1].map(|axis| (size[axis] / cell[axis] - 1e-6).ceil().max(1.0) as usize);
        let mut sums = vec![(0usize, [0.0; 2]); shape[0] * shape[1]];
        let (mut n, mut squares) = (0, 0.0);
        for k in of {
            let at = [f64::from(self.columns.x[k]), f64::from(self.columns.y[k])];
            let place = |axis: usize| ((at[axis] / cell[axis]).max(0.0) as usize).min(shape[axis] - 1);
            let r = [self.columns.rx[k], self.columns.ry[k]];
            let sum = &mut sums[place(1) * shape[0] + place(0)];
            *sum = (sum.0 + 1, [sum.1[0] + r[0], sum.1[1] + r[1]]);
            n += 1;
            squares += 0.5 * (r[0] * r[0] + r[1] * r[1]);
        }
        let variance = squares / f64::max(n as f64, 1.0);
        let (mut set, mut cells) = (ArrowSet::default(), Vec::new());
        for (place, (count, sum)) in sums.into_iter().enumerate().filter(|(_, (count, _))| *count > 0) {
            let centre = [
                (place % shape[0]) as f64 * cell[0] + 0.5 * cell[0],
                (place / shape[0]) as f64 * cell[1] + 0.5 * cell[1],
            ];
            let mean = sum.map(|sum| sum / count as f64);
            // Chi-square with two degrees of freedom.
            let p = (-0.5 * count as f64 * (mean[0] * mean[0] + mean[1] * mean[1]) / variance).exp();
            let is_significant = p < pictures::MARKED_P;
            set.arrows.push((centre, mean));
            set.significant.push(is_significant);
            let words = pictures::cell_words(count, mean, Some(is_significant));
            cells.push(Cell { centre, size: cell, n: count, words });
        }
        (set, cells)
    }

    pub(super) fn image(&self, lab: &Lab, id: u32) -> Result<String> {
        let source = lab.source(id)?;
        let number = self.asked.image;
        let Some(image) = source.block.images.get(number) else {
            bail!("image={number}: the block has {} images, counted from 0", source.block.images.len());
        };
        let camera = source.block.camera_of(number.into());
        let title = self.title(&format!("Residuals of the image {}", image.name));
        let size = [camera.width_px, camera.height_px].map(f64::from);
        let mut field = VectorField::single(&title, size, Vec::new(), "px");
        let own: Vec<usize> = (0..self.columns.len()).filter(|k| self.columns.image[*k] as usize == number).collect();
        let arrow = |k: usize| -> Arrow {
            ([f64::from(self.columns.x[k]), f64::from(self.columns.y[k])], [self.columns.rx[k], self.columns.ry[k]])
        };
        let set = |label: &str, colour, wanted: &dyn Fn(usize) -> bool| -> ArrowSet {
            let arrows: Vec<Arrow> = own.iter().copied().filter(|k| wanted(*k)).map(arrow).collect();
            ArrowSet {
                label: format!("{label} ({})", arrows.len()),
                arrows,
                colour: Some(colour),
                ..ArrowSet::default()
            }
        };
        let plain = self.chosen.is_none();
        field.sets.clear();
        if !plain {
            let rest = set("not brushed", GREY, &|k| !self.is_chosen(k));
            field.sets.push(ArrowSet { dimmed: true, colour: None, ..rest });
        }
        // What is brushed has the colour that it has everywhere.
        let [ties, marks] = if plain { [BLUE, GREEN] } else { [CHOSEN; 2] };
        field.sets.push(set("tie points", ties, &|k| self.columns.tie[k] && self.is_chosen(k)));
        field.sets.push(set("marks", marks, &|k| !self.columns.tie[k] && self.is_chosen(k)));
        field.sets.retain(|set| !set.arrows.is_empty());
        let aside = set_aside_in(&source.block, &self.view.outliers, number);
        for (row, at) in aside.iter().take(MOST_NAMED) {
            field.marks.push((format!("set aside: {}", row.point), *at));
        }
        if aside.len() > MOST_NAMED {
            field.title += &format!(" ({} of {} that are set aside are named)", MOST_NAMED, aside.len());
        }
        (field.scale, field.width) = (self.asked.scale, self.asked.width);
        let attributes = format!("data-view=\"image\" data-image=\"{number}\"");
        Ok(brushed(vector_field(&field), &attributes, &[("x", "x", "x"), ("y", "y", "y")]))
    }
}

/// The cells of all measurements, shaded by what is brushed of them.
fn of_both(all: Vec<Cell>, brushed: Vec<Cell>) -> Vec<Cell> {
    let mut brushed = brushed.into_iter().peekable();
    let both = |all: Cell| match brushed.next_if(|own| own.centre == all.centre) {
        Some(own) => Cell { n: own.n, words: format!("brushed: {}\nall: {}", own.words, all.words), ..all },
        None => Cell { n: 0, words: format!("brushed: none\nall: {}", all.words), ..all },
    };
    all.into_iter().map(both).collect()
}
