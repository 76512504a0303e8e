//! Plug-ins that crash the program or end it: named, and a failure.

use super::place::Place;
use std::path::Path;
use std::process::Command;

/// A plug-in of tests/program/plugins/effect.c, whose focal length is the C expression `length`; `calls` counts its
/// calls.
fn compile(place: &Place, name: &str, length: &str, before: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = std::fs::read_to_string(root.join("tests/program/plugins/effect.c")).unwrap();
    let head = "#include <stdlib.h>\n#include <unistd.h>\nstatic long calls;\nstatic double* volatile nowhere_at;\n";
    std::fs::write(place.at(format!("{name}.c")), format!("{head}{before}\n{source}")).unwrap();
    let mut command = Command::new("c++");
    command.args(["-std=c11", "-O1", "-fPIC", "-shared", "-DMISCLOSURE_PLUGIN", "-x", "c", "-I"]).arg(root.join("cpp"));
    command
        .arg(format!("-DLENGTH={length}"))
        .arg(place.at(format!("{name}.c")))
        .arg("-o")
        .arg(place.at(format!("{name}.so")));
    assert!(command.status().expect("a C++ compiler, which the build needs too").success(), "{name}");
}

#[test]
fn a_library_that_crashes_or_ends_the_program_is_named() {
    let place = Place::new();
    let on_load = |what: &str| format!("__attribute__((constructor)) static void begin(void) {{ {what} }}");
    for (name, length, before, said) in [
        ("crashes", "f+a+*nowhere_at", String::new(), "SIGSEGV"),
        ("aborts", "(abort(),f+a)", String::new(), "aborted"),
        ("leaves", "(exit(0),f+a)", String::new(), "ended the program before its work was done"),
        ("leaves-on-load", "f+a", on_load("exit(0);"), "ended the program"),
        ("crashes-on-load", "f+a", on_load("*nowhere_at = 1.0;"), "SIGSEGV"),
    ] {
        compile(&place, name, length, &before);
        for command in COMMANDS {
            is_named(&place, command, name, said);
        }
    }
}

#[test]
fn a_library_that_crashes_or_ends_the_program_in_the_middle_is_named() {
    let place = Place::new();
    // Loading takes some 200 calls, `improve` of this block 5,000, `adjust` 13,000, `effects check` 90,000 and more.
    for (name, length, said) in [
        ("crashes-later", "f+a+(++calls>1000?*nowhere_at:0.0)", "SIGSEGV"),
        ("leaves-later", "(++calls>1000?exit(0):(void)0,f+a)", "ended the program before its work was done"),
        ("leaves-quickly", "(++calls>1000?quick_exit(0):(void)0,f+a)", "ended the program before its work was done"),
        ("leaves-at-once", "(++calls>1000?_exit(0):(void)0,f+a)", "ended the program before its work was done"),
    ] {
        compile(&place, name, length, "");
        for command in COMMANDS {
            is_named(&place, command, name, said);
        }
    }
    compile(&place, "crashes-late", "f+a+(++calls>20000?*nowhere_at:0.0)", "");
    is_named(&place, COMMANDS[1], "crashes-late", "SIGSEGV");
    compile(&place, "leaves-late", "(++calls>20000?_exit(0):(void)0,f+a)", "");
    is_named(&place, COMMANDS[1], "leaves-late", "ended the program before its work was done");
}

/// Commands that load a plug-in and call it. Two threads, so that both may end the program at the same moment.
const COMMANDS: [&str; 3] = [
    "adjust block -o out --threads 2 --plugin LIBRARY --add longer --fix f",
    "effects check --threads 2 LIBRARY",
    "improve block -o out --threads 2 --plugin LIBRARY",
];

/// The command fails, says why, names the library and leaves no output.
fn is_named(place: &Place, command: &str, library: &str, why: &str) {
    let library = format!("{library}.so");
    let line = command.replace("LIBRARY", &library);
    let ended = place.run(line.split(' '));
    ended.expect(1, why);
    assert!(ended.errors.contains(&library), "{line}: {ended:?}");
    assert!(!place.at("out").exists(), "{line}");
}
