//! Residuals by image, against what was recorded, and how they are distributed.

use super::{Scene, brushed};
use crate::lab::change::name;
use crate::lab::quantity::{Component, Quantity};
use crate::report::figures::{Axis, BinnedProfile, Sample, histogram, image_bars, profile};
use crate::report::pictures;
use anyhow::{Result, bail};

/// Bins of a profile.
const BINS: usize = 24;

impl Scene<'_> {
    pub(super) fn images(&self) -> String {
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

    pub(super) fn profile(&self) -> Result<String> {
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
        let attributes = format!("data-view=\"profile\" data-against=\"{}\"", name(&against));
        Ok(brushed(profile(&chart), &attributes, &[("x", label, "range")]))
    }

    pub(super) fn histogram(&self) -> String {
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
}
