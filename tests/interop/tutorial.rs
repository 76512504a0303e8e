//! What `docs/your-own-block.md` shows is what the program does.

use super::beside;
use std::process::Command;

/// Commands of the tutorial (without the `$`), and the lines that it shows after each; `...` stands for lines that are left out.
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

#[test]
fn the_tutorial_is_real() {
    let Some(sample) = beside::shared("data/interop/colmap-maupertuis") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("maupertuis");
    std::fs::create_dir(&model).expect("a folder");
    for file in ["cameras.txt", "images.txt", "points3D.txt"] {
        std::fs::copy(sample.join(file), model.join(file)).expect("a copy");
    }
    let commands = transcript(include_str!("../../docs/your-own-block.md"));
    let ours: Vec<_> = commands.iter().filter(|(command, _)| command.starts_with("misclosure ")).collect();
    assert_eq!(ours.len(), 3, "{commands:?}");
    for (command, shown) in ours {
        let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
            .args(command.split_whitespace().skip(1))
            .current_dir(folder.path())
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
