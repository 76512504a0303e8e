//! The page of a plan.

use super::effects;
use super::goals::Reached;
use super::mistakes::{self, MISTAKES};
use super::precision::{self, RELIABILITY};
use crate::plan::Plan;
use crate::plan::notice::Noticed;
use crate::report::figures::{line_chart, plan_ellipses};
use crate::report::html::Page;
use crate::report::pictures::ellipses_of_plan;

/// All that a plan says, with a map of the precision of its points.
pub fn page(planned: &Plan, mistakes: &[Noticed], goals: Option<&Reached>) -> Page {
    let mut page = Page::new(format!("What the plan `{}` would show", planned.block));
    page.subtitle(&effects::heading(planned));
    page.section("Smallest effects that it would show");
    page.table(&effects::table(planned)).list(effects::notes(planned));
    page.section("Precision of points");
    let ties = precision::of_ties(planned);
    if !ties.is_empty() {
        page.paragraph(&ties.join(" "));
    }
    if let Some(check) = &planned.precision.check {
        page.paragraph(&precision::of_checks(check));
    }
    if !planned.precision.points.is_empty() {
        let ellipses = ellipses_of_plan(&planned.precision);
        let caption = "1 sigma in plan; the stroke upwards is 1 sigma in height.";
        page.figure("ellipses", plan_ellipses(&ellipses), caption);
    }
    if !planned.reliability.is_empty() {
        page.section(RELIABILITY).table(&precision::table(&planned.reliability));
    }
    if !mistakes.is_empty() {
        page.section(MISTAKES).table(&mistakes::table(mistakes));
    }
    if let Some(goals) = goals {
        page.section("Goals").table(&goals.table());
        goals.outcome().lines().for_each(|line| {
            page.paragraph(line);
        });
        let chart = goals.trade_off();
        if chart.panels.iter().any(|panel| !panel.series.is_empty()) {
            page.figure("trade-off", line_chart(&chart), "What each addition brings for its cost.");
        }
    }
    page
}
