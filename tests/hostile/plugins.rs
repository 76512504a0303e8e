//! Plug-ins that crash the program or end it: named, and a failure.

use super::place::Place;
use std::path::Path;
use std::process::Command;

/// A plug-in of tests/plugins/effect.c, whose focal length is the C expression `length`.
fn compile(place: &Place, name: &str, length: &str, before: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = std::fs::read_to_string(root.join("tests/plugins/effect.c")).unwrap();
    let head = "#include <stdlib.h>\n#include <unistd.h>\nstatic double* volatile nowhere_at;\n";
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
        let library = format!("{name}.so");
        for line in [
            format!("adjust block -o out --plugin {library} --add longer"),
            format!("effects check {library}"),
            format!("improve block -o out --plugin {library}"),
        ] {
            let ended = place.run(line.split(' '));
            ended.expect(1, said);
            assert!(ended.errors.contains(&library), "{line}: {ended:?}");
            assert!(!place.at("out").exists(), "{line}");
        }
    }
}
