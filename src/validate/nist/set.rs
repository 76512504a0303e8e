//! NIST's files of nonlinear regression: two starting points, certified values and data.

use std::fmt;
use std::path::{Path, PathBuf};

/// How hard NIST says that a set is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Difficulty {
    Lower,
    Average,
    Higher,
}

impl fmt::Display for Difficulty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Difficulty::Lower => "lower",
            Difficulty::Average => "average",
            Difficulty::Higher => "higher",
        })
    }
}

/// A set.
#[derive(Debug, Clone, PartialEq)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// How hard NIST says that it is.
    pub difficulty: Difficulty,
    /// The far and the near start.
    pub starts: [Vec<f64>; 2],
    /// Certified values.
    pub certified: Vec<f64>,
    /// Certified standard deviations, a posteriori.
    pub deviations: Vec<f64>,
    /// Certified sum of squares.
    pub sum_of_squares: f64,
    /// Rows: y, then the predictors.
    pub rows: Vec<Vec<f64>>,
}

/// A file that is none of NIST's.
#[derive(Debug, thiserror::Error)]
pub enum NistError {
    /// It cannot be read.
    #[error("{path}: cannot read")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// Something is missing or no number.
    #[error("{file}, line {line}: {problem}")]
    Content {
        /// The file.
        file: String,
        /// The line, from 1; 0 where the whole file lacks something.
        line: usize,
        /// What is wrong, and what was expected.
        problem: String,
    },
}

/// Reads the set `name` from `NAME.dat` in a folder.
///
/// # Errors
/// A file that cannot be read or is none of NIST's.
pub fn read(folder: &Path, name: &str) -> Result<Set, NistError> {
    let path = folder.join(format!("{name}.dat"));
    let text = crate::files::read_text(&path).map_err(|source| NistError::Read { path: path.clone(), source })?;
    parse(&text, &path.display().to_string())
}

/// Reads a set from the text of its file, whose name is for the messages.
///
/// # Errors
/// What is missing or no number, with its line.
pub fn parse(text: &str, file: &str) -> Result<Set, NistError> {
    let wrong = |line: usize, problem: String| NistError::Content { file: file.into(), line, problem };
    let lacks = |what: &str| wrong(0, format!("no {what}: this is no nonlinear set of NIST's"));
    let lines: Vec<&str> = text.lines().collect();
    let numbers = |line: usize, text: &str| -> Result<Vec<f64>, NistError> {
        let number = |word: &str| {
            let value: f64 = word.parse().map_err(|_| wrong(line + 1, format!("`{word}`, expected a number")))?;
            if value.is_finite() {
                Ok(value)
            } else {
                Err(wrong(line + 1, format!("`{word}`, expected a finite number")))
            }
        };
        text.split_whitespace().map(number).collect()
    };
    let name = lines.iter().find_map(|line| line.strip_prefix("Dataset Name:"));
    let name = name.and_then(|rest| rest.split_whitespace().next()).ok_or_else(|| lacks("`Dataset Name:`"))?;
    let difficulty = [("Lower", Difficulty::Lower), ("Average", Difficulty::Average), ("Higher", Difficulty::Higher)];
    let level = |line: &&str| line.trim().strip_suffix("Level of Difficulty").map(|word| word.trim().to_owned());
    let level = lines.iter().find_map(level).ok_or_else(|| lacks("`Level of Difficulty`"))?;
    let difficulty = difficulty.into_iter().find(|(word, _)| *word == level).map(|(_, difficulty)| difficulty);
    let difficulty = difficulty.ok_or_else(|| lacks("known `Level of Difficulty`"))?;
    let (mut starts, mut certified, mut deviations) = ([Vec::new(), Vec::new()], Vec::new(), Vec::new());
    for (k, line) in lines.iter().enumerate() {
        let Some((left, right)) = line.split_once('=') else { continue };
        // Rows of the table of parameters, `b1 = far near certified deviation`.
        if left.trim() != format!("b{}", certified.len() + 1) {
            continue;
        }
        let &[far, near, value, deviation] = numbers(k, right)?.as_slice() else {
            let problem = "expected two starting values, the certified one and its standard deviation";
            return Err(wrong(k + 1, problem.into()));
        };
        starts[0].push(far);
        starts[1].push(near);
        certified.push(value);
        deviations.push(deviation);
    }
    if certified.is_empty() {
        return Err(lacks("parameter `b1 = ...`"));
    }
    let stated = |label: &str| {
        let found = lines.iter().enumerate().find_map(|(k, line)| Some((k, line.trim().strip_prefix(label)?)));
        let (k, rest) = found.ok_or_else(|| lacks(&format!("`{label}`")))?;
        let first = numbers(k, rest)?.first().copied();
        first.ok_or_else(|| wrong(k + 1, format!("expected a number after `{label}`")))
    };
    let sum_of_squares = stated("Residual Sum of Squares:")?;
    let count = stated("Number of Observations:")?;
    let heading = lines.iter().rposition(|line| line.starts_with("Data:")).ok_or_else(|| lacks("`Data:`"))?;
    let mut rows = Vec::new();
    for (k, line) in lines.iter().enumerate().skip(heading + 1).filter(|(_, line)| !line.trim().is_empty()) {
        let row = numbers(k, line)?;
        if row.len() < 2 {
            return Err(wrong(k + 1, format!("{} numbers, expected y and its predictors", row.len())));
        }
        rows.push(row);
    }
    if rows.len() as f64 != count {
        return Err(wrong(0, format!("{} rows of data, {count} are stated", rows.len())));
    }
    Ok(Set { name: name.into(), difficulty, starts, certified, deviations, sum_of_squares, rows })
}
