//! Do the solvers agree in every case?

use crate::report::html::Page;
use crate::report::numbers::{fixed, or_dash, significant};
use crate::report::tables::Table;
use crate::study::outcome::Outcome;
use crate::study::results::Results;

pub fn section(page: &mut Page, results: &Results) {
    page.section("The two solvers");
    let (mut agree, mut compared, mut alone, mut impossible) = (0, 0, 0, 0);
    let mut table = (Table::new("Every case"))
        .text("case", "")
        .text("steps", "")
        .text("seconds", "")
        .number("residuals", "px")
        .number("Jacobian", "relative")
        .number("parameters", "sigma")
        .text("agree", "");
    for (key, outcome) in results.iter() {
        let Outcome::Adjusted(case) = outcome else {
            impossible += 1;
            continue;
        };
        let list = |f: &dyn Fn(&crate::study::outcome::SolverRun) -> String| {
            case.solvers.iter().map(|solver| format!("{} {}", solver.name, f(solver))).collect::<Vec<_>>().join(", ")
        };
        let mut row = vec![key.to_string(), list(&|s| s.iterations.to_string()), list(&|s| fixed(s.seconds, 2))];
        match &case.agreement {
            Some(agreement) => {
                compared += 1;
                agree += usize::from(agreement.agree);
                row.extend([
                    significant(agreement.residual_max_px, 2),
                    significant(agreement.jacobian_max_rel, 2),
                    or_dash(agreement.parameter_max_sigma, |value| significant(value, 2)),
                    if agreement.agree { "yes".into() } else { format!("no: {}", agreement.worst_unknown) },
                ]);
            }
            None => alone += 1,
        }
        table.row(row);
    }
    page.paragraph(&format!(
        "{agree} of {compared} cases that both solvers adjusted agree: residuals and Jacobian at the same point, then \
         the solutions in units of their own sigma.{}{}",
        if alone > 0 { format!(" {alone} cases were adjusted by one solver alone.") } else { String::new() },
        if impossible > 0 { format!(" {impossible} cases cannot be adjusted.") } else { String::new() },
    ));
    page.details("Every case", |page| {
        page.table(&table);
    });
}
