//! Odd data: nothing, single values, long names.

use misclosure::report::figures::*;
use misclosure::report::html::Page;

pub fn draw(page: &mut Page) {
    page.section("Odd data");
    page.figure("odd-empty", histogram(&Histogram { title: "No data".into(), ..Histogram::default() }), "");
    let one = vec![
        Series::new("one value", vec![[3.0, 5510.094]]),
        Series::new("broken", vec![[1.0, f64::NAN], [2.0, 5510.1]]),
    ];
    let panels = vec![
        Panel { title: "A single value".into(), x: Axis::new("t", "s"), y: Axis::new("f", "px"), series: one },
        Panel { title: "Nothing".into(), ..Panel::default() },
    ];
    page.figure(
        "odd-lines",
        line_chart(&LineChart { title: "Single values and none".into(), panels, columns: 2, ..LineChart::default() }),
        "",
    );
    let names = [
        "nothing added",
        "+ rolling-shutter of the front camera",
        "+ focal-thermal with lag",
        "+ local-flaw",
        "+ lever-arm",
        "+ pp-drift",
        "+ gnss-drift",
    ];
    let steps = names.map(|n| LedgerStep { name: n.into(), heldout_px: 0.4, check_mm: None, sigma0: 1.2 }).to_vec();
    page.figure(
        "odd-ledger",
        ledger(&Ledger { title: "A ledger with long names and no check points".into(), steps, ..Ledger::default() }),
        "",
    );
}
