//! Precision and reliability of a plan, in words and as a table.

use super::super::text::paragraph;
use crate::plan::{OfChecks, Plan, Reliability};
use crate::report::numbers::significant;
use crate::report::tables::Table;

/// Heading of the table.
pub const RELIABILITY: &str = "Smallest single errors that it would show";

/// What points and measurements are worth.
pub fn text(planned: &Plan) -> String {
    let mut text = String::new();
    let ties = of_ties(planned);
    if !ties.is_empty() {
        text += &format!("\n{}\n", ties.join("\n"));
    }
    if let Some(check) = &planned.precision.check {
        text += &format!("\n{}", paragraph("", 0, &of_checks(check)));
    }
    if !planned.reliability.is_empty() {
        text += &format!("\n{}\n\n{}", RELIABILITY.to_uppercase(), table(&planned.reliability).to_text());
    }
    text
}

/// How precise tie points will be, and what keeps them from being more precise: sentences.
pub fn of_ties(planned: &Plan) -> Vec<String> {
    let precision = &planned.precision;
    let (Some(plan), Some(height)) = (precision.plan_m, precision.height_m) else { return Vec::new() };
    let mut sentences = vec![
        format!(
            "If nothing is wrong, tie points have standard deviations of {} mm in plan and {} mm in height (median).",
            short_mm(plan.typical),
            short_mm(height.typical)
        ),
        format!("95 % of them stay below {} mm and {} mm.", short_mm(plan.worst), short_mm(height.worst)),
    ];
    if let (Some(plan), Some(height)) = (&precision.plan_limits, &precision.height_limits) {
        sentences.push(format!(
            "With every camera known that would be {} mm and {} mm; with every pose known, too, {} mm and {} mm.",
            short_mm(plan.cameras_known_m),
            short_mm(height.cameras_known_m),
            short_mm(plan.rays_m),
            short_mm(height.rays_m)
        ));
    }
    sentences
}

/// What check points will show.
pub fn of_checks(check: &OfChecks) -> String {
    let mut text = format!(
        "Check points will differ from their survey by {} mm in plan and {} mm in height (RMS). Of the effects \
         that it can show, one moves points most: just not seen, it makes that {} mm and {} mm.",
        short_mm(check.plan_m.rms),
        short_mm(check.height_m.rms),
        short_mm(check.plan_unseen_m),
        short_mm(check.height_unseen_m)
    );
    let hidden = [short_mm(check.plan_hidden_m), short_mm(check.height_hidden_m)];
    if hidden != [short_mm(check.plan_m.rms), short_mm(check.height_m.rms)] {
        let [plan, height] = hidden;
        text += &format!(
            " Of the parameters that it cannot show, the worst at its typical size makes that {plan} mm and {height} \
             mm."
        );
    }
    if let (Some(dome), Some(reach)) = (check.dome_m, check.reach_m) {
        text += &format!(
            " Random errors alone bend the heights to a bowl or dome of {} mm (standard deviation) over {} m.",
            short_mm(dome),
            significant(reach, 2)
        );
    }
    text
}

/// Redundancy, internal and external reliability of each kind of measurement.
pub fn table(all: &[Reliability]) -> Table {
    let mut table = Table::new("")
        .text("measurement", "")
        .number("mean redundancy", "")
        .number("found from", "")
        .number("95 % from", "")
        .text("unit", "")
        .number("till then moves its point by", "mm")
        .number("unchecked", "");
    for own in all {
        let [typical, worst] = [own.internal.typical, own.internal.worst].map(|size| significant(size, 3));
        let (of, unit, unchecked) = (own.of.clone(), own.unit.clone(), own.unchecked.to_string());
        let redundancy = format!("{:.2}", own.redundancy);
        table.row([of, redundancy, typical, worst, unit, short_mm(own.external_m.typical), unchecked]);
    }
    table
}

/// Millimetres with two digits.
pub fn short_mm(metres: f64) -> String {
    significant(1e3 * metres, 2)
}
