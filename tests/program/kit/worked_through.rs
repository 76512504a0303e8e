//! The page on an effect of one's own, executed: every command of its example in turn, in an empty folder with the
//! installed package alone, and what it prints held against the text.

use super::place::{Place, Run, root};
use crate::transcript::{commands, compare};

/// The page, and the heading of the example.
const PAGE: &str = "docs/effects-of-your-own.md";
const BEGIN: &str = "\n## Worked through\n";

#[test]
fn the_example_of_the_page_finds_and_removes_its_effect() {
    let page = std::fs::read_to_string(root().join(PAGE)).expect(PAGE);
    let part = page.split(BEGIN).nth(1).expect("the part").split("\n## ").next().expect("its end");
    let place = Place::new();
    let commands = commands(part);
    let named = |what: &str| commands.iter().any(|(command, _)| command.contains(what));
    for step in ["effects new", "effects build", "effects check", "improve"] {
        assert!(named(step), "{PAGE} has `{step}`");
    }
    for (command, expected) in commands {
        let run = Run::of(place.command("sh").args(["-c", &command]).output().expect("a shell"));
        assert_eq!(run.code, Some(0), "{command}: {}", run.errors);
        if let Err(text) = compare(&expected, &run.text) {
            panic!("$ {command}\n{text}");
        }
    }
}
