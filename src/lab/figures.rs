//! The figures of a node: those of the report, with what is brushed standing out, and at a scale that can be held.

use super::brush::Brush;
use super::columns::{Columns, Component, Quantity};
use super::state::Lab;
use super::view::View;
use crate::report::figures::{
    Arrow, ArrowSet, Axis, BinnedProfile, Histogram, Ledger, LedgerStep, Sample, VectorField, flights_plan_profile,
    histogram, image_bars, ledger, profile, residuals_plan_arrows, residuals_plan_signed, vector_field,
};
use crate::report::numbers::significant;
use crate::report::pictures;
use crate::report::style::{BLUE, GREEN, GREY, VERMILLION};
use crate::run::folder::{CheckRow, FINAL};
use anyhow::{Result, bail};
use std::collections::HashSet;

/// Bins of a profile.
const BINS: usize = 24;
/// Cells along the longer side of a sensor, where the base did not say which.
const CELLS: f64 = 20.0;

/// Every figure, by name.
pub const NAMES: [&str; 10] =
    ["sensor", "image", "images", "plan", "height", "flights", "profile", "histogram", "checks", "ledger"];

/// What is asked of a figure.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// What stands out.
    pub brush: Option<Brush>,
    /// Figure pixels per unit of the arrows.
    pub scale: Option<f64>,
    /// Range of the vertical axis at least.
    pub y: Option<[f64; 2]>,
    /// Position of the camera.
    pub camera: usize,
    /// Position of the image.
    pub image: usize,
    /// Quantity of the profile.
    pub against: Option<Quantity>,
    /// Components of the profile.
    pub components: Vec<Component>,
    /// `check` or `control`; check points where there are any.
    pub role: Option<String>,
    /// Width of the drawing, px.
    pub width: Option<f64>,
}

/// What a figure is drawn from.
struct Scene<'a> {
    view: &'a View,
    columns: &'a Columns,
    checks: &'a [CheckRow],
    predicted: bool,
    chosen: Option<Vec<bool>>,
    asked: &'a Asked,
}

/// Draws a figure of a node; with `effect`, as it is predicted to be with that effect.
///
/// # Errors
/// A name that no figure has; an index that the block does not have; a node that cannot be read.
pub fn draw(lab: &Lab, id: u32, name: &str, effect: Option<&str>, asked: &Asked) -> Result<String> {
    if name == "ledger" {
        return draw_ledger(lab, id, asked.width);
    }
    let view = lab.view(id)?;
    let prediction = effect.map(|effect| super::predicted::predicted(lab, id, effect)).transpose()?;
    let (columns, checks) = match &prediction {
        Some(predicted) => (&predicted.columns, predicted.checks.as_slice()),
        None => (&view.columns, view.run.checks.as_slice()),
    };
    let chosen = asked.brush.as_ref().map(|brush| brush.members(columns));
    let scene = Scene { view: &view, columns, checks, predicted: prediction.is_some(), chosen, asked };
    match name {
        "sensor" => scene.sensor(lab, id),
        "image" => scene.image(lab, id),
        "images" => Ok(scene.images()),
        "plan" => Ok(scene.plan()),
        "height" => Ok(scene.height()),
        "flights" => Ok(scene.flights()),
        "profile" => scene.profile(),
        "histogram" => Ok(scene.histogram()),
        "checks" => Ok(scene.checks()),
        other => bail!("there is no figure {other:?}; there are {}", NAMES.join(", ")),
    }
}

/// Says of the plotting areas which brush they make.
fn brushed(svg: String, attributes: &str, keys: &[(&str, &str, &str)]) -> String {
    let mut svg = svg.replace("class=\"plot\"", &format!("class=\"plot\" {attributes}"));
    for (axis, label, key) in keys {
        let name = format!("data-{axis}name=\"{label}\"");
        svg = svg.replace(&name, &format!("{name} data-{axis}key=\"{key}\""));
    }
    svg
}

