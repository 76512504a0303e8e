//! Pages and pictures that a command makes.

use super::pages::root;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Digits of a picture that may differ between processors.
const TOLERANCE: f64 = 0.5;

#[test]
fn the_pages_of_the_effects_are_current() {
    let (pages, folder) = (root().join("docs/effects"), tempfile::tempdir().expect("a folder"));
    let names = |folder: &Path, extension: &str| -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| name.ends_with(extension)).collect();
        names.sort();
        names
    };
    for picture in names(&pages, ".svg") {
        fs::copy(pages.join(&picture), folder.path().join(&picture)).expect("a copy");
    }
    let mut program = Command::new(env!("CARGO_BIN_EXE_misclosure"));
    let status = program.args(["--quiet", "effects", "book"]).arg(folder.path()).status().expect("the program runs");
    assert!(status.success());
    assert_eq!(names(&pages, ".md"), names(folder.path(), ".md"), "misclosure effects book docs/effects");
    for name in names(&pages, ".md") {
        let read = |folder: &Path| fs::read_to_string(folder.join(&name)).expect("a page");
        assert!(read(&pages) == read(folder.path()), "docs/effects/{name}: misclosure effects book docs/effects");
    }
}

/// The numbers of a picture, and the text around them.
fn numbers(picture: &str) -> (Vec<f64>, String) {
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let (mut found, mut around) = (Vec::new(), String::new());
    let mut rest = picture;
    while let Some(start) = rest.find(is_of_number) {
        let after = &rest[start..];
        let length = after.find(|c| !is_of_number(c)).unwrap_or(after.len());
        around += &rest[..start];
        match after[..length].parse() {
            Ok(number) => found.push(number),
            Err(_) => around += &after[..length],
        }
        rest = &after[length..];
    }
    (found, around + rest)
}

#[test]
fn the_picture_of_the_readme_is_what_its_script_makes() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = folder.path().join("picture.svg");
    let mut script = Command::new(root().join("scripts/readme_picture.sh"));
    let output = script.arg(env!("CARGO_BIN_EXE_misclosure")).arg(&made).output().expect("a shell");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stored = fs::read_to_string(root().join("docs/before-after.svg")).expect("the picture");
    let (stored, made) = (numbers(&stored), numbers(&fs::read_to_string(made).expect("a picture")));
    let differ = stored.0.iter().zip(&made.0).filter(|(a, b)| (*a - *b).abs() > TOLERANCE).count();
    assert!(
        stored.1 == made.1 && stored.0.len() == made.0.len() && differ == 0,
        "docs/before-after.svg differs in {differ} numbers: scripts/readme_picture.sh makes it anew"
    );
}

/// Relative difference, and absolute one of numbers below one, that two processors may make in an adjustment.
const ROUNDING: f64 = 1e-6;

#[test]
fn the_colmap_model_of_the_tutorial_is_what_its_script_makes() {
    let (stored, folder) = (root().join("data/borea-colmap"), tempfile::tempdir().expect("a folder"));
    let made = folder.path().join("made");
    let mut script = Command::new(root().join("scripts/borea_colmap.sh"));
    let output = script.arg(env!("CARGO_BIN_EXE_misclosure")).arg(&made).output().expect("a shell");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let same = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= ROUNDING * a.abs().max(1.0),
        _ => a == b,
    };
    let files = |folder: &str| {
        let entries = fs::read_dir(stored.join(folder)).expect("a folder").flatten();
        let files = entries.filter(|entry| entry.path().is_file());
        files.map(|entry| Path::new(folder).join(entry.file_name())).collect::<Vec<_>>()
    };
    let files = [files(""), files("sparse")].concat();
    assert_eq!(files.len(), 10);
    for file in files {
        let read = |folder: &Path| fs::read_to_string(folder.join(&file)).expect("a file of text");
        let (stored, made) = (read(&stored), read(&made));
        let words = |text: &str| text.split([' ', ',', '\n']).map(str::to_owned).collect::<Vec<_>>();
        let (stored, made) = (words(&stored), words(&made));
        let differ = stored.iter().zip(&made).filter(|(a, b)| !same(a, b)).count();
        assert!(
            stored.len() == made.len() && differ == 0,
            "{}: {differ} words differ: scripts/borea_colmap.sh makes it anew",
            file.display()
        );
    }
}

#[test]
fn numbers_of_a_picture_are_told_from_its_text() {
    assert_eq!(numbers("<path d=\"M1.5 -2L3\"/>"), (vec![1.5, -2.0, 3.0], "<path d=\"M L\"/>".into()));
}
