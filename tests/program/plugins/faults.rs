//! Every fault has an error of its own, which names the library, and none ends the program.

use crate::common;
use crate::plugins::compiled::{C, CPP, compile};
use misclosure::adjust::Options;
use misclosure::effects::abi::EvalFault;
use misclosure::effects::{Effect, plugin};
use misclosure::io::block::write_block;
use misclosure::model::{EffectRef, EffectTerm, Model};
use misclosure::scenario::add_noise;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

pub const EFFECT: &str = include_str!("effect.c");

/// What is wrong, the macro that makes it so, and what the error says.
const REFUSED: [(&str, &str, &str); 14] = [
    ("a missing symbol", "LENGTH=f+nowhere(a)", "cannot be loaded: "),
    ("another version", "VERSION=1", "made for version 1 of effect.h"),
    ("another size", "SIZE=8", "struct misclosure_effect has 8 bytes"),
    ("no id", "ID=0", "the effect's table has no valid id"),
    ("an empty id", "ID=\"\"", "effect ``: an id is lower case with hyphens"),
    ("an id that is none", "ID=\"Long er\"", "effect `Long er`: an id is lower case with hyphens"),
    (
        "an id that is taken",
        "ID=\"focal-time\"",
        "effect `focal-time`: an effect of this id is built in: give it another",
    ),
    ("no parameters", "COUNT=0", "effect `longer`: nothing to estimate"),
    ("a thousand parameters", "COUNT=1000", "the effect's table has 1000 parameters, the most is 256"),
    ("a null law that is broken", "LENGTH=f+a+1.0", "effect `longer`: breaks the null law: "),
    ("a product in its place", "LENGTH=f*(1.0+1e-12+a)", "effect `longer`: breaks the null law: "),
    (
        "NaN",
        "LENGTH=NAN",
        "effect `longer`: at the nominal values of its parameters it gives a value that is not a finite",
    ),
    (
        "infinity",
        "LENGTH=INFINITY",
        "at the nominal values of its parameters it gives a value that is not a finite number",
    ),
    ("a name that is none", "ID=\"x[1]\"", "effect `x[1]`: an id is lower case with hyphens"),
];

fn faulty(folder: &Path, fault: &str) -> PathBuf {
    compile(folder, "faulty", EFFECT, C, &[format!("-D{fault}")])
}

fn error(library: &Path) -> String {
    plugin::load(library).err().expect("refused").to_string()
}

#[test]
fn every_fault_of_a_table_is_named() {
    for (what, fault, expected) in REFUSED {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let message = error(&faulty(folder.path(), fault));
        assert!(message.contains("faulty.so: ") && message.contains(expected), "{what}: {message}");
    }
}

#[test]
fn a_missing_symbol_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let error = plugin::load(&faulty(folder.path(), "LENGTH=f+nowhere(a)")).err().expect("refused");
    // The loader's own words are the cause of its error: the program prints the whole chain.
    let message = format!("{:#}", anyhow::Error::from(error));
    assert!(message.contains("undefined symbol: nowhere"), "{message}");
}

#[test]
fn an_exception_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("cpp/effects/decentring-high.h");
    let source = fs::read_to_string(header).expect("a header").replace("\"decentring-high\"", "\"thrower\"");
    let body = source.find("static bool Apply").expect("a formula");
    let start = body + source[body..].find('{').expect("its begin") + 1;
    let throwing = format!("{} throw 1; {}", &source[..start], &source[start..]);
    let message = error(&compile(folder.path(), "faulty", &throwing, CPP, &[]));
    assert!(message.ends_with("it throws an exception"), "{message}");
}

#[test]
fn what_is_no_library_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = folder.path().join("text.so");
    fs::write(&text, "not a library").expect("a file");
    let library = faulty(folder.path(), "SLOPE=1.0");
    plugin::load(&library).expect("nothing is wrong with it");
    let hidden = folder.path().join("hidden.so");
    fs::copy(&library, &hidden).expect("a file");
    fs::set_permissions(&hidden, fs::Permissions::from_mode(0o000)).expect("permissions");
    // A library that was cut off: without a look at its segments the loader would end the program.
    let whole = fs::read(&library).expect("a library");
    let cut = folder.path().join("cut.so");
    for (path, expected) in [
        (folder.path().join("missing.so"), "cannot be read: No such file or directory"),
        (folder.path().to_path_buf(), "cannot be read: this is no regular file"),
        (text, "cannot be loaded: "),
    ] {
        let message = error(&path);
        assert!(message.contains(&format!("{}: {expected}", path.display())), "{message}");
    }
    for length in [whole.len() / 4, whole.len() / 2, 3 * whole.len() / 4, 100, 20] {
        fs::write(&cut, &whole[..length]).expect("a file");
        let message = error(&cut);
        let named = message.contains(&format!("cut.so: is not whole: {length} bytes, its segments take "))
            || message.contains("cut.so: cannot be loaded: ");
        assert!(named, "{length}: {message}");
    }
    // Who may read everything (root) is refused nothing.
    match fs::File::open(&hidden) {
        Err(_) => assert!(error(&hidden).contains("cannot be read: Permission denied"), "{}", error(&hidden)),
        Ok(_) => eprintln!("skipped: permissions, for this user has all"),
    }
}

pub fn adjusted(effect: Arc<dyn Effect>) -> Result<(), String> {
    let mut block = common::preset("closerange", &[("points", 60.0)], 1).block;
    add_noise(&mut block, 0.1, 1).expect("noise");
    // Beside a free focal length it would not be determined.
    let mut model = Model::default();
    model.free[0] = false;
    model.effects.push(EffectTerm { effect: EffectRef::Plugin(effect), values: Default::default(), held: Vec::new() });
    common::try_both(&block, &model, &Options::default()).map(drop)
}

#[test]
fn what_shows_only_in_an_adjustment_is_an_error_there() {
    // A folder each: the loader knows a library by its path.
    let load = |fault: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        plugin::load(&faulty(folder.path(), fault)).expect("nothing shows at the nominal values")
    };
    adjusted(load("SLOPE=1.0")).expect("nothing is wrong with it");
    let text = adjusted(load("SLOPE=1.1")).expect_err("a derivative that is wrong");
    // One solver is held against the plug-in's values.
    let (begins, column) = match common::SOLVERS.len() {
        1 => ("the derivative by longer.a ", "is not that of the effect's values"),
        _ => ("the solvers disagree: ", "in column longer.a"),
    };
    assert!(text.starts_with(begins) && text.contains(column), "{text}");
    for value in ["NAN", "INFINITY"] {
        let effect = load(&format!("LENGTH=a==0.0?f:{value}"));
        adjusted(effect.clone()).expect_err("no numbers");
        let fault = effect.take_fault().expect("what it did is noted");
        assert_eq!((fault.what, fault.image), (EvalFault::NotFinite, 0), "{value}");
        assert_eq!(effect.take_fault(), None, "and forgotten when it was asked for");
    }
}

#[test]
fn two_plug_ins_of_one_id_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let library = faulty(folder.path(), "SLOPE=1.0");
    let block = common::preset("closerange", &[("points", 20.0)], 1).block;
    write_block(&block, &folder.path().join("block")).expect("written");
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args(["--quiet", "adjust", "block", "-o", "run", "--plugin"])
        .arg(&library)
        .arg("--plugin")
        .arg(&library)
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    let text = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("faulty.so: there is an effect `longer` already"), "{text}");
}
