//! Commands that pages name: the program, make, cargo and the scripts have them.

use super::pages::{pages, prose_and_code, root, spans};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

/// Commands that have commands of their own.
const WITH_PARTS: [(&str, &[&str]); 2] = [
    ("effects", &["new", "build", "check", "reference", "book"]),
    ("campaign", &["plan", "run", "status", "gather", "analyse", "script"]),
];

/// Help on commands, each asked for once.
#[derive(Default)]
struct Help(BTreeMap<Vec<String>, Option<String>>);

impl Help {
    /// What the program says of a command, `None` where it has none of that name.
    fn of(&mut self, command: &[&str]) -> Option<&str> {
        let key: Vec<String> = command.iter().map(|word| (*word).to_owned()).collect();
        let ask = || {
            let mut program = Command::new(env!("CARGO_BIN_EXE_misclosure"));
            let output = program.args(command).arg("--help").output().expect("the program runs");
            output.status.success().then(|| String::from_utf8(output.stdout).expect("UTF-8"))
        };
        self.0.entry(key).or_insert_with(ask).as_deref()
    }
}

/// Words of a command line, up to what a page says of it behind two spaces, or to another command.
fn words(line: &str) -> Vec<&str> {
    let line = line.trim_start().trim_start_matches("$ ");
    let end = ["  ", " #", " > ", " | ", "; ", "\t"].iter().filter_map(|mark| line.find(mark)).min();
    line[..end.unwrap_or(line.len())].split_whitespace().map(|word| word.trim_matches(['[', ']'])).collect()
}

/// What is wrong with a command of the program.
fn wrong(words: &[&str], help: &mut Help) -> Option<String> {
    let mut rest = words.iter().copied().skip(1).skip_while(|word| word.starts_with("--")).peekable();
    // Without one, or with a placeholder, there is nothing to ask for.
    let command = rest.next().filter(|word| word.starts_with(|c: char| c.is_ascii_lowercase()))?;
    let mut command = vec![command];
    if let Some((_, parts)) = WITH_PARTS.iter().find(|(name, _)| *name == command[0]) {
        command.extend(rest.next_if(|word| parts.contains(word)));
    }
    let Some(text) = help.of(&command) else { return Some(format!("no command `{}`", command.join(" "))) };
    let known: BTreeSet<&str> = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).collect();
    let options = words.iter().filter(|word| word.starts_with('-') && word.len() > 1);
    let names = options.map(|word| word.split(['=', '|']).next().unwrap_or(word));
    names.filter(|name| !known.contains(name)).map(|name| format!("`{}` has no {name}", command.join(" "))).next()
}

#[test]
fn every_command_in_a_page_is_there() {
    let makefile = fs::read_to_string(root().join("Makefile")).expect("the Makefile");
    let (mut help, mut lost) = (Help::default(), Vec::new());
    for (page, text) in pages() {
        let (prose, code) = prose_and_code(&text);
        for line in code.lines().chain(spans(&prose)) {
            let words = words(line);
            let Some(first) = words.first().copied() else { continue };
            let next = words.get(1).copied().unwrap_or("");
            let after = |flag: &str| words.iter().skip_while(|word| **word != flag).nth(1);
            let found = match first {
                "misclosure" => wrong(&words, &mut help),
                "make" if next.starts_with(|c: char| c.is_ascii_lowercase()) => {
                    let there = makefile.lines().any(|line| line.starts_with(&format!("{next}:")));
                    (!there).then(|| format!("no target {next}"))
                }
                "cargo" => after("--bench")
                    .map(|name| ("benches", name))
                    .or_else(|| after("--example").map(|name| ("examples", name)))
                    .or_else(|| after("--test").map(|name| ("tests", name)))
                    .filter(|(folder, name)| {
                        let path = root().join(folder).join(name);
                        !path.is_dir() && !path.with_extension("rs").is_file()
                    })
                    .map(|(folder, name)| format!("no {folder}/{name}")),
                word if word.starts_with("scripts/") => (!root().join(word).exists()).then(|| format!("no {word}")),
                _ => None,
            };
            lost.extend(found.map(|what| format!("{}: {line}: {what}", page.display())));
        }
    }
    assert!(lost.is_empty(), "commands that are not there:\n{}", lost.join("\n"));
}

#[test]
fn what_is_no_command_is_noticed() {
    let mut help = Help::default();
    let mut wrong = |line: &str| wrong(&words(line), &mut help);
    for line in ["misclosure bogus", "misclosure check BLOCK --bogus", "misclosure effects build x --stage image"] {
        assert!(wrong(line).is_some(), "{line}");
    }
    for line in [
        "misclosure",
        "misclosure COMMAND",
        "$ misclosure --quiet check BLOCK   what is in it",
        "misclosure effects new NAME --stage STAGE     a template",
        "misclosure effects rolling-shutter",
        "misclosure import [FORMAT] PATH... -o BLOCK",
    ] {
        assert_eq!(wrong(line), None, "{line}");
    }
}
