//! Ranges, words and pictures of a plug-in: what is no range or text is refused with the reason, and a diagnosis uses
//! what is stated.

use crate::common;
use crate::plugins::compiled::{C, CPP, compile};
use crate::plugins::faults::EFFECT;
use misclosure::adjust::Options;
use misclosure::block::Block;
use misclosure::diagnose::verdict::Diagnosis;
use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::effects::plugin;
use misclosure::inject;
use misclosure::kit::check;
use misclosure::model::{Datum, EffectRef, Model};
use misclosure::report::letter;
use std::path::Path;

/// What is wrong, the macro that makes it so, and what the error says.
const REFUSED: [(&str, &str, &str); 17] = [
    ("no number", "RANGE=NAN,50.0,\"a\"", "parameter `a` has a plausible range from NaN to 50: expected two finite"),
    ("another one", "RANGE=-50.0,NAN,\"a\"", "has a plausible range from -50 to NaN: expected two finite numbers"),
    ("reversed", "RANGE=50.0,-50.0,\"a\"", "from 50 to -50: expected two finite numbers, the smaller one first"),
    ("no width", "RANGE=1.0,1.0,\"a\"", "from 1 to 1: expected two finite numbers, the smaller one first"),
    ("without end", "RANGE=-INFINITY,50.0,\"a\"", "from -inf to 50: expected two finite numbers"),
    ("a width that overflows", "RANGE=-1.7e308,1.7e308,\"a\"", "expected two finite numbers"),
    ("no source", "RANGE=-50.0,50.0,0", "from -50 to 50, but not its source: state where it comes from"),
    ("no source of no number", "RANGE=NAN,0.0,0", "from NaN to 0, but not its source"),
    ("an empty source", "RANGE=-50.0,50.0,\"\"", "a: the plausible range has its source, and nominal and typical"),
    ("no UTF-8", "RANGE=-50.0,50.0,\"\\xff\"", "no valid source of a plausible range: it is not UTF-8"),
    ("nominal outside", "RANGE=0.5,50.0,\"a\"", "a: the plausible range has its source, and nominal and typical"),
    ("a word missing", "WORDS=\"a\",0,\"b\"", "of the effect's words `remedy` is missing: state what, remedy and tell"),
    ("an empty word", "WORDS=\"a\",\"b\",\"\"", "effect `longer`: of its words `tell` is empty"),
    ("a word in no UTF-8", "WORDS=\"a\",\"\\xc3(\",\"c\"", "no valid `remedy`: it is not UTF-8"),
    ("no picture", "PICTURE=8,0", "the effect's table has no valid picture"),
    ("against nothing", "PICTURE=4,4", "the effect's table has no valid picture_by"),
    ("of another stage", "PICTURE=7,0", "shows residuals that the interior stage does not move"),
];

#[test]
fn what_is_no_range_no_word_and_no_picture_is_refused() {
    for (what, fault, expected) in REFUSED {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let library = compile(folder.path(), "faulty", EFFECT, C, &[format!("-D{fault}")]);
        let message = plugin::load(&library).err().unwrap_or_else(|| panic!("{what}: refused")).to_string();
        assert!(message.contains("faulty.so: ") && message.contains(expected), "{what}: {message}");
    }
}

#[test]
fn a_text_without_an_end_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let long = "x".repeat(20_000);
    let source = format!("#define WORDS \"{long}\", \"b\", \"c\"\n{EFFECT}");
    let message = plugin::load(&compile(folder.path(), "faulty", &source, C, &[])).err().expect("refused").to_string();
    assert!(message.contains("the `what` of the effect's table is longer than 16384 bytes"), "{message}");
}

#[test]
fn a_range_of_what_is_given_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = pattern("mine", 1.0)
        .replace("Given(\"wavelength\", \"px\", 250.0)", "UpTo(Given(\"wavelength\", \"px\", 250.0), 500.0, \"a\")");
    let message = plugin::load(&compile(folder.path(), "faulty", &source, CPP, &[])).err().expect("refused");
    assert!(message.to_string().contains("wavelength: only what is estimated or random"), "{message}");
}

