//! The falling curve: what each added effect did to data that the fit did not see.

use super::super::axes::Axis;
use super::NARROW;
use super::lines::{LineChart, Panel, Series, line_chart};

/// One model that was tried.
#[derive(Debug, Clone, Default)]
pub struct LedgerStep {
    /// What was added, such as "base" or "+ rolling-shutter".
    pub name: String,
    /// RMS of held-out measurements, px.
    pub heldout_px: f64,
    /// 3D RMS at check points, mm; `None` without check points, and where lengths mean nothing.
    pub check_mm: Option<f64>,
    /// Standard deviation of unit weight.
    pub sigma0: f64,
}

/// The steps, in order.
#[derive(Debug, Clone, Default)]
pub struct Ledger {
    /// Title.
    pub title: String,
    /// Models tried.
    pub steps: Vec<LedgerStep>,
    /// Lengths on the ground mean nothing: the block has no scale, or a mistake may have moved it.
    pub without_lengths: bool,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

/// Draws three panels over the same steps: held-out measurements, check points, sigma0. Every axis begins at zero, so
/// that a fall looks as large as it is.
pub fn ledger(ledger: &Ledger) -> String {
    let names = || ledger.steps.iter().enumerate().map(|(i, s)| format!("{i}  {}", s.name));
    let numbers = || (0..ledger.steps.len()).map(|i| i.to_string());
    let panel = |title: &str, unit: &str, values: Vec<(usize, f64)>| Panel {
        title: title.into(),
        x: Axis::named("", numbers()),
        y: Axis::new("", unit).from_zero(),
        series: vec![Series::new("", values.into_iter().map(|(i, v)| [i as f64, v]).collect())],
    };
    let each = |f: &dyn Fn(&LedgerStep) -> Option<f64>| {
        ledger.steps.iter().enumerate().filter_map(|(i, s)| f(s).map(|v| (i, v))).collect::<Vec<_>>()
    };
    let mut panels = vec![panel("Held-out measurements, RMS (px)", "px", each(&|s| Some(s.heldout_px)))];
    let check = each(&|s| s.check_mm);
    let check_points = !check.is_empty();
    let note = match (ledger.without_lengths, check_points) {
        (true, _) => "Check points are left out: without a scale, or beside a mistake, mm mean nothing.",
        (false, false) => "The block has no check points.",
        (false, true) => "Check points only watch: no decision uses them.",
    };
    if !check.is_empty() {
        panels.push(panel("Check points, 3D RMS (mm)", "mm", check));
    }
    panels.push(panel("Standard deviation of unit weight, sigma0", "", each(&|s| Some(s.sigma0))));
    // Where there is room for one, it is what judges from outside: the check points.
    if ledger.width.is_some_and(|width| width < NARROW) {
        panels.truncate(if check_points { 2 } else { 1 });
        panels = panels.pop().into_iter().collect();
        panels.iter_mut().for_each(|panel| panel.x = Axis::named("", numbers()));
        let (title, width) = (String::new(), ledger.width);
        return line_chart(&LineChart { title, panels, columns: 1, note: String::new(), width });
    }
    if let Some(last) = panels.last_mut() {
        last.x = Axis::named("", names());
    }
    line_chart(&LineChart { title: ledger.title.clone(), panels, columns: 1, note: note.into(), width: ledger.width })
}
