//! NIST's sets, where their files are.

use super::beside::shared;
use misclosure::validate::nist::{NistOutcome, run, run_all, set};
use std::path::Path;

#[test]
fn eight_digits_on_every_set_that_counts() -> anyhow::Result<()> {
    let Some(folder) = shared("data/nist") else {
        return Ok(());
    };
    let outcomes = run_all(&folder)?;
    assert_eq!(outcomes.len(), 54);
    let missed: Vec<_> = outcomes.iter().filter(|outcome| outcome.counts() && !outcome.passes()).collect();
    // From the far start of MGH17 one of its two rates runs off to infinity, where there is a minimum of another sum of
    // squares.
    let (elsewhere, missed): (Vec<&NistOutcome>, Vec<&NistOutcome>) =
        missed.into_iter().partition(|outcome| outcome.other_minimum.is_some());
    assert!(missed.is_empty(), "{missed:#?}");
    assert!(elsewhere.iter().all(|outcome| outcome.set == "MGH17" && !outcome.near), "{elsewhere:#?}");
    // What cannot be judged by its file is judged by the published value, or not at all.
    for outcome in outcomes.iter().filter(|outcome| outcome.contradiction.is_some()) {
        assert_eq!(outcome.set, "Roszman1", "{outcome:?}");
    }
    let text = std::fs::read_to_string(folder.join("Roszman1.dat"))?.replace("1.20196866396E-0", "2.0196866396E-01");
    let published = set::parse(&text, "Roszman1.dat")?;
    for near in [false, true] {
        let outcome = run(&published, near);
        assert!(outcome.counts() && outcome.passes(), "{outcome:?}");
    }
    Ok(())
}

/// A set of the same form, made up.
const SET: &str = "NIST/ITL StRD
Dataset Name:  Misra1a           (Misra1a.dat)
               Lower Level of Difficulty
        Start 1     Start 2           Parameter     Standard Deviation
  b1 =   500         250           2.0E+02  1.0E+00
  b2 =     0.0001      0.0005      5.0E-04  1.0E-06

Residual Sum of Squares:                    0.0
Number of Observations:                             3

Data:   y               x
      1.0  77.6
      2.0  114.9
      3.0  141.1
";

#[test]
fn a_file_that_is_none_of_nists_is_refused_by_its_line() {
    assert_eq!(set::parse(SET, "file").expect("a set").rows.len(), 3);
    for (from, to, expected) in [
        ("Misra1a           (Misra1a.dat)", "", "`Dataset Name:`"),
        ("Lower Level", "No Level", "`Level of Difficulty`"),
        ("0.0005 ", "", "file, line 6: expected two starting values"),
        ("114.9", "many", "file, line 13: `many`, expected a number"),
        ("      3.0  141.1\n", "", "2 rows of data, 3 are stated"),
        ("  b1", "  c1", "`b1 = ...`"),
        ("3.0  141.1", "3.0", "file, line 14: 1 numbers"),
    ] {
        let error = set::parse(&SET.replacen(from, to, 1), "file").expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}");
    }
    assert!(set::read(Path::new("no/such/folder"), "Misra1a").is_err());
}
