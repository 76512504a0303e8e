//! Rust files, and what they import, read from their text.

use std::fs;
use std::path::{Path, PathBuf};

pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folder` with extension `extension`, sorted.
pub fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<PathBuf> = Vec::new();
    for path in entries.map(|entry| entry.expect("readable folder").path()) {
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// A piece of source.
#[derive(Debug, PartialEq)]
pub enum Piece {
    /// An identifier, `::` or a single punctuation character.
    Code(String),
    /// What a text literal stands for; of an escape the character alone.
    Text(String),
    /// A line of a documentation comment.
    Doc(String),
}

/// Identifiers, `::` and single punctuation characters of Rust source, each with its line; comments and literals are
/// left out.
pub fn tokens(source: &str) -> Vec<(String, usize)> {
    let code = |(piece, line)| match piece {
        Piece::Code(text) => Some((text, line)),
        _ => None,
    };
    pieces(source).into_iter().filter_map(code).collect()
}

/// The text between two quotes: of an escaped line break nothing, of another escape its character or a line break.
fn unescaped(inner: &[char]) -> String {
    let (mut text, mut chars) = (String::new(), inner.iter().copied().peekable());
    while let Some(c) = chars.next() {
        match (c, (c == '\\').then(|| chars.next()).flatten()) {
            (_, Some('n')) => text.push('\n'),
            (_, Some('\n')) => while chars.next_if(|c| c.is_whitespace()).is_some() {},
            (_, escaped) => text.push(escaped.unwrap_or(c)),
        }
    }
    text
}

/// Pieces of Rust source, each with the line where it begins. Texts between backticks are those of JavaScript.
pub fn pieces(source: &str) -> Vec<(Piece, usize)> {
    let chars: Vec<char> = source.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut i, mut line, mut found) = (0, 1, Vec::new());
    while i < chars.len() {
        let start = i;
        match chars[i] {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && chars[i] != '\n' {
                    i += 1;
                }
                if at(start + 2) == '/' {
                    found.push((Piece::Doc(chars[start + 3..i].iter().collect()), line));
                }
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 0;
                loop {
                    if at(i) == '/' && at(i + 1) == '*' {
                        (depth, i) = (depth + 1, i + 2);
                    } else if at(i) == '*' && at(i + 1) == '/' {
                        (depth, i) = (depth - 1, i + 2);
                    } else {
                        i += 1;
                    }
                    if depth == 0 || i >= chars.len() {
                        break;
                    }
                }
            }
            'r' | 'b' | 'c' if raw_string_hashes(&chars, i).is_some() => {
                let (open, hashes) = raw_string_hashes(&chars, i).expect("just seen");
                let mut end = String::from("\"");
                end.extend(std::iter::repeat_n('#', hashes));
                let end: Vec<char> = end.chars().collect();
                i = open + 1;
                while i < chars.len() && !chars[i..].starts_with(&end) {
                    i += 1;
                }
                found.push((Piece::Text(chars[open + 1..i].iter().collect()), line));
                i += end.len();
            }
            quote @ ('"' | '`') => {
                i += 1;
                while i < chars.len() && chars[i] != quote {
                    i += if chars[i] == '\\' { 2 } else { 1 };
                }
                i = i.min(chars.len());
                found.push((Piece::Text(unescaped(&chars[start + 1..i])), line));
                i += 1;
            }
            // A character literal; otherwise the apostrophe begins a lifetime.
            '\'' if at(i + 1) == '\\' || at(i + 2) == '\'' => {
                i += if at(i + 1) == '\\' { 3 } else { 2 };
                while i < chars.len() && chars[i] != '\'' {
                    i += 1;
                }
                i += 1;
            }
            ':' if at(i + 1) == ':' => {
                found.push((Piece::Code("::".into()), line));
                i += 2;
            }
            c if word(c) => {
                while word(at(i)) {
                    i += 1;
                }
                found.push((Piece::Code(chars[start..i].iter().collect()), line));
            }
            c => {
                if !c.is_whitespace() {
                    found.push((Piece::Code(c.into()), line));
                }
                i += 1;
            }
        }
        i = i.min(chars.len());
        line += chars[start..i].iter().filter(|c| **c == '\n').count();
    }
    found
}

