//! Residuals of GNSS positions: what lies between the antenna that the model predicts and where the receiver says it
//! was.

use super::points::in_plan;
use super::{Scene, brushed};
use crate::lab::asked::GnssShown;
use crate::lab::longest::{largest, longest_arrow};
use crate::lab::state::Lab;
use crate::report::figures::{line_chart, residuals_plan_arrows, residuals_plan_signed};
use crate::report::pictures::{GnssAgainst, frame, gnss_heights, gnss_plan, gnss_series};
use anyhow::{Result, bail};
use std::collections::HashSet;

impl Scene<'_> {
    pub(super) fn gnss(&self, lab: &Lab, id: u32) -> Result<String> {
        let chosen = self.chosen_rows(lab, id)?;
        match self.asked.show {
            GnssShown::Plan => {
                let mut plan = gnss_plan(frame(&self.view.run), self.gnss);
                plan.title = self.title(&plan.title);
                plan.scale = self.scale(plan.natural_scale(), longest_arrow(&plan.arrows));
                plan.width = self.asked.width;
                plan.standing_out = chosen.unwrap_or_default();
                Ok(in_plan(residuals_plan_arrows(&plan), "flights"))
            }
            GnssShown::Height => {
                let mut heights = gnss_heights(frame(&self.view.run), self.gnss);
                heights.title = self.title(&heights.title);
                heights.scale = self.scale(heights.natural_scale(), largest(&heights.values));
                heights.width = self.asked.width;
                heights.standing_out = chosen.unwrap_or_default();
                Ok(in_plan(residuals_plan_signed(&heights), "flights"))
            }
            GnssShown::Time => self.gnss_against(GnssAgainst::Time, "time", chosen.as_deref()),
            GnssShown::Heading => self.gnss_against(GnssAgainst::Heading, "heading", chosen.as_deref()),
        }
    }

    fn gnss_against(&self, against: GnssAgainst, name: &str, chosen: Option<&[bool]>) -> Result<String> {
        let Some(mut chart) = gnss_series(self.gnss, against, chosen) else {
            bail!("show={name}: the {name} of no image with a GNSS position is known")
        };
        chart.title = self.title(&chart.title);
        chart.width = self.asked.width;
        chart.panels.iter_mut().for_each(|panel| panel.y.range = self.asked.y);
        let attributes = format!("data-view=\"profile\" data-against=\"{name}\"");
        Ok(brushed(line_chart(&chart), &attributes, &[("x", against.about().0, "range")]))
    }

    /// Which rows are of images with a measurement that is chosen.
    fn chosen_rows(&self, lab: &Lab, id: u32) -> Result<Option<Vec<bool>>> {
        let Some(held) = self.chosen_images() else { return Ok(None) };
        let source = lab.source(id)?;
        let images = source.block.images.iter().zip(held).filter(|(_, held)| *held);
        let names: HashSet<&str> = images.map(|(image, _)| image.name.as_str()).collect();
        Ok(Some(self.gnss.iter().map(|row| names.contains(row.image.as_str())).collect()))
    }
}
