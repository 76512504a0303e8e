//! The architecture, held by a test: which module may import which, that no files import each other, where `unsafe` may
//! stand, and that every effect has its two derivations under one name.

mod circles;
pub mod source;

use source::{files, imports, module_of, root, tokens};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// What a module may import besides itself.
enum May {
    /// These alone.
    Only(&'static [&'static str]),
    /// All but these.
    AllBut(&'static [&'static str]),
}

/// The import table of the design. A row of a part of a module goes before that of the module.
#[rustfmt::skip] // Lists of names side by side.
const TABLE: [(&str, May); 36] = [
    ("files", May::Only(&[])),
    ("math", May::Only(&[])),
    ("score", May::Only(&["math"])),
    ("geodesy", May::Only(&[])),
    ("camera", May::Only(&["math"])),
    ("block", May::Only(&["math", "camera"])),
    ("io", May::Only(&["files", "math", "geodesy", "camera", "block", "model"])),
    ("effects", May::Only(&["files", "math", "camera"])),
    ("model", May::Only(&["camera", "block", "effects"])),
    ("problem", May::Only(&["math", "camera", "block", "effects", "model"])),
    ("measure", May::Only(&["math", "camera", "effects", "problem"])),
    ("adjust::native", May::Only(&["math", "camera", "effects", "problem", "measure"])),
    ("adjust", May::Only(&["math", "camera", "effects", "problem"])),
    ("null_model", May::Only(&["math", "effects", "model", "problem", "measure", "adjust"])),
    ("scenario", May::Only(&["files", "math", "geodesy", "camera", "block"])),
    // Mistakes are made in files of text: nothing of the search for them, nor of the edits that undo them.
    ("inject::mistakes", May::Only(&["files"])),
    ("inject", May::Only(&["files", "math", "camera", "block", "scenario"])),
    ("kit", May::Only(&["files", "math", "camera", "block", "effects", "model", "problem", "measure", "inject"])),
    ("evaluate", May::Only(&["math", "camera", "block"])),
    ("mistakes", May::Only(&["math", "camera", "block", "evaluate"])),
    ("run", May::Only(&[
        "math", "geodesy", "camera", "block", "io", "effects", "model", "problem", "measure", "adjust", "null_model",
        "evaluate", "mistakes",
    ])),
    ("snooping", May::Only(&[
        "math", "score", "camera", "block", "model", "problem", "measure", "adjust", "null_model", "evaluate", "run",
    ])),
    ("residuals", May::Only(&[
        "math", "score", "camera", "block", "model", "problem", "measure", "adjust", "null_model", "evaluate", "run",
    ])),
    ("screening", May::Only(&[
        "math", "geodesy", "camera", "block", "model", "problem", "measure", "adjust", "null_model", "evaluate",
        "mistakes", "run", "snooping", "residuals",
    ])),
    ("diagnose", May::Only(&[
        "math", "score", "geodesy", "camera", "block", "effects", "model", "problem", "measure", "adjust", "null_model",
        "evaluate", "mistakes", "run", "snooping", "residuals", "screening",
    ])),
    ("plan", May::Only(&[
        "math", "score", "files", "block", "io", "effects", "model", "adjust", "problem", "scenario", "inject",
        "mistakes", "run", "residuals", "screening", "diagnose",
    ])),
    ("compare", May::Only(&["camera", "io", "evaluate", "diagnose", "run"])),
    ("report", May::AllBut(&["io", "scenario", "inject", "kit", "study", "campaign", "validate", "lab", "cli"])),
    ("study", May::AllBut(&["snooping", "residuals", "screening", "diagnose", "campaign", "validate", "lab", "cli"])),
    ("campaign", May::AllBut(&["kit", "study", "validate", "lab", "cli"])),
    ("validate", May::AllBut(&[
        "snooping", "residuals", "screening", "diagnose", "kit", "report", "study", "campaign", "lab", "cli",
    ])),
    ("book", May::Only(&[])),
    ("faults", May::Only(&[])),
    ("memory", May::Only(&["faults"])),
    ("lab", May::AllBut(&["study", "campaign", "validate", "cli"])),
    ("cli", May::AllBut(&[])),
];

