//! Residuals at points in plan: horizontal as arrows, signed values as strokes or dots.

use super::super::axes::drawable;
use super::super::numbers::significant;
use super::super::sheet::{Key, Sheet};
use super::super::style::{BLUE, CHOSEN, GREY, VERMILLION};
use super::super::svg::Stroke;
use super::plan::{MapFrame, Plan, WIDTH, map_width};
use super::vector_field::Arrow;
use super::{scale_entry, width_or};

/// Arrows more than this are thinned out, with a note: they would hide each other.
const MOST_ARROWS: usize = 900;
/// Largest default width of a picture: plan and height stand side by side.
const WIDEST: f64 = 620.0;
/// Length of the longest arrow where no scale is given, pixels.
const LONGEST: f64 = 42.0;

/// Horizontal residuals in plan.
#[derive(Debug, Clone, Default)]
pub struct PlanArrows {
    /// Title.
    pub title: String,
    /// Place X, Y in metres, and residual in `unit`.
    pub arrows: Vec<Arrow>,
    /// Tooltip of each point: its name and its values; empty if points have no names.
    pub names: Vec<String>,
    /// What the coordinates are.
    pub frame: MapFrame,
    /// Unit of the residuals.
    pub unit: String,
    /// Figure pixels per unit; `None` fits the longest arrow. Pictures to be compared share one.
    pub scale: Option<f64>,
    /// Per arrow, whether it stands out, the others dimmed; empty where none does.
    pub standing_out: Vec<bool>,
    /// Width of the picture, pixels; `None` is what the map needs. Text keeps its size.
    pub width: Option<f64>,
}

/// How a signed value is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SignedStyle {
    /// Arrows up (red) for positive, down (blue) for negative values.
    #[default]
    Strokes,
    /// Dots whose area is the value: filled red for positive, open blue for negative values.
    Dots,
}

/// A signed value at points in plan, such as the residual in height.
#[derive(Debug, Clone, Default)]
pub struct PlanSigned {
    /// Title.
    pub title: String,
    /// Place X, Y in metres, and value in `unit`.
    pub values: Vec<([f64; 2], f64)>,
    /// Tooltip of each point: its name and its values; empty if points have no names.
    pub names: Vec<String>,
    /// What the coordinates are.
    pub frame: MapFrame,
    /// Unit of the values.
    pub unit: String,
    /// Drawn as strokes or dots.
    pub style: SignedStyle,
    /// Figure pixels per unit; `None` fits the largest value. With dots, pixels of radius for a value of 1, growing
    /// with the square root. Pictures to be compared share one.
    pub scale: Option<f64>,
    /// Per value, whether it stands out, the others dimmed (strokes alone); empty where none does.
    pub standing_out: Vec<bool>,
    /// Width of the picture, pixels; `None` is what the map needs. Text keeps its size.
    pub width: Option<f64>,
}

impl PlanArrows {
    /// Figure pixels per unit at which the longest arrow has its usual length; `None` where all are zero.
    pub fn natural_scale(&self) -> Option<f64> {
        let all = self.arrows.iter().map(|(_, d)| d[0].hypot(d[1]));
        natural(all).map(|longest| LONGEST / longest)
    }
}

impl PlanSigned {
    /// The scale that fits the largest value; `None` where all are zero.
    pub fn natural_scale(&self) -> Option<f64> {
        let largest = natural(self.values.iter().map(|(_, v)| v.abs()))?;
        Some(match self.style {
            SignedStyle::Strokes => LONGEST / largest,
            SignedStyle::Dots => 9.0 / largest.sqrt(),
        })
    }
}

/// How many arrows a picture of this width has room for.
fn most_arrows(width: f64) -> usize {
    (MOST_ARROWS as f64 * (width / WIDTH).powi(2)).clamp(150.0, MOST_ARROWS as f64) as usize
}

fn name_of(names: &[String], k: usize) -> &str {
    names.get(k).map_or("", String::as_str)
}

fn natural(lengths: impl Iterator<Item = f64>) -> Option<f64> {
    lengths.filter(|v| drawable(*v) && *v > 1e-140).reduce(f64::max)
}

fn chosen(given: Option<f64>, natural: Option<f64>) -> Option<f64> {
    given.filter(|s| drawable(*s) && *s > 0.0).or(natural)
}

/// Draws horizontal residuals as arrows in plan.
pub fn residuals_plan_arrows(plan: &PlanArrows) -> String {
    let width = width_or(plan.width, map_width(plan.arrows.iter().map(|(place, _)| *place), WIDEST));
    let mut sheet = Sheet::new(&plan.title, width);
    let whole = |(p, d): &Arrow| p.iter().chain(d).all(|v| drawable(*v));
    let kept: Vec<usize> = (0..plan.arrows.len()).filter(|k| whole(&plan.arrows[*k])).collect();
    let good: Vec<&Arrow> = kept.iter().map(|k| &plan.arrows[*k]).collect();
    sheet.left_out(plan.arrows.len() - good.len(), "not finite");
    let scale = chosen(plan.scale, plan.natural_scale());
    sheet.svg.scaled(scale);
    sheet.legend(&scale.map(|s| scale_entry(s, &plan.unit)).into_iter().collect::<Vec<_>>());
    let Some(map) = Plan::fit(plan.frame, good.iter().map(|a| a.0), width, sheet.y + 4.0, LONGEST) else {
        return sheet.finish_empty();
    };
    sheet.y = map.draw(&mut sheet.svg);
    let places: Vec<[f64; 2]> = good.iter().map(|a| a.0).collect();
    let drawn = map.thinned(&places, most_arrows(width));
    let out = |k: usize| plan.standing_out.get(kept[k]).copied();
    for (wanted, colour, width) in [(Some(false), GREY, 0.8), (None, BLUE, 1.2), (Some(true), CHOSEN, 1.6)] {
        let arrows = drawn.iter().filter(|k| out(**k) == wanted).map(|k| {
            let (at, by) = good[*k];
            let (from, by) = (map.px(*at), map.direction(*by, scale.unwrap_or(0.0)));
            (map.frame.arrow(from, [from[0] + by[0], from[1] + by[1]]), name_of(&plan.names, kept[*k]))
        });
        sheet.svg.named_paths(arrows, Stroke::new(colour, width));
    }
    remarks(&mut sheet, [drawn.len(), good.len()], scale);
    sheet.finish()
}