impl Scene<'_> {
    fn is_chosen(&self, k: usize) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen[k])
    }

    fn title(&self, title: &str) -> String {
        if self.predicted { format!("Predicted: {title}") } else { title.to_string() }
    }

    fn sensor(&self, lab: &Lab, id: u32) -> Result<String> {
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

    fn image(&self, lab: &Lab, id: u32) -> Result<String> {
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
        let aside = super::about::set_aside_in(&source.block, &self.view.outliers, number);
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

    fn images(&self) -> String {
        let mut bars = pictures::image_rms(&self.view.run, &self.columns.rms_of_images(|_| true));
        bars.title = self.title(&bars.title);
        (bars.y.range, bars.width) = (self.asked.y, self.asked.width);
        if let Some(chosen) = &self.chosen {
            let part = self.columns.rms_of_images(|k| chosen[k]);
            for bar in &mut bars.bars {
                bar.dimmed = true;
                bar.part = bar.image.and_then(|image| part[image]);
            }
        }
        let key = ("x", "image in the order of the block", "range");
        brushed(image_bars(&bars), "data-view=\"images\"", &[key])
    }

    /// Points of the role asked for, and its name.
    fn points(&self) -> (&'static str, Vec<&CheckRow>) {
        let of = |role: &str| self.checks.iter().filter(|row| row.role == role).collect::<Vec<_>>();
        match self.asked.role.as_deref() {
            Some("control") => ("Control points", of("control")),
            Some(_) => ("Check points", of("check")),
            None if of("check").is_empty() => ("Control points", of("control")),
            None => ("Check points", of("check")),
        }
    }

    fn plan(&self) -> String {
        let (name, rows) = self.points();
        let mut plan = pictures::plan(name, rows.iter().copied());
        plan.title = self.title(&plan.title);
        (plan.scale, plan.width) = (self.asked.scale, self.asked.width);
        if let Some(chosen) = &self.chosen {
            let marks = (0..chosen.len()).filter(|k| chosen[*k] && !self.columns.tie[*k]);
            let held: HashSet<[i64; 2]> = marks.map(|k| near(self.columns.place(k))).collect();
            let [east, north, _] = self.columns.origin;
            let place = |row: &&CheckRow| near([row.x - east, row.y - north, 0.0]);
            plan.standing_out = rows.iter().map(|row| held.contains(&place(row))).collect();
        }
        in_plan(residuals_plan_arrows(&plan), "plan")
    }

    fn height(&self) -> String {
        let (name, rows) = self.points();
        let mut heights = pictures::heights(name, rows.into_iter());
        heights.title = self.title(&heights.title);
        (heights.scale, heights.width) = (self.asked.scale, self.asked.width);
        in_plan(residuals_plan_signed(&heights), "plan")
    }

    fn flights(&self) -> String {
        let mut plan = pictures::flights(&self.view.run);
        plan.width = self.asked.width;
        if let Some(chosen) = &self.chosen {
            let held: HashSet<u32> = (0..chosen.len()).filter(|k| chosen[*k]).map(|k| self.columns.image[k]).collect();
            for (number, station) in plan.images.iter_mut().enumerate() {
                station.dimmed = !held.contains(&(number as u32));
            }
        }
        in_plan(flights_plan_profile(&plan), "flights")
    }

    fn profile(&self) -> Result<String> {
        let varying = || Quantity::ALL.iter().map(|(quantity, ..)| *quantity).find(|q| self.columns.varies(*q));
        let Some(against) = self.asked.against.or_else(varying) else { bail!("no recorded quantity varies") };
        let (label, unit) = against.about();
        let ties: Vec<usize> = self.columns.tie_numbers().collect();
        let values: Vec<f64> = ties.iter().map(|k| self.columns.value(against, *k)).collect();
        let known = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let components = match self.asked.components.as_slice() {
            [] => &[Component::X, Component::Y][..],
            some => some,
        };
        let mut bins = Vec::new();
        let rows = |wanted: Option<&[bool]>, component: Component| -> Vec<[f64; 3]> {
            let mut sums = vec![(0usize, 0.0, 0.0, 0.0); BINS];
            for (k, value) in ties.iter().zip(&values).filter(|(_, value)| value.is_finite()) {
                let residual = self.columns.component(component, *k);
                if wanted.is_some_and(|wanted| !wanted[*k]) || !residual.is_finite() {
                    continue;
                }
                let width = (high - low).max(f64::MIN_POSITIVE);
                let sum = &mut sums[(((value - low) / width * BINS as f64) as usize).min(BINS - 1)];
                *sum = (sum.0 + 1, sum.1 + value, sum.2 + residual, sum.3 + residual * residual);
            }
            let row = |(n, at, sum, squares): (usize, f64, f64, f64)| {
                let count = n as f64;
                let mean = sum / count;
                let variance = ((squares - count * mean * mean) / (count - 1.0)).max(0.0);
                [at / count, mean, 2.0 * (variance / count).sqrt()]
            };
            sums.into_iter().filter(|(n, ..)| *n > 1).map(row).collect()
        };
        let name = |component: &Component| super::change::name(component);
        let mut dimmed = 0;
        if let Some(chosen) = &self.chosen {
            for component in components {
                bins.push((format!("{} of all", name(component)), rows(None, *component)));
            }
            dimmed = components.len();
            for component in components {
                bins.push((format!("{} of the brushed", name(component)), rows(Some(chosen), *component)));
            }
        } else {
            bins.extend(components.iter().map(|component| (name(component), rows(None, *component))));
        }
        let chart = BinnedProfile {
            title: self.title(&format!("Mean residual against {label}")),
            x: Axis::new(label, unit),
            y: Axis { range: self.asked.y, ..Axis::new("observed − computed", "px") },
            cloud: Vec::new(),
            bins,
            dimmed,
            bars: "± 2 sigma of the mean".into(),
            width: self.asked.width,
        };
        let attributes = format!("data-view=\"profile\" data-against=\"{}\"", super::change::name(&against));
        Ok(brushed(profile(&chart), &attributes, &[("x", label, "range")]))
    }

    fn histogram(&self) -> String {
        let of = |component: Component, wanted: Option<&[bool]>| -> Vec<f64> {
            let kept = self.columns.tie_numbers().filter(|k| wanted.is_none_or(|wanted| wanted[*k]));
            kept.map(|k| self.columns.component(component, k)).collect()
        };
        let all = [Component::X, Component::Y].map(|component| of(component, None));
        let [x, y] = all;
        let mut chart = pictures::residual_histogram(x, y);
        chart.title = self.title(&chart.title);
        (chart.counts, chart.width) = (self.asked.y, self.asked.width);
        if let Some(chosen) = &self.chosen {
            chart.samples.iter_mut().for_each(|sample| sample.dimmed = true);
            for (label, component) in [("x of the brushed", Component::X), ("y of the brushed", Component::Y)] {
                let values = of(component, Some(chosen));
                chart.samples.push(Sample { label: label.into(), values, ..Sample::default() });
            }
        }
        let key = ("x", "observed − computed", "range");
        brushed(histogram(&chart), "data-view=\"histogram\" data-component=\"x\"", &[key])
    }

    fn checks(&self) -> String {
        let (name, rows) = self.points();
        let mut chart: Histogram = pictures::check_histogram(name, &rows);
        chart.title = self.title(&chart.title);
        (chart.counts, chart.width) = (self.asked.y, self.asked.width);
        histogram(&chart)
    }
}

/// Measurements that are set aside and are named in the figure of an image.
const MOST_NAMED: usize = 6;

fn in_plan(svg: String, view: &str) -> String {
    let keys = [("x", "X", "e"), ("x", "Y", "n"), ("y", "X", "e"), ("y", "Y", "n")];
    brushed(svg, &format!("data-view=\"{view}\""), &keys)
}

/// A place to the centimetre, which is one point.
fn near(place: [f64; 3]) -> [i64; 2] {
    [place[0], place[1]].map(|v| (100.0 * v).round() as i64)
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

fn draw_ledger(lab: &Lab, id: u32, width: Option<f64>) -> Result<String> {
    let mut steps = Vec::new();
    for step in lab.path(id)? {
        let saved = lab.saved(step)?;
        steps.push(LedgerStep {
            name: saved.words,
            heldout_px: saved.figures.heldout_px.unwrap_or(f64::NAN),
            check_mm: saved.figures.check_rms_m.map(|rms| 1e3 * rms),
            sigma0: saved.figures.sigma0.unwrap_or(f64::NAN),
        });
    }
    Ok(ledger(&Ledger { title: format!("From the root to step {id}"), steps, width }))
}

/// What became smaller or larger from one node to the next.
pub fn difference(before: &super::tree::Figures, after: &super::tree::Figures) -> String {
    let mm = |m: f64| if 1e3 * m >= 1.0 { format!("{:.1}", 1e3 * m) } else { significant(1e3 * m, 2) };
    let mut words = Vec::new();
    if let (Some(a), Some(b)) = (before.check_rms_m, after.check_rms_m) {
        words.push(format!("check points {} → {} mm", mm(a), mm(b)));
    }
    if let (Some(a), Some(b)) = (before.tie_rms_px, after.tie_rms_px) {
        words.push(format!("tie points {a:.3} → {b:.3} px"));
    }
    if let (Some(a), Some(b)) = (before.heldout_px, after.heldout_px) {
        words.push(format!("held out {a:.3} → {b:.3} px"));
    }
    words.join(", ")
}
