//! The results of a campaign as tables: one row a case, in the order of the plan, whoever worked it and when.

use super::folder::{Folder, State};
use super::{Candidate, Estimate, Outcome};
use crate::io::table::TableWriter;
use anyhow::Result;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Table of the cases.
pub const RESULTS: &str = "results.csv";
/// Table of the tests of the catalogue.
pub const CANDIDATES: &str = "candidates.csv";
/// Table of the sizes of what was named.
pub const ESTIMATES: &str = "estimates.csv";
/// What separates names in a cell.
const BETWEEN: &str = " ";

/// A case with what it gave.
#[derive(Debug, Clone)]
pub struct Row {
    /// Id.
    pub id: String,
    /// Names of the levels, by factor.
    pub factors: BTreeMap<String, String>,
    /// What a diagnosis should name.
    pub expected: Vec<String>,
    /// How it stands.
    pub state: State,
    /// `None` where it is not finished.
    pub outcome: Option<Outcome>,
}

/// All cases of a campaign, in the order of the plan.
///
/// # Errors
/// A result that cannot be read.
pub fn rows(folder: &Folder) -> Result<Vec<Row>> {
    let states = folder.states()?;
    let row = |(planned, state): (&super::grid::Planned, State)| {
        let outcome = if state == State::Done { folder.outcome(&planned.id)? } else { None };
        let expected = planned.case.get("expected").cloned().unwrap_or_default();
        let expected: Option<Vec<String>> = serde_json::from_value(expected)?;
        let (id, factors) = (planned.id.clone(), planned.factors.clone());
        Ok(Row { id, factors, expected: expected.unwrap_or_default(), state, outcome })
    };
    folder.cases.par_iter().zip(states).map(row).collect()
}

/// Writes the tables into `to`.
///
/// # Errors
/// A file that cannot be written.
pub fn write(rows: &[Row], to: &Path) -> Result<()> {
    let of_outcomes = || rows.iter().filter_map(|row| Some((row, row.outcome.as_ref()?)));
    let factors: Vec<&String> = rows.first().map_or_else(Vec::new, |row| row.factors.keys().collect());
    let figures: BTreeSet<&String> = of_outcomes().flat_map(|(_, outcome)| outcome.figures.keys()).collect();
    let own = ["state", "reason", "expected", "verdict", "named", "mistakes", "right"].map(String::from);
    let header: Vec<&str> = std::iter::once("id")
        .chain(factors.iter().map(|name| name.as_str()))
        .chain(own.iter().map(String::as_str))
        .chain(figures.iter().map(|name| name.as_str()))
        .collect();
    let mut table = TableWriter::create(&to.join(RESULTS), &header)?;
    for row in rows {
        table.text(&row.id);
        for factor in &factors {
            table.text(&row.factors[*factor]);
        }
        let (state, reason) = match &row.state {
            State::Done => ("done", ""),
            State::Failed(reason) => ("failed", reason.as_str()),
            State::Taken => ("taken", ""),
            State::Open => ("open", ""),
        };
        table.text(state).text(reason).text(&row.expected.join(BETWEEN));
        match &row.outcome {
            None => {
                table.text("").text("").text("").text("");
            }
            Some(own) => {
                let mistakes = own.mistakes.join("; ");
                table.text(&own.verdict).text(&own.named.join(BETWEEN)).text(&mistakes);
                table.text(if own.right { "true" } else { "false" });
            }
        }
        for figure in &figures {
            table.optional(row.outcome.as_ref().and_then(|own| own.figures.get(*figure).copied()));
        }
        table.end_row()?;
    }
    table.finish()?;
    let mut table = TableWriter::create(&to.join(CANDIDATES), &["id", "effect", "p_value"])?;
    for (row, outcome) in of_outcomes() {
        for Candidate { effect, p_value } in &outcome.candidates {
            table.text(&row.id).text(effect).number(*p_value);
            table.end_row()?;
        }
    }
    table.finish()?;
    let mut table = TableWriter::create(&to.join(ESTIMATES), &["id", "effect", "parameter", "value", "sigma", "unit"])?;
    for (row, outcome) in of_outcomes() {
        for Estimate { effect, parameter, value, sigma, unit } in &outcome.estimates {
            table.text(&row.id).text(effect).text(parameter).number(*value).number(*sigma).text(unit);
            table.end_row()?;
        }
    }
    Ok(table.finish()?)
}