/// Nothing stated is nothing wrong, and told.
#[test]
fn what_states_nothing_loads_and_is_remarked() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let library = compile(folder.path(), "silent", EFFECT, C, &["-DSTATES_NOTHING=1".into()]);
    let found = check::check(&library).expect("a plug-in");
    assert!(found.holds() && found.version == 3, "{:?}", found.laws);
    let [range, words] = &found.remarks[..] else { panic!("{:?}", found.remarks) };
    assert!(range.contains("`a`") && words.starts_with("No words"), "{range} {words}");
}

#[test]
fn the_example_in_c_keeps_the_laws_and_leaves_nothing_unsaid() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/effects/target-thickness.c");
    let source = std::fs::read_to_string(path).expect("an example");
    let library = compile(folder.path(), "target-thickness", &source, C, &[]);
    let found = check::check(&library).expect("a plug-in");
    assert!(found.holds(), "{:?}", found.laws);
    assert_eq!(found.remarks, Vec::<String>::new());
}

/// The wave of `examples/effects` under another name, plausible to `most` px and typically half of it.
fn pattern(id: &str, most: f64) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/effects/sensor-pattern.h");
    let source = std::fs::read_to_string(path).expect("an example");
    let range = |name: &str| format!("Estimated(\"{name}\", \"px\", Scope::kGlobal, 0.0, 0.2), 1.0,");
    let narrow =
        |name: &str| format!("Estimated(\"{name}\", \"px\", Scope::kGlobal, 0.0, {:?}), {most:?},", 0.5 * most);
    let changed = ["a", "b"].iter().fold(source, |source, name| {
        assert!(source.contains(&range(name)), "{source}");
        source.replace(&range(name), &narrow(name))
    });
    changed.replace("\"sensor-pattern\"", &format!("\"{id}\""))
}

/// A wave of 0.15 px on the sensor.
fn block() -> Block {
    let truth = common::preset("closerange", &[], 1).block;
    let errors = ["sensor-stitch:amplitude=0.15,wavelength=250,axis=x", "noise:px=0.2"];
    let errors: Vec<_> = errors.iter().map(|text| inject::parse(text).expect("an error")).collect();
    inject::apply(&truth, &truth, &errors, 1).expect("a block").block
}

fn diagnosed(block: &Block, header: &str) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let effect = plugin::load(&compile(folder.path(), "pattern", header, CPP, &[])).expect("a plug-in");
    let (plugins, options) = ([EffectRef::Plugin(effect)], Options::default());
    let settings = Settings { plugins: &plugins, options, significance: 1e-3, snoop: false, tell: &|_| {} };
    let model = Model { datum: Datum::All, ..Model::default() };
    diagnose(block, &model, &settings).expect("a diagnosis").diagnosis
}

/// The same estimate is a possible cause, or only looks like one: the range says which, as with an effect that is built
/// in.
#[test]
fn a_diagnosis_uses_range_and_words() {
    let block = block();
    for (id, most, plausible) in [("wide-wave", 1.0, true), ("narrow-wave", 0.05, false)] {
        let found = diagnosed(&block, &pattern(id, most));
        let own = found.candidates.iter().find(|one| one.effect == id).expect("a candidate");
        assert!(own.significant && own.plausible == plausible, "{id}: {own:?}");
        assert!((own.estimate["a"].value - 0.15).abs() < 0.02, "{id}: {:?}", own.estimate);
        if plausible {
            let entry = found.found.iter().find(|one| one.effect == id).expect("it is found");
            let words = entry.words.as_ref().expect("its words are handed on");
            let told = letter::sentences(entry, true);
            assert_eq!(told.first(), Some(&words.what.to_string()));
            assert_eq!(told.last(), Some(&format!("What to do: {}", words.remedy)));
            assert!(entry.plausible);
        }
    }
}
