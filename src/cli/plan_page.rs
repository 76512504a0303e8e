//! The page of a plan.

use super::plan_effects;
use super::plan_goals::Reached;
use super::plan_mistakes::{self, MISTAKES};
use super::plan_precision::{self, RELIABILITY};
use crate::plan::notice::Noticed;
use crate::plan::{OfPoint, Plan};
use crate::report::figures::{MapFrame, PlanEllipses, line_chart, plan_ellipses};
use crate::report::html::Page;

/// All that a plan says, with a map of the precision of its points.
pub fn page(planned: &Plan, mistakes: &[Noticed], goals: Option<&Reached>) -> Page {
    let mut page = Page::new(format!("What the plan `{}` would show", planned.block));
    page.subtitle(&plan_effects::heading(planned));
    page.section("Smallest effects that it would show");
    page.table(&plan_effects::table(planned)).list(plan_effects::notes(planned));
    page.section("Precision of points");
    if let Some(check) = &planned.precision.check {
        page.paragraph(&plan_precision::of_checks(check));
    }
    if !planned.precision.points.is_empty() {
        let of_point = |own: &OfPoint| {
            let sigma = own.sigma_m * 1e3;
            ([own.position.x, own.position.y], [sigma.x, sigma.y, sigma.z], own.correlation)
        };
        let ellipses = PlanEllipses {
            title: "Error ellipses of tie points".into(),
            ellipses: planned.precision.points.iter().map(of_point).collect(),
            frame: MapFrame::Local,
            unit: "mm".into(),
        };
        let caption = "1 sigma in plan; the stroke upwards is 1 sigma in height.";
        page.figure("ellipses", plan_ellipses(&ellipses), caption);
    }
    if !planned.reliability.is_empty() {
        page.section(RELIABILITY).table(&plan_precision::table(&planned.reliability));
    }
    if !mistakes.is_empty() {
        page.section(MISTAKES).table(&plan_mistakes::table(mistakes));
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
