//! The commands of `docs/your-own-block.md`, in their order, in one folder.

use std::process::Command;

const PAGE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/your-own-block.md"));

#[test]
fn every_command_of_the_page_works() {
    let folder = tempfile::tempdir().expect("a folder");
    let commands: Vec<&str> = PAGE.lines().filter_map(|line| line.strip_prefix("$ misclosure ")).collect();
    assert!(commands.len() >= 6, "{commands:?}");
    for command in commands {
        let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
            .args(command.split_whitespace())
            .current_dir(folder.path())
            .output()
            .expect("the program runs");
        let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {said}");
        // Of what the program says, the page shows lines as they are.
        let shown = PAGE.split(&format!("$ misclosure {command}\n")).nth(1).expect("the command is there");
        let shown = shown.split("```").next().expect("its output").lines().take_while(|line| !line.starts_with("$ "));
        for line in shown
            .filter(|line| line.starts_with("guess: ") || line.starts_with("loss: ") || line.starts_with("missing: "))
        {
            assert!(said.contains(line), "{command} does not say {line:?}: {said}");
        }
    }
}
