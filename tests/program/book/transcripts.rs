//! Pages whose commands run in turn, and print what the page shows.

use super::pages::root;
use crate::transcript::{commands, compare};
use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

/// Runs the commands of a page in an empty folder beside the data of the repository; `said` adds the messages, which
/// come before the result.
fn runs(page: &str, said: bool) {
    let text = fs::read_to_string(root().join(page)).unwrap_or_else(|error| panic!("{page}: {error}"));
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["data", "campaigns"] {
        symlink(root().join(name), folder.path().join(name)).expect("a link into the repository");
    }
    let program = folder.path().join("bin");
    fs::create_dir(&program).expect("a folder");
    symlink(env!("CARGO_BIN_EXE_misclosure"), program.join("misclosure")).expect("a link to the program");
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let commands = commands(&text);
    assert!(!commands.is_empty(), "{page} has no commands");
    for (command, expected) in commands {
        let mut shell = Command::new("sh");
        shell.args(["-c", &command]).current_dir(folder.path()).env("PATH", &path);
        let output = shell.output().expect("a shell");
        let (printed, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{page}: $ {command}\n{errors}");
        let printed = if said { format!("{errors}{printed}").into() } else { printed };
        if let Err(text) = compare(&expected, &printed) {
            panic!("{page}: $ {command}\n{text}");
        }
    }
}

#[test]
fn the_readme_shows_what_the_program_prints() {
    runs("README.md", false);
}

#[test]
fn the_start_shows_what_the_program_prints() {
    runs("docs/start.md", false);
}

#[test]
fn the_real_block_shows_what_the_program_prints() {
    runs("docs/real-block.md", false);
}

#[test]
fn the_mistakes_show_what_the_program_prints() {
    runs("docs/mistakes.md", false);
}

#[test]
fn the_plan_shows_what_the_program_prints() {
    runs("docs/planning.md", false);
}

#[test]
fn the_shapes_of_plans_show_what_the_program_prints() {
    runs("docs/planning-shapes.md", false);
}

#[test]
fn the_campaigns_show_what_the_program_prints() {
    runs("docs/campaigns.md", false);
}

#[test]
fn the_tutorial_on_a_colmap_model_shows_what_the_program_prints() {
    runs("docs/your-own-block.md", true);
}
