//! What lies in the survey's system: cameras, control and check points and their errors.

use super::{Scene, brushed};
use crate::lab::longest::{largest, longest_arrow};
use crate::lab::state::Lab;
use crate::report::figures::{Sample, flights_plan_profile, histogram, residuals_plan_arrows, residuals_plan_signed};
use crate::report::pictures;
use crate::run::folder::CheckRow;
use anyhow::Result;
use std::collections::HashSet;

impl Scene<'_> {
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

    /// Which of these points have a mark that is chosen; `None` where nobody chose.
    fn chosen_points(&self, lab: &Lab, id: u32, rows: &[&CheckRow]) -> Result<Option<Vec<bool>>> {
        let Some(chosen) = &self.chosen else { return Ok(None) };
        let source = lab.source(id)?;
        let marks = (0..chosen.len()).filter(|k| chosen[*k] && !self.columns.tie[*k]);
        let name = |k: usize| source.block.surveyed[self.columns.point[k] as usize].name.as_str();
        let held: HashSet<&str> = marks.map(name).collect();
        Ok(Some(rows.iter().map(|row| held.contains(row.point.as_str())).collect()))
    }

    pub(super) fn plan(&self, lab: &Lab, id: u32) -> Result<String> {
        let (name, rows) = self.points();
        let mut plan = pictures::plan(name, pictures::frame(&self.view.run), rows.iter().copied());
        plan.title = self.title(&plan.title);
        plan.scale = self.scale(plan.natural_scale(), longest_arrow(&plan.arrows));
        plan.width = self.asked.width;
        plan.standing_out = self.chosen_points(lab, id, &rows)?.unwrap_or_default();
        Ok(in_plan(residuals_plan_arrows(&plan), "plan"))
    }

    pub(super) fn height(&self, lab: &Lab, id: u32) -> Result<String> {
        let (name, rows) = self.points();
        let mut heights = pictures::heights(name, pictures::frame(&self.view.run), rows.iter().copied());
        heights.title = self.title(&heights.title);
        heights.scale = self.scale(heights.natural_scale(), largest(&heights.values));
        heights.width = self.asked.width;
        heights.standing_out = self.chosen_points(lab, id, &rows)?.unwrap_or_default();
        Ok(in_plan(residuals_plan_signed(&heights), "plan"))
    }

    pub(super) fn flights(&self) -> String {
        let mut plan = pictures::flights(&self.view.run);
        plan.width = self.asked.width;
        if let Some(held) = self.chosen_images() {
            plan.images.iter_mut().zip(held).for_each(|(station, held)| station.dimmed = !held);
        }
        in_plan(flights_plan_profile(&plan), "flights")
    }

    pub(super) fn checks(&self, lab: &Lab, id: u32) -> Result<String> {
        let (name, rows) = self.points();
        let mut chart = pictures::check_histogram(name, &rows);
        chart.title = self.title(&chart.title);
        (chart.counts, chart.width) = (self.asked.y, self.asked.width);
        if let Some(chosen) = self.chosen_points(lab, id, &rows)? {
            let held: Vec<&CheckRow> = rows.iter().zip(chosen).filter(|(_, held)| *held).map(|(row, _)| *row).collect();
            chart.samples.iter_mut().for_each(|sample| sample.dimmed = true);
            let brushed = pictures::check_histogram(name, &held).samples.into_iter();
            chart.samples.extend(brushed.map(|own| Sample { label: format!("{} of the brushed", own.label), ..own }));
        }
        Ok(histogram(&chart))
    }
}

pub(super) fn in_plan(svg: String, view: &str) -> String {
    let keys = [("x", "X", "e"), ("x", "E", "e"), ("x", "Y", "n"), ("x", "N", "n"), ("y", "Y", "n"), ("y", "N", "n")];
    brushed(svg, &format!("data-view=\"{view}\""), &keys)
}
