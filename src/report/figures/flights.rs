//! Plan and profile of the flights.

use super::super::axes::{Axis, drawable, extent};
use super::super::frame::PlotFrame;
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet};
use super::super::style::{INK, Marker, VERMILLION, series_colour, series_marker};
use super::plan::{MapFrame, Plan, WIDTH};
use super::{flight_name, width_or};
use std::collections::BTreeSet;

/// One image.
#[derive(Debug, Clone, Default)]
pub struct Station {
    /// Projection centre X, Y, Z, metres.
    pub position_m: [f64; 3],
    /// Index into [`FlightPlan::flights`].
    pub flight: usize,
    /// What others stand out from: pale.
    pub dimmed: bool,
    /// Name, shown as a tooltip; may be empty.
    pub name: String,
}

/// The flights of a block.
#[derive(Debug, Clone, Default)]
pub struct FlightPlan {
    /// Title.
    pub title: String,
    /// Names of the flights.
    pub flights: Vec<String>,
    /// Images.
    pub images: Vec<Station>,
    /// Control points, metres.
    pub control_m: Vec<[f64; 3]>,
    /// Check points, metres.
    pub check_m: Vec<[f64; 3]>,
    /// Names of the control points; empty where they have none.
    pub control_names: Vec<String>,
    /// What the coordinates are.
    pub frame: MapFrame,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

/// Draws the projection centres, coloured by flight, and the control and check points: from above, and from the side
/// that shows the block's length.
pub fn flights_plan_profile(plan: &FlightPlan) -> String {
    let width = width_or(plan.width, WIDTH);
    let mut sheet = Sheet::new(&plan.title, width);
    let whole = |p: &[f64; 3]| p.iter().all(|v| drawable(*v));
    let images: Vec<&Station> = plan.images.iter().filter(|s| whole(&s.position_m)).collect();
    let numbered = plan.control_m.iter().enumerate().filter(|(_, p)| whole(p));
    let control: Vec<([f64; 3], &str)> =
        numbered.map(|(k, p)| (*p, plan.control_names.get(k).map_or("", String::as_str))).collect();
    let check: Vec<[f64; 3]> = plan.check_m.iter().copied().filter(whole).collect();
    let total = plan.images.len() + plan.control_m.len() + plan.check_m.len();
    sheet.left_out(total - images.len() - control.len() - check.len(), "not finite");

    let flights: BTreeSet<usize> = images.iter().map(|s| s.flight).chain(0..plan.flights.len()).collect();
    let mut entries: Vec<(Key, String)> = flights
        .into_iter()
        .map(|f| {
            let n = images.iter().filter(|s| s.flight == f).count();
            let name = flight_name(&plan.flights, f);
            let key = Key::Point { colour: series_colour(f).into(), marker: series_marker(f) };
            (key, format!("{name}: {n} images"))
        })
        .collect();
    if !control.is_empty() {
        entries.push((Key::Point { colour: INK.into(), marker: CONTROL }, format!("control: {}", control.len())));
    }
    if !check.is_empty() {
        entries
            .push((Key::Point { colour: "#A0A0A0".into(), marker: Marker::Circle }, format!("check: {}", check.len())));
    }
    sheet.legend(&entries);

    let control_m = control.iter().map(|(p, _)| *p);
    let all = images.iter().map(|s| s.position_m).chain(control_m).chain(check.iter().copied());
    let top = sheet.y + 4.0;
    let Some(map) = Plan::fit(plan.frame, all.clone().map(|p| [p[0], p[1]]), width, top, 14.0) else {
        return sheet.finish_empty();
    };
    sheet.y = map.draw(&mut sheet.svg);
    draw_points(&mut sheet, &images, &control, &check, |p| map.px([p[0], p[1]]));

    // The profile looks across the longer side of the block.
    let (height, top) = (Axis::new("Z", "m"), sheet.y + 14.0);
    let span = |k: usize| extent(all.clone().map(|p| p[k])).map_or(0.0, |[low, high]| high - low);
    let k = usize::from(span(1) > span(0));
    let along = if k == 1 { &map.across } else { &map.along };
    let vertical = Scale::fit(&height, extent(all.clone().map(|p| p[2])), top + PROFILE, top);
    let horizontal = Scale::fit(along, extent(all.map(|p| p[k])), 0.0, 1.0);
    if let (Some(x), Some(y)) = (horizontal, vertical) {
        let left = PlotFrame { x, y }.margin(along, &height, width).left + 8.0;
        let frame = PlotFrame { x: x.on(left, width - 20.0), y };
        frame.draw(&mut sheet.svg, along, &height);
        draw_points(&mut sheet, &images, &control, &check, |p| frame.px([p[k], p[2]]));
        sheet.y = top + PROFILE + frame.margin(along, &height, width).bottom;
        let ratio = (frame.y.px(0.0) - frame.y.px(1.0)) / (frame.x.px(1.0) - frame.x.px(0.0));
        sheet.note(format!(
            "Above: plan. Below: profile along {}, heights drawn at {} times the scale of the length.",
            along.label,
            super::super::numbers::significant(ratio, 2)
        ));
    }
    sheet.finish()
}

const CONTROL: Marker = Marker::Triangle;
/// Height of the profile, pixels.
const PROFILE: f64 = 200.0;

fn draw_points(
    sheet: &mut Sheet,
    images: &[&Station],
    control: &[([f64; 3], &str)],
    check: &[[f64; 3]],
    px: impl Fn([f64; 3]) -> [f64; 2],
) {
    let dots: Vec<[f64; 2]> = check.iter().map(|p| px(*p)).collect();
    sheet.svg.dots(&dots, 1.6, "#A0A0A0");
    for s in images {
        let colour = if s.dimmed { "#BDBDBD" } else { series_colour(s.flight) };
        sheet.svg.named(&s.name, |svg| svg.marker(px(s.position_m), series_marker(s.flight), 3.6, colour));
    }
    for (p, name) in control {
        sheet.svg.named(name, |svg| {
            svg.marker(px(*p), CONTROL, 6.5, VERMILLION);
            svg.marker(px(*p), CONTROL, 5.0, INK);
        });
    }
}
