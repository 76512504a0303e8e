//! What `misclosure inject` did, for people and for programs.

use super::text::paragraph;
use crate::inject::Report;
use crate::inject::mistakes::Made;
use crate::report::numbers::significant;
use crate::report::tables::Table;
use serde_json::{Value, json};

/// What a block with an effect that was injected by its own formula proves, and what it does not.
const SHARED: &str = "was injected by its own formula, which the estimator has too. To find it again shows what the \
                      block can tell, not that the formula is true";

/// What errors did, for people.
pub fn errors_text(report: &Report) -> String {
    let mut table = Table::new("").text("error", "").text("parameters", "").text("drawn or derived", "");
    for applied in &report.applied {
        let list = |pairs: Vec<String>| pairs.join(", ");
        let parameters = applied.parameters.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let notes = applied.notes.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        table.row([applied.id.to_string(), list(parameters), list(notes)]);
    }
    let mut text = table.to_text();
    for applied in &report.applied {
        if let Some(whose) = &applied.shared_formula {
            text += "\n";
            text += &paragraph("", 0, &format!("`{}` {SHARED} ({whose})", applied.id));
        }
    }
    text += &format!(
        "\n{} measurements were computed again; their errors: {} px RMS per coordinate, at most {} px. (They replace \
         errors of {} px RMS.)\n",
        report.measurements,
        significant(report.change_rms_px, 3),
        significant(report.change_max_px, 3),
        significant(report.replaced_rms_px, 3),
    );
    for (what, change) in [("GNSS position", report.gnss_change_max_m), ("surveyed point", report.survey_change_max_m)]
    {
        if change > 0.0 {
            text += &format!("Largest error of a {what}: {} m\n", significant(change, 3));
        }
    }
    let dropped = &report.dropped;
    if dropped.total() > 0 {
        text += &format!(
            "Measurements left out: {} behind the camera, {} off the sensor, {} without a light path or an instant of \
             exposure, {} single ones\n",
            dropped.behind, dropped.off_sensor, dropped.no_solution, dropped.left_alone
        );
    }
    if !report.dropped_tie_points.is_empty() {
        text += &format!("Tie points that went with them: {}\n", report.dropped_tie_points.len());
    }
    text
}

/// What mistakes did, for people; `refused`: why the block cannot be read any more.
pub fn mistakes_text(made: &[Made], refused: Option<&str>) -> String {
    let mut table = Table::new("").text("mistake", "").text("parameters", "").text("chosen or derived", "");
    for mistake in made {
        let parameters: Vec<String> =
            mistake.parameters.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let notes: Vec<String> = mistake.notes.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        table.row([mistake.kind.to_string(), parameters.join(", "), notes.join(", ")]);
    }
    let mut text = format!("\n{}", table.to_text());
    if let Some(refused) = refused {
        text += "\n";
        text += &paragraph("", 0, &format!("With these mistakes no command reads the block: {refused}"));
    }
    text
}

/// One mistake, for programs.
pub fn mistake_json(made: &Made) -> Value {
    let parameters = made.parameters.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
    json!({ "mistake": made.kind, "parameters": pairs(parameters), "notes": pairs(made.notes.clone()) })
}

fn pairs(pairs: Vec<(String, String)>) -> Value {
    pairs.into_iter().map(|(name, value)| (name, Value::String(value))).collect::<serde_json::Map<_, _>>().into()
}

/// What errors did, for programs.
pub fn errors_json(report: &Report, seed: u64) -> Value {
    let errors = report.applied.iter().map(|applied| {
        let parameters = applied.parameters.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
        let mut error =
            json!({ "error": applied.id, "parameters": pairs(parameters), "notes": pairs(applied.notes.clone()) });
        if let Some(whose) = &applied.shared_formula {
            error["shared_formula"] = json!(format!("{SHARED} ({whose})"));
        }
        error
    });
    json!({
        "format": 1, "seed": seed, "errors": errors.collect::<Vec<_>>(), "measurements": report.measurements,
        "replaced_rms_px": report.replaced_rms_px, "change_rms_px": report.change_rms_px,
        "change_max_px": report.change_max_px,
        "gnss_change_max_m": report.gnss_change_max_m, "survey_change_max_m": report.survey_change_max_m,
        "dropped_measurements": report.dropped.total(), "dropped_tie_points": report.dropped_tie_points,
    })
}
