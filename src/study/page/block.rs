//! The block (table 1, figure 1) and S0.

use crate::report::figures::flights_plan_profile;
use crate::report::html::Page;
use crate::report::numbers::{fixed, mm, or_dash, px, significant};
use crate::report::pictures::flights_of_block;
use crate::report::tables::Table;
use crate::scenario::Simulation;
use crate::study::published;
use crate::study::results::Results;
use anyhow::Result;

pub fn section(page: &mut Page, results: &Results, simulation: &Simulation) -> Result<()> {
    let block = &simulation.block;
    page.section("The block, and S0");
    let mut table = (Table::new("Table 1: flights, published / ours"))
        .text("flight", "")
        .text("images", "")
        .text("height", "m")
        .text("strips", "")
        .text("ground pixel", "mm")
        .number("forward overlap", "%")
        .number("side overlap", "%");
    for (published, ours) in published::FLIGHTS.iter().zip(&simulation.report.flights) {
        let (name, images, height, strips, gsd) = *published;
        let centres = block.images.iter().filter(|image| block.flights[image.flight.index()] == ours.flight);
        let heights: Vec<f64> = centres.map(|image| image.pose.centre.z).collect();
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        let percent = |part: Option<f64>| or_dash(part, |part| fixed(100.0 * part, 0));
        table.row([
            name.to_string(),
            format!("{images} / {}", ours.images),
            format!("{height} / {}", fixed(mean, 1)),
            format!("{strips} / {}", ours.strips),
            format!("{gsd} / {}", mm(ours.gsd_m)),
            percent(ours.forward_overlap),
            percent(ours.side_overlap),
        ]);
    }
    table.note("Published are 80 % forward and 70 % side overlap, which these counts over 200 m cannot have.");
    page.table(&table);
    let plan = flights_of_block(block);
    page.figure("flights", flights_plan_profile(&plan), "Figure 1: the flights. Control and check points on the dike.");

    let s0 = results.adjusted("s0")?;
    let mut table = (Table::new("S0: the error-free block adjusted, everything free"))
        .text("", "")
        .number("reprojection RMS", "px")
        .number("check points RMS", "nm");
    let nanometres = |metres: f64| significant(1e9 * metres, 2);
    table.row(["published".into(), published::S0_REPROJECTION_PX.to_string(), nanometres(published::S0_CHECK_M)]);
    table.row(["ours".into(), px(s0.tie_rms_px), nanometres(s0.erroneous_marks.check.rms_m.xyz)]);
    page.table(&table);
    Ok(())
}
