//! What can be wrong with a file, and where.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Longest text, in characters, that a message repeats from a file.
pub(super) const SHOWN_CHARACTERS: usize = 40;
/// Most names that a message lists.
const LISTED_NAMES: usize = 30;

/// A file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The content is wrong: what, where, and what was expected.
    #[error("{file}{place}: {problem}")]
    Content {
        /// File, as the user knows it.
        file: String,
        /// Where in the file.
        place: Place,
        /// What is wrong and what was expected.
        problem: String,
    },
    /// The system could not read it.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// File or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The system could not write it.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// File or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// Where in a file; lines and columns count from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line.
    Line(u64),
    /// A named column in a line of a table.
    Cell(u64, String),
    /// Line and character of a text.
    Character(u64, u64),
    /// Position in a file that is no text, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => Ok(()),
            Place::Line(line) => write!(f, ":{line}"),
            Place::Cell(line, column) => write!(f, ":{line}: column {column}"),
            Place::Character(line, column) => write!(f, ":{line}:{column}"),
            Place::Byte(byte) => write!(f, ": byte {byte}"),
        }
    }
}

impl Error {
    /// The same of a file in the folder `to`, where it names one in `from`: results are made in a temporary folder,
    /// which nobody knows.
    pub fn moved(self, from: &Path, to: &Path) -> Self {
        let place = |path: PathBuf| path.strip_prefix(from).map(|rest| to.join(rest)).unwrap_or(path);
        match self {
            Error::Content { file, place: at, problem } => {
                Error::Content { file: place(file.into()).display().to_string(), place: at, problem }
            }
            Error::Read { path, source } => Error::Read { path: place(path), source },
            Error::Write { path, source } => Error::Write { path: place(path), source },
        }
    }

    pub(super) fn content(file: impl Into<String>, place: Place, problem: impl Into<String>) -> Self {
        Error::Content { file: file.into(), place, problem: problem.into() }
    }
}

/// Text from a file as a message shows it: quoted, control characters escaped, cut when long.
pub(super) fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    match text.char_indices().nth(SHOWN_CHARACTERS) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// Names from a file as a message lists them.
pub(super) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let mut texts: Vec<String> = names.iter().take(LISTED_NAMES).map(|name| shown(name.as_ref().as_bytes())).collect();
    if names.len() > LISTED_NAMES {
        texts.push("...".to_owned());
    }
    texts.join(", ")
}

/// Advice on a name that is not among the known ones: the nearest of them when one is near, else all.
pub(super) fn advice(name: &str, known: &[&str]) -> String {
    // One slip of the finger per three characters still points at one key; more would be a guess.
    let tolerated = (name.chars().count() / 3).max(1);
    let steps: Vec<usize> = known.iter().map(|candidate| distance(name, candidate)).collect();
    let fewest = steps.iter().min().copied().unwrap_or(usize::MAX);
    if fewest > tolerated {
        return format!("known: {}", listed(known));
    }
    let nearest = known.iter().zip(&steps).filter(|(_, steps)| **steps == fewest);
    let nearest: Vec<String> = nearest.map(|(candidate, _)| format!("{candidate:?}")).collect();
    format!("did you mean {}?", nearest.join(" or "))
}

/// Number of characters to insert, delete, replace or swap with their neighbour between two words.
fn distance(a: &str, b: &str) -> usize {
    // A name as long as a file is far from every key; do not measure how far.
    if a.len() > 4 * SHOWN_CHARACTERS {
        return usize::MAX;
    }
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut steps = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            if i == 0 || j == 0 {
                steps[i][j] = i + j;
                continue;
            }
            let replace = steps[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            steps[i][j] = replace.min(steps[i - 1][j] + 1).min(steps[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                steps[i][j] = steps[i][j].min(steps[i - 2][j - 2] + 1);
            }
        }
    }
    steps[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_cut_and_control_characters_are_escaped() {
        assert_eq!(shown(b"a\nb"), r#""a\nb""#);
        assert_eq!(shown("é".repeat(50).as_bytes()), format!("{:?}...", "é".repeat(40)));
    }

    #[test]
    fn advice_names_a_near_key_and_lists_them_else() {
        assert_eq!(advice("widht_px", &["id", "width_px"]), "did you mean \"width_px\"?");
        assert_eq!(advice("k4", &["k1", "f", "k2"]), "did you mean \"k1\" or \"k2\"?");
        assert_eq!(advice("lens", &["id", "f"]), r#"known: "id", "f""#);
        assert_eq!(advice("csr", &["crs", "name"]), "did you mean \"crs\"?");
    }
}
