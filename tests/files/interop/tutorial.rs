//! What the tutorial on an ODM project shows is what the program does. Its data are not in the repository.

use super::beside;
use std::path::Path;
use std::process::Command;

/// Commands of a tutorial (without the `$`), and the lines that it shows after each; `...` stands for lines that are
/// left out.
fn transcript(text: &str) -> Vec<(String, Vec<String>)> {
    let mut commands: Vec<(String, Vec<String>)> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        if line.starts_with("```") {
            inside = !inside;
        } else if let (true, Some(command)) = (inside, line.strip_prefix("$ ")) {
            commands.push((command.to_owned(), Vec::new()));
        } else if let (true, Some((_, shown))) = (inside, commands.last_mut()) {
            shown.extend((line != "..." && !line.is_empty()).then(|| line.to_owned()));
        }
    }
    commands
}

/// Runs the program's commands of a tutorial in a folder, and finds the lines that it shows in what they print.
fn compare(tutorial: &str, folder: &Path, count: usize) {
    let commands = transcript(tutorial);
    let ours: Vec<_> = commands.iter().filter(|(command, _)| command.starts_with("misclosure ")).collect();
    assert_eq!(ours.len(), count, "{commands:?}");
    for (command, shown) in ours {
        let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
            .args(command.split_whitespace().skip(1))
            .current_dir(folder)
            .output()
            .expect("the program runs");
        let said = [output.stderr, output.stdout].concat();
        let said = String::from_utf8(said).expect("UTF-8");
        assert!(output.status.success(), "{command}: {said}");
        let lines: Vec<&str> = said.lines().collect();
        for line in shown {
            assert!(lines.contains(&line.as_str()), "{command}: `{line}` is not in\n{said}");
        }
    }
}

/// Copies files of a sample into a new folder.
fn copy(sample: &Path, files: &[&str], folder: &Path) {
    std::fs::create_dir_all(folder).expect("a folder");
    for file in files {
        std::fs::copy(sample.join(file), folder.join(file)).expect("a copy");
    }
}

#[test]
fn the_tutorial_on_an_odm_project_is_real() {
    let Some(sample) = beside::shared("data/interop/opensfm-berlin-v2") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["reconstruction.json", "tracks.csv", "ground_control_points.json"];
    copy(&sample, &files, &folder.path().join("berlin/opensfm"));
    compare(include_str!("../../../docs/your-odm-project.md"), folder.path(), 4);
}
