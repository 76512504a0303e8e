//! The report: every published table and figure beside ours, then the answers to what was left open.

mod answers;
mod block;
mod drift;
mod findings;
mod flaw;
mod focal;
mod homothety;
mod questions;
mod solvers;
mod tables;

pub use findings::{Finding, findings};
pub use questions::{Question, questions};

use super::results::Results;
use crate::effects::literature::STUDY;
use crate::report::html::Page;
use crate::report::tables::Table;
use crate::scenario::Simulation;
use anyhow::Result;

/// Makes the page from the results and the block that they begin from.
///
/// # Errors
/// A case of S0 to S4 that is missing or could not be adjusted.
pub fn page(results: &Results, simulation: &Simulation) -> Result<Page> {
    let mut page = Page::new("Calibration errors in a corridor block");
    page.subtitle("Published figures beside ours; every number and picture is made from the runs of this program.");
    page.paragraph(
        "An error-free block is simulated, and one known error is put into its image measurements or its start values. \
         The block is adjusted with tie points alone. A similarity from ten control points takes it into the survey's \
         system, where it is compared with 5000 check points. The block has the published counts, heights and camera. \
         Tilt, strip layout, terrain and the places of the points are not published, and are this program's own. So \
         millimetres can differ where geometry decides, while laws cannot.",
    );
    page.section("In short");
    page.table(&findings_table(&findings(results)?));
    let questions = questions(results)?;
    if !questions.is_empty() {
        page.table(&questions_table(&questions));
    }
    block::section(&mut page, results, simulation)?;
    focal::section(&mut page, results)?;
    homothety::section(&mut page, results)?;
    drift::section(&mut page, results, simulation)?;
    flaw::section(&mut page, results)?;
    answers::sections(&mut page, results)?;
    solvers::section(&mut page, results);
    page.section("Reference").list([STUDY.to_string()]);
    Ok(page)
}

/// The statements, and how they fare.
pub fn findings_table(findings: &[Finding]) -> Table {
    let mut table = (Table::new("Statements of the publication"))
        .text("statement", "")
        .text("published", "")
        .text("ours", "")
        .text("agrees", "");
    for finding in findings {
        let agrees = if finding.agrees { "yes" } else { "no" };
        table.row([finding.statement.as_str(), &finding.published, &finding.ours, agrees]);
    }
    table
}

fn questions_table(questions: &[Question]) -> Table {
    let mut table = (Table::new("What it left open")).text("question", "").text("ours", "");
    for question in questions {
        table.row([question.question.as_str(), &question.answer]);
    }
    table
}
