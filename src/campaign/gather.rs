//! The results of a campaign as tables: one row a case, in the order of the plan. Neither the worker nor
//! the time of the work changes them.

use super::folder::{Folder, State};
use super::frame::Frame;
use super::{Candidate, Estimate, Outcome};
use anyhow::Result;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

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

/// The tables, by the name of their file without its ending.
pub fn tables(rows: &[Row]) -> [(&'static str, Frame); 3] {
    let of_outcomes = || rows.iter().filter_map(|row| Some((row, row.outcome.as_ref()?)));
    let factors: Vec<&String> = rows.first().map_or_else(Vec::new, |row| row.factors.keys().collect());
    let names: BTreeSet<&String> = of_outcomes().flat_map(|(_, outcome)| outcome.figures.keys()).collect();
    let text = |of: &dyn Fn(&Row) -> String| rows.iter().map(of).collect::<Vec<_>>().into_iter();
    let said = |of: &dyn Fn(&Outcome) -> String| {
        rows.iter().map(|row| row.outcome.as_ref().map_or_else(String::new, of)).collect::<Vec<_>>().into_iter()
    };
    let mut results = Frame::default().text("id", text(&|row| row.id.clone()));
    for factor in factors {
        results = results.text(factor, text(&|row| row.factors[factor].clone()));
    }
    let state = |row: &Row| match row.state {
        State::Done => "done",
        State::Failed(_) => "failed",
        State::Taken => "taken",
        State::Open => "open",
    };
    let reason = |row: &Row| if let State::Failed(reason) = &row.state { reason.clone() } else { String::new() };
    results = results
        .text("state", text(&|row| state(row).into()))
        .text("reason", text(&reason))
        .text("expected", text(&|row| row.expected.join(BETWEEN)))
        .text("verdict", said(&|own| own.verdict.clone()))
        .text("named", said(&|own| own.named.join(BETWEEN)))
        .text("mistakes", said(&|own| own.mistakes.join("; ")))
        .flags("right", rows.iter().map(|row| Some(row.outcome.as_ref()?.right)));
    for name in names {
        let figure = |row: &Row| row.outcome.as_ref()?.figures.get(name).copied();
        results = results.numbers(name, rows.iter().map(figure));
    }
    let tests: Vec<(&Row, &Candidate)> =
        of_outcomes().flat_map(|(row, own)| own.candidates.iter().map(move |test| (row, test))).collect();
    let candidates = Frame::default()
        .text("id", tests.iter().map(|(row, _)| row.id.clone()))
        .text("effect", tests.iter().map(|(_, own)| own.effect.clone()))
        .numbers("p_value", tests.iter().map(|(_, own)| Some(own.p_value)));
    let sizes: Vec<(&Row, &Estimate)> =
        of_outcomes().flat_map(|(row, own)| own.estimates.iter().map(move |size| (row, size))).collect();
    let estimates = Frame::default()
        .text("id", sizes.iter().map(|(row, _)| row.id.clone()))
        .text("effect", sizes.iter().map(|(_, own)| own.effect.clone()))
        .text("parameter", sizes.iter().map(|(_, own)| own.parameter.clone()))
        .numbers("value", sizes.iter().map(|(_, own)| Some(own.value)))
        .numbers("sigma", sizes.iter().map(|(_, own)| Some(own.sigma)))
        .text("unit", sizes.iter().map(|(_, own)| own.unit.clone()));
    [("results", results), ("candidates", candidates), ("estimates", estimates)]
}

/// Writes the tables into `to`, as CSV and with `parquet` also as Parquet.
///
/// # Errors
/// A file that cannot be written.
pub fn write(rows: &[Row], to: &Path, parquet: bool) -> Result<()> {
    for (name, frame) in tables(rows) {
        frame.write_csv(&to.join(format!("{name}.csv")))?;
        if parquet {
            frame.write_parquet(&to.join(format!("{name}.parquet")))?;
        }
    }
    Ok(())
}
