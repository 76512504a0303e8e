//! Figures: plain data in, an SVG text out.
//!
//! Every function is pure and deterministic (same data, same bytes) and never panics. Values that cannot be drawn (not
//! finite, or not positive on a log axis) are left out and counted in a note on the figure itself; a figure without
//! any data says "no data". Legends and scale arrows stand above the plot, never over it.
//!
//! | function | shows |
//! |---|---|
//! | [`vector_field`] | displacements over the sensor |
//! | [`heat_map`] | a grid of values, over the sensor or of a spectrum |
//! | [`flights_plan_profile`] | images by flight, control and check points |
//! | [`residuals_plan_arrows`], [`residuals_plan_signed`] | residuals at points in plan |
//! | [`line_chart`], [`ledger`] | series in panels; the falling curve of a ledger |
//! | [`profile`] | mean and sigma in bins, over a cloud of single values |
//! | [`histogram`] | distributions |
//! | [`image_bars`] | one value per image, by flight |
//! | [`plan_ellipses`] | error ellipses in plan |
//! | [`correlation_matrix`] | which candidates look alike, and which parameters |

mod correlation;
mod ellipses;
mod flights;
mod heat_map;
mod histogram;
mod image_bars;
mod ledger;
mod lines;
mod plan;
mod residuals;
mod vector_field;

pub use super::axes::Axis;
pub use correlation::{CorrelationMatrix, correlation_matrix};
pub use ellipses::{PlanEllipses, plan_ellipses};
pub use flights::{FlightPlan, Station, flights_plan_profile};
pub use heat_map::{Colours, HeatMap, heat_map};
pub use histogram::{Histogram, Sample, histogram};
pub use image_bars::{ImageBar, ImageBars, image_bars};
pub use ledger::{Ledger, LedgerStep, ledger};
pub use lines::{BinnedProfile, LineChart, LineStyle, Panel, Series, line_chart, profile};
pub use plan::{MapFrame, map_width};
pub use residuals::{PlanArrows, PlanSigned, SignedStyle, residuals_plan_arrows, residuals_plan_signed};
pub use vector_field::{Arrow, ArrowSet, Cell, VectorField, vector_field};

#[cfg(test)]
mod tests;

use super::axes::round_below;
use super::sheet::Key;

/// Name of a flight; its number, counted from one, where it has no name.
fn flight_name(names: &[String], flight: usize) -> String {
    names.get(flight).cloned().unwrap_or_else(|| format!("flight {}", flight.saturating_add(1)))
}

/// Width of a picture that was asked for, or that of a page.
fn width_or(wanted: Option<f64>, usual: f64) -> f64 {
    wanted.filter(|width| width.is_finite()).map_or(usual, |width| width.clamp(NARROWEST, WIDEST))
}

/// Height of a plotting area that is `usual` on a page: a picture of a width that was asked for is no tower.
fn height_at(wanted: Option<f64>, usual: f64) -> f64 {
    let share = |width: f64| if width < NARROW { 0.6 } else { 0.36 };
    wanted.filter(|width| width.is_finite()).map_or(usual, |width| usual.min((share(width) * width).max(LOWEST)))
}

/// Width below which a picture has one panel, with little beside it.
const NARROW: f64 = 400.0;
/// Least height of a plotting area.
const LOWEST: f64 = 110.0;

/// Widths between which axes have room and numbers stay near.
const NARROWEST: f64 = 240.0;
const WIDEST: f64 = 2400.0;

/// Legend entry of a scale arrow: a round length near 60 pixels at `scale` pixels per unit.
fn scale_entry(scale: f64, unit: &str) -> (Key, String) {
    let value = round_below(75.0 / scale);
    let text = super::numbers::significant(value, 1);
    let key = Key::Arrow { colour: super::style::INK.into(), dashed: false, length: value * scale };
    (key, format!("= {text} {unit}"))
}
