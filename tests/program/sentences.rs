//! Sentences that a person reads have at most 25 words: texts of the program and of the laboratory's page, and the help
//! on its options.

use crate::imports::source::{Piece, files, pieces, root};
use std::fs;
use std::path::Path;

/// Words of a sentence, at most (CONTRIBUTING.md).
const MOST: usize = 25;

/// Sentences of a text, as their words. An empty line ends one, and so do both ends of a line that is set in: a row of
/// a list or an example.
fn sentences(text: &str) -> Vec<Vec<&str>> {
    let (mut found, mut open) = (vec![Vec::new()], false);
    for line in text.lines() {
        let whole = line.trim().is_empty() || line.starts_with("  ");
        if whole || open {
            found.push(Vec::new());
        }
        open = whole;
        for word in line.split_whitespace() {
            // A placeholder is a word; a dash or an arrow is none.
            let is_word = word.contains(|c: char| c.is_alphanumeric() || c == '{' || c == '$');
            found.last_mut().expect("one is open").extend(is_word.then_some(word));
            if word.trim_end_matches([')', '"', '\'', '`', '*']).ends_with(['.', '!', '?']) {
                found.push(Vec::new());
            }
        }
    }
    found
}

/// Texts of a source file outside of its tests, with their lines; `with_docs`: and documentation comments, each as one.
fn texts(source: &str, with_docs: bool) -> Vec<(String, usize)> {
    let source = source.split("#[cfg(test)]\nmod ").next().unwrap_or(source);
    let (mut found, mut last): (Vec<(String, usize)>, _) = (Vec::new(), None);
    for (piece, line) in pieces(source) {
        match piece {
            Piece::Text(text) => found.push((text, line)),
            Piece::Doc(text) if with_docs => match found.last_mut().filter(|_| last == Some(line - 1)) {
                Some((whole, _)) => *whole += &format!("\n{}", text.trim()),
                None => found.push((text.trim().into(), line)),
            },
            _ => continue,
        }
        last = with_docs.then_some(line);
    }
    found
}

/// Places and words of sentences that are too long.
fn too_long(file: &Path, source: &str) -> Vec<String> {
    let mut found = Vec::new();
    // Clap makes the help on an option from its documentation.
    for (text, line) in texts(source, file.starts_with("src/cli")) {
        for words in sentences(&text).into_iter().filter(|words| words.len() > MOST) {
            found.push(format!("{}:{line}: {} words: {}", file.display(), words.len(), words.join(" ")));
        }
    }
    found
}

#[test]
fn no_sentence_that_a_person_reads_is_too_long() {
    let is_test = |path: &Path| {
        path.components().any(|part| part.as_os_str() == "tests") || path.to_string_lossy().ends_with("tests.rs")
    };
    let page = files(&root().join("web"), "js")
        .into_iter()
        .filter(|path| !path.components().any(|part| part.as_os_str() == "vendor"));
    let (mut read, mut found) = (0, Vec::new());
    for path in files(&root().join("src"), "rs").into_iter().chain(page) {
        let file = path.strip_prefix(root()).expect("below the root");
        if !is_test(file) {
            let source = fs::read_to_string(&path).expect("readable source");
            read += texts(&source, false).len();
            found.extend(too_long(file, &source));
        }
    }
    assert!(read > 5000, "{read} texts: most were not seen");
    assert!(found.is_empty(), "sentences of more than {MOST} words:\n{}", found.join("\n"));
}

#[test]
fn a_long_sentence_is_seen_however_it_is_written() {
    let words = |count: usize| vec!["word"; count].join(" ");
    let (right, wrong) = (words(25), words(26));
    let long = |path: &str, source: String| too_long(Path::new(path), &source).len();
    for (file, source) in [
        ("src/a.rs", format!("fn f() {{ bail!(\"{wrong}\") }}")),
        ("src/a.rs", format!("fn f() {{ bail!(\"{right} \\\n        word\") }}")),
        ("src/a.rs", format!("fn f() {{ bail!(\"{right}\\n{{}}\") }}")),
        ("src/a.rs", format!("const C: char = '\"'; const T: &str = r#\"a \"b\". {wrong}\"#;")),
        ("src/cli/a.rs", format!("struct A {{\n    /// {right}\n    /// word\n    a: u8,\n}}")),
        ("web/a.js", format!("tell(`${{a}} {right}`)")),
    ] {
        assert_eq!(long(file, source.clone()), 1, "{source}");
    }
    for (file, source) in [
        ("src/a.rs", format!("fn f() {{ bail!(\"{right}. word - (word {words}) \\\n\n a.\") }}", words = words(22))),
        (
            "src/a.rs",
            format!("/// {wrong}\nfn f() {{}} // {wrong}\n#[cfg(test)]\nmod tests {{ const A: &str = \"{wrong}\"; }}"),
        ),
        ("src/cli/a.rs", format!("const HELP: &str = \"{right}\n  {right}\n  {right}\n\n{right}\";")),
        (
            "src/cli/a.rs",
            format!("struct A {{\n    /// {right}.\n    /// {right}\n    a: u8,\n    /// {right}\n    b: u8,\n}}"),
        ),
    ] {
        assert_eq!(long(file, source.clone()), 0, "{source}");
    }
}
