//! A laboratory is of one block as it was, alone in its folder, and its token is nobody else's.

use super::program::{Lab, block, command};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

fn copied(to: &Path) -> String {
    fs::create_dir(to).expect("a folder");
    for entry in fs::read_dir(block("received-1")).expect("a block") {
        let entry = entry.expect("an entry");
        if entry.path().is_file() {
            fs::copy(entry.path(), to.join(entry.file_name())).expect("a file");
        }
    }
    to.to_str().expect("UTF-8").to_owned()
}

/// What `misclosure lab` says where it refuses, and its code.
fn refused(arguments: &[&str]) -> String {
    let output = command(arguments).arg("--no-open").output().expect("the program");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    text
}

#[test]
fn a_block_that_changed_and_a_second_laboratory_are_refused() {
    let root = tempfile::tempdir().expect("a folder");
    let at = |name: &str| root.path().join(name).to_str().expect("UTF-8").to_owned();
    let block = copied(&root.path().join("block"));
    let lab = Lab::open(Path::new(&block), &root.path().join("lab"));
    lab.done(1);
    let text = refused(&[&block, "-o", &at("lab")]);
    assert!(text.contains("another laboratory works in this folder"), "{text}");
    let text = refused(&[&block, "-o", &at("lab/step-0001")]);
    assert!(text.contains("in the laboratory"), "{text}");
    lab.kill();
    // Neither is a step of it a place for a run.
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args(["adjust", &block, "-o", &at("lab/step-0001")])
        .output()
        .expect("the program");
    assert_eq!(run.status.code(), Some(2), "{}", String::from_utf8_lossy(&run.stderr));
    // One measurement less.
    let ties = fs::read_to_string(root.path().join("block/ties.csv")).expect("a table");
    let rows: Vec<&str> = ties.lines().collect();
    fs::write(root.path().join("block/ties.csv"), rows[..rows.len() - 1].join("\n") + "\n").expect("written");
    let text = refused(&[&block, "-o", &at("lab")]);
    assert!(text.contains("has changed since; start again in another folder (-o), or restore the block"), "{text}");
    // Restored.
    fs::write(root.path().join("block/ties.csv"), ties).expect("written");
    Lab::open(Path::new(&block), &root.path().join("lab")).done(1);
    // The folder of a run is none of a laboratory.
    let step = root.path().join("lab/step-0001");
    let run = root.path().join("run");
    fs::create_dir(&run).expect("a folder");
    for name in ["summary.json", "source.json", "model.toml"] {
        fs::copy(step.join(name), run.join(name)).expect("a file");
    }
    let text = refused(&[&block, "-o", &at("run")]);
    assert!(text.contains("is the folder of a run"), "{text}");
}

#[test]
fn a_browser_gets_the_address_by_a_page_that_nobody_else_reads() {
    let root = tempfile::tempdir().expect("a folder");
    let block = copied(&root.path().join("block"));
    let bin = root.path().join("bin");
    fs::create_dir(&bin).expect("a folder");
    let opener = bin.join(if cfg!(target_os = "macos") { "open" } else { "xdg-open" });
    fs::write(&opener, format!("#!/bin/sh\necho \"$@\" > '{}'\n", root.path().join("arguments").display()))
        .expect("written");
    fs::set_permissions(&opener, PermissionsExt::from_mode(0o755)).expect("set");
    let path = std::env::join_paths(
        std::iter::once(bin).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    );
    let folder = root.path().join("lab");
    let mut child = command(&[&block, "-o", folder.to_str().expect("UTF-8")])
        .env("PATH", path.expect("a path"))
        .spawn()
        .expect("it runs");
    let mut line = String::new();
    let mut out = std::io::BufReader::new(child.stdout.take().expect("its output"));
    std::io::BufRead::read_line(&mut out, &mut line).expect("its address");
    let token = line.trim().split_once("?token=").expect("a token").1.to_owned();
    let mut arguments = String::new();
    for _ in 0..200 {
        arguments = fs::read_to_string(root.path().join("arguments")).unwrap_or_default();
        if arguments.ends_with('\n') {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    child.kill().expect("a process");
    child.wait().expect("its end");
    assert!(!arguments.is_empty() && !arguments.contains(&token), "{arguments}");
    let page = Path::new(arguments.trim());
    assert!(fs::read_to_string(page).expect("a page").contains(&format!("url={}\"", line.trim())));
    assert_eq!(fs::metadata(page).expect("a page").permissions().mode() & 0o777, 0o600);
}
