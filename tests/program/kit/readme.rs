//! The README's text on an effect of one's own, executed: every command in turn, in an empty folder with the installed package alone, and
//! what it prints held against the text.

use super::place::{Place, Run, root};

/// Begins the part.
const BEGIN: &str = "**An effect of your own.**";

/// Commands of the part, each with the lines that it is said to print.
fn commands(text: &str) -> Vec<(String, Vec<String>)> {
    let part = text.split(BEGIN).nth(1).expect("the part").split("\n**").next().expect("its end");
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for block in part.split("```").skip(1).step_by(2) {
        for line in block.lines().skip(1) {
            match (line.strip_prefix("$ "), found.last_mut()) {
                (Some(command), _) => found.push((command.to_owned(), Vec::new())),
                (None, Some((_, printed))) => printed.push(line.to_owned()),
                (None, None) => panic!("{line}: before the first command"),
            }
        }
    }
    found
}

/// The lines stand in what was printed, in their order; `...` is any number of lines, or the rest of one. Spaces do not count.
fn compare(expected: &[String], printed: &str) -> Result<(), String> {
    let plain = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut lines = printed.lines().map(plain).filter(|line| !line.is_empty());
    let mut skips = false;
    for line in expected.iter().map(|line| plain(line)).filter(|line| !line.is_empty()) {
        if line == "..." {
            skips = true;
            continue;
        }
        let (start, open) = line.strip_suffix("...").map_or((line.as_str(), false), |start| (start.trim_end(), true));
        let fits = |found: &String| if open { found.starts_with(start) } else { found == start };
        let met = if skips { lines.any(|found| fits(&found)) } else { lines.next().is_some_and(|found| fits(&found)) };
        if !met {
            return Err(format!("`{line}` is not where the text has it, in:\n{printed}"));
        }
        skips = false;
    }
    match lines.next() {
        Some(more) if !skips => Err(format!("`{more}` is printed, and the text does not have it")),
        _ => Ok(()),
    }
}

#[test]
fn the_readme_finds_and_removes_its_effect() {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("the README");
    let place = Place::new();
    let commands = commands(&readme);
    let named = |what: &str| commands.iter().any(|(command, _)| command.contains(what));
    for step in ["effects new", "effects build", "effects check", "improve"] {
        assert!(named(step), "the README has `{step}`");
    }
    for (command, expected) in commands {
        let run = Run::of(place.command("sh").args(["-c", &command]).output().expect("a shell"));
        assert_eq!(run.code, Some(0), "{command}: {}", run.errors);
        if let Err(text) = compare(&expected, &run.text) {
            panic!("$ {command}\n{text}");
        }
    }
}
