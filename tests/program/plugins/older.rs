//! What was compiled with version 2 of `effect.h` still loads, and solves as before. It has no range, no words, and the
//! picture of its stage. `abi-2/effect.h` is that header as it was.

use crate::plugins::compiled::{C, CPP, compile};
use crate::plugins::faults::{EFFECT, adjusted};
use misclosure::effects::{By, Effect, Picture, Plausible, Words, plugin};
use misclosure::kit::check;
use std::fs;
use std::path::{Path, PathBuf};

/// A folder with the header of version 2: a quoted include looks beside the source first.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("effect.h"), include_str!("abi-2/effect.h")).expect("the older header");
    folder
}

/// The effect of `effect.c`, which states nothing where the header has no place for it.
fn older(folder: &Path) -> PathBuf {
    compile(folder, "older", EFFECT, C, &["-DSTATES_NOTHING=1".into()])
}

#[test]
fn a_library_of_version_2_loads_and_solves() {
    let folder = folder();
    let library = older(folder.path());
    let effect = plugin::load(&library).expect("version 2 is read");
    let descriptor = effect.descriptor();
    assert_eq!((&*descriptor.id, &descriptor.parameters[0].plausible), ("longer", &None::<Plausible>));
    assert_eq!((&descriptor.words, descriptor.picture), (&None::<Words>, Picture::Sensor));
    // Both solvers take its table, and agree.
    adjusted(effect).expect("nothing is wrong with it");
    let found = check::check(&library).expect("a plug-in");
    assert!(found.holds(), "{:?}", found.laws);
    assert_eq!((found.version, found.remarks.len()), (2, 3), "{:?}", found.remarks);
    assert!(found.remarks[0].contains("compiled with version 2 of effect.h"), "{}", found.remarks[0]);
}

/// A C++ header of ours that states nothing, compiled with either version.
#[test]
fn both_versions_of_a_header_give_the_same_numbers() {
    let (old, new) = (folder(), tempfile::tempdir().expect("a temporary folder"));
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("cpp/effects/gravity-sag.h");
    let source = fs::read_to_string(header).expect("a header").replace("\"gravity-sag\"", "\"my-sag\"");
    let [old, new] = [&old, &new].map(|folder| {
        let library = compile(folder.path(), "sag", &source, CPP, &[]);
        plugin::open(&library).expect("a plug-in")
    });
    assert_eq!((old.table().version(), new.table().version()), (2, 3));
    assert_eq!(old.descriptor(), new.descriptor());
    let numbers = |effect: &plugin::Plugin| {
        let place = &misclosure::effects::laws::samples(effect, 1)[0];
        let (mut out, mut d_input, mut d_theta) = ([0.0; 12], [0.0; 180], [0.0; 72]);
        let table = effect.table();
        table
            .evaluate(&place.context(), &place.input, &place.theta, &mut out, Some(&mut d_input), Some(&mut d_theta))
            .expect("values");
        [&out[..], &d_input, &d_theta].concat()
    };
    assert_eq!(numbers(&old), numbers(&new));
}

#[test]
fn what_a_library_of_version_2_gets_wrong_is_named() {
    let folder = folder();
    for (fault, expected) in [
        ("SIZE=8", "struct misclosure_effect has 8 bytes, expected 112"),
        ("ID=0", "has no valid id"),
        ("COUNT=1000", "has 1000 parameters, the most is 256"),
        ("LENGTH=f+a+1.0", "breaks the null law"),
    ] {
        let options = ["-DSTATES_NOTHING=1".to_owned(), format!("-D{fault}")];
        let library = compile(folder.path(), "faulty", EFFECT, C, &options);
        let message = plugin::load(&library).err().expect("refused").to_string();
        assert!(message.contains("faulty.so: ") && message.contains(expected), "{fault}: {message}");
    }
}

/// What version 3 has in their place.
#[test]
fn a_library_of_version_3_states_the_three() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let library = compile(folder.path(), "newer", EFFECT, C, &[]);
    let effect = plugin::load(&library).expect("a plug-in");
    let descriptor = effect.descriptor();
    let range = Plausible { min: -50.0, max: 50.0, source: "a test".into() };
    assert_eq!(descriptor.parameters[0].plausible, Some(range));
    let words = Words { what: "What it is.".into(), remedy: "What to do.".into(), tell: "what tells".into() };
    assert_eq!(descriptor.words, Some(words));
    assert_eq!(descriptor.picture, Picture::Scale(By::Temperature));
    let found = check::check(&library).expect("a plug-in");
    assert_eq!((found.version, &found.remarks), (3, &Vec::new()));
}
