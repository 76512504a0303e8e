//! The figures of the steps from the root to a node, as a curve and in words.

use crate::lab::state::Lab;
use crate::lab::tree::Figures;
use crate::report::figures::{Ledger, LedgerStep, ledger};
use crate::report::numbers::significant;
use anyhow::Result;

pub(super) fn draw_ledger(lab: &Lab, id: u32, width: Option<f64>) -> Result<String> {
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
    Ok(ledger(&Ledger { title: format!("From the root to step {id}"), steps, width, ..Ledger::default() }))
}

/// What became smaller or larger from one node to the next.
pub fn difference(before: &Figures, after: &Figures) -> String {
    let mm = |m: f64| if 1e3 * m >= 1.0 { format!("{:.1}", 1e3 * m) } else { significant(1e3 * m, 2) };
    let mut words = Vec::new();
    if let (Some(a), Some(b)) = (before.check_rms_m, after.check_rms_m) {
        words.push(format!("check points {} → {} mm", mm(a), mm(b)));
    }
    if let (Some(a), Some(b)) = (before.tie_rms_px, after.tie_rms_px) {
        words.push(format!("tie points {a:.3} → {b:.3} px"));
    }
    // What says nothing new is left out where it does not change.
    if let (Some(a), Some(b)) = (before.gnss_rms_m, after.gnss_rms_m)
        && (a - b).abs() > 0.01 * a
    {
        words.push(format!("GNSS {} → {} m", significant(a, 3), significant(b, 3)));
    }
    if let (Some(a), Some(b)) = (before.heldout_px, after.heldout_px) {
        words.push(format!("held out {a:.3} → {b:.3} px"));
    }
    words.join(", ")
}
