//! Options from the user's file.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BLOCK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/ign-borea");

/// A command with no file of a user.
fn program(arguments: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_misclosure"));
    program.args(arguments).env_remove("MISCLOSURE_CONFIG").env_remove("XDG_CONFIG_HOME").env_remove("HOME");
    program
}

/// Exit code, standard output, standard error.
fn ended(program: &mut Command) -> (i32, String, String) {
    let Output { status, stdout, stderr } = program.output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status.code().expect("not killed"), text(stdout), text(stderr))
}

/// What a file with a text leads to.
fn with(text: &str, arguments: &[&str]) -> (i32, String, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("own.toml");
    fs::write(&file, text).expect("a file");
    let (code, stdout, stderr) = ended(program(arguments).env("MISCLOSURE_CONFIG", &file));
    (code, stdout, stderr.replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn what_is_wrong_in_the_file_is_said_with_its_place() {
    for (text, expected) in [
        ("thread = 2\n", "own.toml:1:1: unknown key \"thread\" in the file; did you mean \"threads\"?"),
        ("[bogus]\n", "own.toml:1:2: unknown key \"bogus\" in the file; known: \"simulate\", "),
        ("\n[adjust]\nti = 'dc=pp'\n", "own.toml:3:1: unknown key \"ti\" in [adjust]; did you mean \"tie\"?"),
        ("[effects.build]\nbogus = 1\n", "own.toml:2:1: unknown key \"bogus\" in [build]; known: \"output\", "),
        ("[adjust]\nhelp = true\n", "own.toml:2:1: unknown key \"help\" in [adjust]; "),
        ("adjust = 2\n", "own.toml:1:10: key adjust: expected a table, found 2"),
        ("quiet = 'yes'\n", "own.toml:1:9: key quiet: expected true or false, found 'yes'"),
        ("[adjust]\nfix = true\n", "own.toml:2:7: key fix: expected a text, a number or a list of them, found true"),
        ("[adjust]\ntie = ['dc=pp']\n", "own.toml:2:7: key tie: expected a text or a number, found ['dc=pp']"),
        ("[adjust]\ntie = 'dc'\n", "own.toml:2:7: invalid value 'dc' for '--tie <dc=pp>' [possible values: dc=pp]"),
        ("threads = 0\n", "own.toml:1:11: invalid value '0' for '--threads <N>'"),
        ("threads = \n", "own.toml:1:11: not TOML: "),
    ] {
        // The file is held against all commands, whichever runs.
        let (code, stdout, stderr) = with(text, &["effects"]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{text}");
        assert!(stderr.starts_with(&format!("error: {expected}")), "{text}: {stderr}");
    }
    let (code, _, stderr) = ended(program(&["effects"]).env("MISCLOSURE_CONFIG", "/nowhere/own.toml"));
    assert_eq!(code, 2);
    assert!(stderr.contains("/nowhere/own.toml: the file is missing; MISCLOSURE_CONFIG names it"), "{stderr}");
    // Help needs no file.
    assert_eq!(with("bogus", &["adjust", "--help"]).0, 0);
}

/// What a run says of its command and of its model.
fn adjusted(folder: &Path, program: &mut Command) -> (String, String) {
    let output = program.args(["-o", "run"]).current_dir(folder).output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| fs::read_to_string(folder.join("run").join(name)).expect("a file of the run");
    let source: serde_json::Value = serde_json::from_str(&read("source.json")).expect("JSON");
    (source["command"].as_str().expect("a command").to_owned(), read("model.toml"))
}

#[test]
fn a_run_records_what_came_from_the_file_and_can_be_repeated_without_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = folder.path().join("misclosure/config.toml");
    fs::create_dir_all(own.parent().expect("a folder")).expect("a folder");
    let text = "quiet = true\n[adjust]\nsolver = 'native'\ntie = 'dc=pp'\nfix = ['affinity', 'k3']\ndatum = 'gnss'\n\
                [improve]\ntolerance-mm = 5\n";
    fs::write(&own, text).expect("a file");
    let mut with_file = program(&["adjust", BLOCK, "--datum", "all"]);
    let (command, model) = adjusted(folder.path(), with_file.env("XDG_CONFIG_HOME", folder.path()));
    // The one that was typed stays; that of another command has no place here.
    let added = "--solver=native --tie=dc=pp --fix=affinity --fix=k3 --quiet";
    assert_eq!(command, format!("misclosure adjust {BLOCK} --datum all -o run {added}"));
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    let words: Vec<&str> = words.into_iter().filter(|word| !["-o", "run"].contains(word)).collect();
    let (again, same) = adjusted(folder.path(), &mut program(&words));
    assert_eq!(same, model);
    assert_ne!(again, command, "`-o run` stands at the end");
    // Without the file nothing is held.
    let (_, other) = adjusted(folder.path(), &mut program(&["--quiet", "adjust", BLOCK, "--datum", "all"]));
    assert_ne!(other, model);
}

#[test]
fn the_file_is_found_at_home_and_not_where_the_variable_is_empty() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = folder.path().join(".config/misclosure/config.toml");
    fs::create_dir_all(own.parent().expect("a folder")).expect("a folder");
    fs::write(&own, "bogus = 1\n").expect("a file");
    let mut at_home = program(&["effects"]);
    let (code, _, stderr) = ended(at_home.env("HOME", folder.path()));
    assert_eq!(code, 2);
    assert!(stderr.starts_with(&format!("error: {}:1:1: ", own.display())), "{stderr}");
    assert_eq!(ended(at_home.env("MISCLOSURE_CONFIG", "")).0, 0);
    assert_eq!(ended(at_home.env_remove("MISCLOSURE_CONFIG").env("XDG_CONFIG_HOME", "/nowhere")).0, 0);
}

#[test]
fn what_was_typed_excludes_what_the_file_has_against_it() {
    let from = ["simulate", "--from", "no-such-block", "-o", "no-such-folder/block"];
    let (code, _, stderr) = with("[simulate]\nset = ['points=600']\nseed = 3\n", &from);
    assert_eq!(code, 2);
    assert!(stderr.contains("no-such-block") && !stderr.contains("cannot be used with"), "{stderr}");
}

#[test]
fn options_stand_before_what_is_no_option() {
    let (code, _, stderr) = with("[check]\nthreads = 1\n", &["check", "--", "--no-such-block"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("--no-such-block") && !stderr.contains("--threads"), "{stderr}");
}