/// The two solvers are derived independently: neither may look into the other, not even in its tests.
const STRANGERS: [[&str; 2]; 2] = [["adjust", "native"], ["adjust", "ceres"]];

/// Where alone `unsafe` may stand: the cxx bridge, the mirror of the C ABI, the loader of plug-ins, the signals, the
/// allocator.
const UNSAFE: [&str; 5] = ["adjust/ceres/bridge.rs", "effects/abi", "effects/plugin.rs", "faults.rs", "memory.rs"];

/// The file of `src/effects` that stands for effects from elsewhere.
const FROM_ELSEWHERE: [&str; 1] = ["plugin"];

/// What is wrong with one file.
fn violations(relative: &Path, source: &str) -> Vec<String> {
    let module = module_of(relative);
    let Some(own) = module.first() else { return Vec::new() };
    let covers = |row: &str| row.split("::").enumerate().all(|(k, part)| module.get(k).is_some_and(|m| m == part));
    let Some((_, may)) = TABLE.iter().find(|(row, _)| covers(row)) else {
        return vec![format!("src/{}: module `{own}` is not in the import table", relative.display())];
    };
    let file_is_test = module.iter().any(|name| name == "tests" || name.ends_with("_tests"));
    let mut found = Vec::new();
    for import in imports(source, &module) {
        let Some(other) = import.path.first() else { continue };
        let place = format!("src/{}:{}", relative.display(), import.line);
        let [a, b] = STRANGERS;
        for (here, there) in [(a, b), (b, a)] {
            if module.starts_with(&here.map(String::from)) && import.path.starts_with(&there.map(String::from)) {
                found.push(format!("{place}: {} imports {}", here.join("::"), import.path.join("::")));
            }
        }
        // Unit tests may build their input with any module.
        if other == own || import.in_test || file_is_test || !TABLE.iter().any(|(name, _)| name == other) {
            continue;
        }
        let allowed = match may {
            May::Only(list) => list.contains(&other.as_str()),
            May::AllBut(list) => !list.contains(&other.as_str()),
        };
        if !allowed {
            found.push(format!("{place}: `{own}` must not import `{}`", import.path.join("::")));
        }
    }
    found
}

#[test]
fn imports_follow_the_table() {
    let src = root().join("src");
    let mut found = Vec::new();
    for file in files(&src, "rs") {
        let source = fs::read_to_string(&file).expect("readable source");
        found.extend(violations(file.strip_prefix(&src).expect("below src"), &source));
    }
    assert!(found.is_empty(), "imports against the design:\n{}", found.join("\n"));
}

#[test]
fn every_module_of_the_crate_is_in_the_table() {
    let lib = fs::read_to_string(root().join("src/lib.rs")).expect("src/lib.rs");
    let tokens = tokens(&lib);
    let modules: BTreeSet<&str> = tokens.windows(2).filter(|w| w[0].0 == "mod").map(|w| w[1].0.as_str()).collect();
    let table: BTreeSet<&str> = TABLE.iter().map(|(name, _)| *name).filter(|name| !name.contains("::")).collect();
    assert_eq!(modules, table);
}

