//! Blocks with one fault each, and the whole message that names it; and that no file, whatever is in it, makes the
//! reader panic.

mod accepted;
mod block;
mod block_toml;
mod bytes;
mod control;
mod files;
mod images;
mod ties;

use block::Files;
use misclosure::io::block::read_block;

/// Name, what makes the valid block faulty, and the whole message.
type Case = (&'static str, fn(&mut Files), &'static str);

#[test]
fn every_fault_is_named() {
    let cases = || [files::CASES, block_toml::CASES, images::CASES, ties::CASES, control::CASES].into_iter().flatten();
    let mut wrong = Vec::new();
    for (name, alter, expected) in cases() {
        let mut files = Files::valid();
        alter(&mut files);
        let message = match files.read() {
            Ok(_) => "read without an error".to_owned(),
            Err(message) => message,
        };
        if message != *expected {
            wrong.push(format!("{name}\n  expected {expected}\n  found    {message}"));
        }
    }
    println!("{} faults", cases().count());
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases().count(), wrong.join("\n"));
}

/// Nesting as deep as the file is long must not exhaust the stack.
#[test]
fn deep_nesting_is_refused() {
    let mut files = Files::valid();
    files.set("block.toml", format!("format = 1\nname = {}", "[".repeat(100_000)));
    let message = files.read().expect_err("too deep");
    assert!(message.starts_with("block.toml:2:"), "{message}");
    assert!(message.contains("not TOML"), "{message}");
}

#[test]
fn no_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("none");
    let message = read_block(&path).expect_err("there is none").to_string();
    let expected =
        format!("{}: this is not a folder; every block has block.toml, images.csv and ties.csv", path.display());
    assert_eq!(message, expected);
}
