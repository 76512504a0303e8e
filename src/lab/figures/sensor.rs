//! What lies on the sensor: mean residuals in cells of all images, and every residual of one image.

use super::{Scene, brushed};
use crate::lab::measurements::set_aside_in;
use crate::lab::state::Lab;
use crate::report::figures::{Arrow, ArrowSet, VectorField, vector_field};
use crate::report::pictures;
use crate::report::style::{BLUE, GREEN, GREY, VERMILLION};
use crate::run::folder::FINAL;
use anyhow::{Result, bail};

/// Cells along the longer side of a sensor, where the base did not say which.
const CELLS: f64 = 20.0;
/// Measurements that are set aside and are named in the figure of an image.
const MOST_NAMED: usize = 6;

impl Scene<'_> {
    pub(super) fn sensor(&self, lab: &Lab, id: u32) -> Result<String> {
        let source = lab.source(id)?;
        let Some(camera) = source.block.cameras.get(self.asked.camera) else {
            bail!("camera={}: the block has {} cameras, counted from 0", self.asked.camera, source.block.cameras.len());
        };
        let title = self.title(&format!("Mean residual of the tie points, camera {}", camera.id));
        let of_report = pictures::sensor(&self.view.run, &camera.id, FINAL, &title);
        let size = [camera.width_px, camera.height_px].map(f64::from);
        let cell = of_report.as_ref().map_or([size[0].max(size[1]) / CELLS; 2], |field| cell_of(field, size));
        let mut field = match (&of_report, self.chosen.is_some() || self.predicted) {
            (Some(field), false) => field.clone(),
            _ => self.field(&title, size, cell),
        };
        field.width = self.asked.width;
        // What is brushed or predicted has the scale of what is there.
        let there = of_report.map(|of_report| VectorField { width: field.width, ..of_report });
        let natural = there.as_ref().unwrap_or(&field).natural_scale();
        field.scale = self.asked.scale.or(natural);
        let attributes = format!("data-view=\"sensor\" data-camera=\"{}\"", self.asked.camera);
        Ok(brushed(vector_field(&field), &attributes, &[("x", "x", "x"), ("y", "y", "y")]))
    }

    fn field(&self, title: &str, size: [f64; 2], cell: [f64; 2]) -> VectorField {
        let of_camera = |k: &usize| {
            self.columns.tie[*k]
                && self.columns.images[self.columns.image[*k] as usize].camera as usize == self.asked.camera
        };
        let ties: Vec<usize> = (0..self.columns.len()).filter(of_camera).collect();
        let mut field = VectorField::single(title, size, Vec::new(), "px");
        let (all, _) = self.cells(ties.iter().copied(), size, cell);
        field.sets = match &self.chosen {
            None => vec![all],
            Some(chosen) => {
                let (brushed, n) = self.cells(ties.iter().copied().filter(|k| chosen[*k]), size, cell);
                let label = format!("brushed ({n})");
                vec![
                    ArrowSet { dimmed: true, label: "all".into(), significant: Vec::new(), ..all },
                    ArrowSet { label, ..brushed },
                ]
            }
        };
        field
    }

    /// Mean residuals in cells; significant as if measurements were independent and equally precise.
    fn cells(&self, of: impl Iterator<Item = usize>, size: [f64; 2], cell: [f64; 2]) -> (ArrowSet, usize) {
        let shape = [0, 1].map(|axis| (size[axis] / cell[axis]).ceil().max(1.0) as usize);
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
        let mut set = ArrowSet::default();
        for (place, (count, sum)) in sums.into_iter().enumerate().filter(|(_, (count, _))| *count > 0) {
            let centre = [
                (place % shape[0]) as f64 * cell[0] + 0.5 * cell[0],
                (place / shape[0]) as f64 * cell[1] + 0.5 * cell[1],
            ];
            let mean = sum.map(|sum| sum / count as f64);
            // Chi-square with two degrees of freedom.
            let p = (-0.5 * count as f64 * (mean[0] * mean[0] + mean[1] * mean[1]) / variance).exp();
            set.arrows.push((centre, mean));
            set.significant.push(p < pictures::MARKED_P);
        }
        (set, n)
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
        let [ties, marks] = if plain { [BLUE, GREEN] } else { [VERMILLION; 2] };
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

/// Width and height of the cells of a field.
fn cell_of(field: &VectorField, size: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let mut at: Vec<f64> =
            field.sets.iter().flat_map(|set| set.arrows.iter().map(|(place, _)| place[axis])).collect();
        at.sort_by(f64::total_cmp);
        let steps = at.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-6 * size[axis]);
        let step = steps.fold(f64::INFINITY, f64::min);
        if step.is_finite() { step } else { size[0].max(size[1]) / CELLS }
    })
}