#[test]
fn a_forbidden_import_is_seen_however_it_is_written() {
    let native = Path::new("adjust/native/lm.rs");
    for (file, source) in [
        (Path::new("inject/noise.rs"), "use crate::effects::Effect;"),
        (Path::new("inject/noise.rs"), "use crate::{math, block::{Block, Image}, problem as p};"),
        (Path::new("inject/noise.rs"), "fn f() { let x = crate::adjust::Options::default(); }"),
        (Path::new("inject/noise.rs"), "use super::super::effects;"),
        (Path::new("inject/mistakes/survey.rs"), "use crate::block::edit::Edit;"),
        (Path::new("inject/mistakes/survey.rs"), "use super::super::super::mistakes::Mistake;"),
        (Path::new("evaluate/mod.rs"), "mod inner { use super::super::adjust::Solver; }"),
        (Path::new("evaluate/mod.rs"), "const Q: char = '\"'; use crate::adjust::Solver; const R: char = '\"';"),
        (native, "use super::super::ceres::Ceres;"),
        (native, "use crate::adjust::{ceres::Ceres};"),
        (native, "#[cfg(test)] mod tests { use crate::adjust::ceres::Ceres; }"),
        (Path::new("adjust/ceres/mod.rs"), "use crate::measure::Predictor;"),
        (Path::new("adjust/mod.rs"), "use crate::measure::MeasureError;"),
        (Path::new("measure/error.rs"), "use crate::adjust::AdjustError;"),
    ] {
        assert_eq!(violations(file, source).len(), 1, "{source}");
    }
    for (file, source) in [
        (Path::new("inject/noise.rs"), "/// Unlike [`crate::effects`].\nuse crate::block::Block; // crate::effects"),
        (Path::new("inject/noise.rs"), "const S: &str = r#\"crate::effects \" crate::adjust\"#;"),
        (Path::new("inject/noise.rs"), "#[cfg(test)] mod tests { use crate::effects::find; use super::*; }"),
        (native, "use super::schur; use crate::adjust::{Options, native::covariance}; impl<'a> X<'a> {}"),
        (native, "use crate::measure::Frame;"),
        (Path::new("cli/mod.rs"), "use crate::{adjust::ceres, inject};"),
    ] {
        assert_eq!(violations(file, source), Vec::<String>::new(), "{source}");
    }
}

#[test]
fn unsafe_stands_in_the_bridge_the_abi_the_loader_and_the_allocator_alone() {
    let src = root().join("src");
    for file in files(&src, "rs") {
        let relative = file.strip_prefix(&src).expect("below src");
        if UNSAFE.iter().any(|allowed| relative.starts_with(allowed)) {
            continue;
        }
        let source = fs::read_to_string(&file).expect("readable source");
        // `unsafe_code` in an attribute would switch the lint off.
        for (text, line) in tokens(&source) {
            let declared = relative == Path::new("adjust/ceres/mod.rs") || relative == Path::new("effects/mod.rs");
            assert!(text != "unsafe", "src/{}:{line}: unsafe", relative.display());
            assert!(text != "unsafe_code" || declared, "src/{}:{line}: the lint is switched off", relative.display());
        }
    }
}

#[test]
fn every_effect_has_two_derivations_under_one_name() {
    // Name of each file of a folder, and whether it defines an effect.
    let names = |folder: &str, extension: &str, mark: &[&str]| -> Vec<(String, bool)> {
        let name = |path: &Path| path.file_stem().expect("a name").to_str().expect("UTF-8").replace('_', "-");
        let defines = |path: &Path| {
            let tokens = tokens(&fs::read_to_string(path).expect("readable source"));
            tokens.windows(mark.len()).any(|w| w.iter().map(|(text, _)| text.as_str()).eq(mark.iter().copied()))
        };
        files(&root().join(folder), extension).iter().map(|path| (name(path), defines(path))).collect()
    };
    let registry: BTreeSet<String> =
        misclosure::effects::catalogue().iter().map(|effect| effect.descriptor().id.to_string()).collect();
    for (folder, extension, mark) in
        [("src/effects", "rs", &["impl", "Effect", "for"][..]), ("cpp/effects", "h", &["MISCLOSURE_EFFECT", "("][..])]
    {
        let names = names(folder, extension, mark);
        for id in &registry {
            assert!(names.iter().any(|(name, _)| name == id), "no {folder}/{id}.{extension} for the effect `{id}`");
        }
        for (name, defines) in names {
            let known = !defines || FROM_ELSEWHERE.contains(&name.as_str()) || registry.contains(&name);
            assert!(known, "{folder}/{name}.{extension} defines an effect that the registry does not have");
        }
    }
}