/// Draws signed values in plan: red and up for positive, blue and down for negative.
pub fn residuals_plan_signed(plan: &PlanSigned) -> String {
    let width = width_or(plan.width, map_width(plan.values.iter().map(|(place, _)| *place), WIDEST));
    let mut sheet = Sheet::new(&plan.title, width);
    let whole = |(p, v): &([f64; 2], f64)| p.iter().all(|v| drawable(*v)) && drawable(*v);
    let kept: Vec<usize> = (0..plan.values.len()).filter(|k| whole(&plan.values[*k])).collect();
    let good: Vec<&([f64; 2], f64)> = kept.iter().map(|k| &plan.values[*k]).collect();
    sheet.left_out(plan.values.len() - good.len(), "not finite");
    let scale = chosen(plan.scale, plan.natural_scale());
    sheet.svg.scaled(scale);
    sheet.legend(&signed_legend(plan, scale));
    let Some(map) = Plan::fit(plan.frame, good.iter().map(|a| a.0), width, sheet.y + 4.0, LONGEST) else {
        return sheet.finish_empty();
    };
    sheet.y = map.draw(&mut sheet.svg);
    let places: Vec<[f64; 2]> = good.iter().map(|a| a.0).collect();
    let drawn = map.thinned(&places, most_arrows(width));
    let s = scale.unwrap_or(0.0);
    match plan.style {
        SignedStyle::Strokes => {
            // What is dimmed lies under what stands out; signs keep their direction.
            let dimmed = |k: usize| plan.standing_out.get(kept[k]) == Some(&false);
            let plain = if plan.standing_out.is_empty() { 1.2 } else { 1.8 };
            let positive = |k: usize| good[k].1 >= 0.0;
            let mut strokes = |wanted: &dyn Fn(usize) -> bool, colour, width| {
                let arrows = drawn.iter().filter(|k| wanted(**k)).map(|k| {
                    let (at, v) = good[*k];
                    let from = map.px(*at);
                    (map.frame.arrow(from, [from[0], from[1] - s * v]), name_of(&plan.names, kept[*k]))
                });
                sheet.svg.named_paths(arrows, Stroke::new(colour, width));
            };
            strokes(&|k| dimmed(k), GREY, 0.8);
            strokes(&|k| !dimmed(k) && positive(k), VERMILLION, plain);
            strokes(&|k| !dimmed(k) && !positive(k), BLUE, plain);
        }
        SignedStyle::Dots => {
            // Large ones first, so that small ones stay visible.
            let mut order: Vec<_> = drawn.iter().map(|k| good[*k]).collect();
            order.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            for (at, v) in order {
                let at = map.px(*at);
                dot(&mut sheet, at, s * v.abs().sqrt(), *v >= 0.0);
            }
        }
    }
    remarks(&mut sheet, [drawn.len(), good.len()], scale);
    sheet.finish()
}

fn dot(sheet: &mut Sheet, [x, y]: [f64; 2], radius: f64, positive: bool) {
    if positive {
        sheet.svg.dots(&[[x, y]], 2.0 * radius.max(0.4), VERMILLION);
    } else {
        // An open ring: a white disc inside a blue one.
        sheet.svg.dots(&[[x, y]], 2.0 * radius.max(0.4), BLUE);
        sheet.svg.dots(&[[x, y]], (2.0 * radius - 3.0).max(0.0), "#FFFFFF");
    }
}

fn signed_legend(plan: &PlanSigned, scale: Option<f64>) -> Vec<(Key, String)> {
    let unit = &plan.unit;
    let mut entries = Vec::new();
    match plan.style {
        SignedStyle::Strokes => {
            entries.push((Key::Upright { colour: VERMILLION.into(), up: true }, "positive (up)".into()));
            entries.push((Key::Upright { colour: BLUE.into(), up: false }, "negative (down)".into()));
            entries.extend(scale.map(|s| scale_entry(s, unit)));
        }
        SignedStyle::Dots => {
            // A dot of radius 9 is the largest with the natural scale.
            let largest = scale.map(|s| significant((9.0 / s).powi(2), 2));
            let text = largest.map_or(String::new(), |v| format!(", this size = {v} {unit}"));
            entries.push((Key::Disc { colour: VERMILLION.into(), open: false }, format!("positive{text}")));
            entries.push((
                Key::Disc { colour: BLUE.into(), open: true },
                format!("negative{}", text.replace("= ", "= −")),
            ));
        }
    }
    entries
}

fn remarks(sheet: &mut Sheet, [drawn, n]: [usize; 2], scale: Option<f64>) {
    if scale.is_none() {
        sheet.note("All residuals are zero.");
    }
    if drawn < n {
        sheet.note(format!("{drawn} of {n} points are drawn, evenly spread, so that they stay apart."));
    }
}