/// Position of the opening quote and number of hashes, where a raw string begins at `i`.
fn raw_string_hashes(chars: &[char], i: usize) -> Option<(usize, usize)> {
    if i > 0 && (chars[i - 1].is_alphanumeric() || chars[i - 1] == '_') {
        return None;
    }
    let mut k = i;
    if matches!(chars.get(k), Some('b' | 'c')) {
        k += 1;
    }
    if chars.get(k) != Some(&'r') {
        return None;
    }
    k += 1;
    let hashes = chars[k..].iter().take_while(|c| **c == '#').count();
    (chars.get(k + hashes) == Some(&'"')).then_some((k + hashes, hashes))
}

/// A path of ours that a file names, from the crate's root.
#[derive(Debug, PartialEq)]
pub struct Import {
    pub path: Vec<String>,
    pub line: usize,
    /// Inside an inline `#[cfg(test)] mod`.
    pub in_test: bool,
}

/// Every `crate::`, `misclosure::` and `super::` path of a file whose module is `module`.
pub fn imports(source: &str, module: &[String]) -> Vec<Import> {
    let tokens = tokens(source);
    let text = |i: usize| tokens.get(i).map_or("", |(text, _)| text.as_str());
    let mut found = Vec::new();
    // Inline modules that are open: name, brace depth inside, for tests only.
    let mut open: Vec<(String, usize, bool)> = Vec::new();
    let mut depth = 0;
    for i in 0..tokens.len() {
        match text(i) {
            "{" => depth += 1,
            "}" => {
                depth -= 1;
                open.retain(|(_, inside, _)| *inside <= depth);
            }
            "mod" if text(i + 2) == "{" => {
                let test = (i >= 7) && (i - 7..i).map(text).eq(["#", "[", "cfg", "(", "test", ")", "]"]);
                open.push((text(i + 1).into(), depth + 1, test));
            }
            start @ ("crate" | "misclosure" | "super") if text(i + 1) == "::" && (i == 0 || text(i - 1) != "::") => {
                let mut base = Vec::new();
                let mut next = i + 2;
                if start == "super" {
                    base = module.iter().chain(open.iter().map(|(name, ..)| name)).cloned().collect();
                    base.pop();
                    while text(next) == "super" {
                        base.pop();
                        next += 2;
                    }
                }
                let in_test = open.iter().any(|(.., test)| *test);
                for path in use_tree(&tokens, &mut next) {
                    let path = base.iter().cloned().chain(path).collect();
                    found.push(Import { path, line: tokens[i].1, in_test });
                }
            }
            _ => {}
        }
    }
    found
}

/// The paths of `a::b`, `a::{b, c::d}` and the like from `tokens[*next]` on.
fn use_tree(tokens: &[(String, usize)], next: &mut usize) -> Vec<Vec<String>> {
    let text = |i: usize| tokens.get(i).map_or("", |(text, _)| text.as_str());
    if text(*next) != "{" {
        let head = text(*next).to_string();
        *next += 1;
        if text(*next) != "::" {
            return vec![vec![head]];
        }
        *next += 1;
        let tails = use_tree(tokens, next);
        return tails.into_iter().map(|tail| std::iter::once(head.clone()).chain(tail).collect()).collect();
    }
    let mut found = Vec::new();
    *next += 1;
    while !matches!(text(*next), "}" | "") {
        found.extend(use_tree(tokens, next));
        // Over `as name` and the comma.
        while !matches!(text(*next), "," | "}" | "") {
            *next += 1;
        }
        if text(*next) == "," {
            *next += 1;
        }
    }
    *next += 1;
    found
}

/// Module path of a file, given relative to `src`.
pub fn module_of(relative: &Path) -> Vec<String> {
    let mut path: Vec<String> =
        relative.with_extension("").iter().map(|part| part.to_str().expect("UTF-8 file name").to_string()).collect();
    if matches!(path.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        path.pop();
    }
    path
}
