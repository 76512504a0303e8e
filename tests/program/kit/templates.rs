//! Templates compile and keep every law as they stand, at every stage and in both languages.

use super::place::Place;
use misclosure::effects::Stage;
use misclosure::kit::{headers, template};
use std::fmt::Write;

/// All seven in one program with the test kit of the header: a compiler reads Eigen once.
#[test]
fn headers_keep_the_laws_at_every_stage() {
    let place = Place::new();
    headers::write(&place.path("")).expect("headers");
    let (mut includes, mut checks) = (String::new(), String::new());
    for stage in Stage::ALL {
        for file in template::cpp(&format!("of-{}", stage.name()), stage).expect("a template") {
            place.write(&file.path, &file.text);
            writeln!(includes, "#include \"{}\"", file.path).expect("text");
        }
        let name = stage.name()[..1].to_uppercase() + &stage.name()[1..];
        writeln!(checks, "  test::CheckLaws(EffectOf<Of{name}Effect>());").expect("text");
    }
    let program = format!(
        "{includes}#include \"effect_test.h\"\nint main() {{\n  using namespace misclosure;\n{checks}  return \
         test::Finish();\n}}\n"
    );
    place.write("laws.cc", &program);
    let options = "-std=c++17 -O1 -Wall -Wextra -Werror -isystem /usr/include/eigen3 laws.cc -lglog -o laws";
    assert!(place.command("c++").args(options.split(' ')).status().expect("a compiler").success());
    let output = place.command(place.path("laws")).output().expect("the test runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}

/// All seven as modules of one library: what differs between them is the effect.
#[test]
fn rust_packages_compile_at_every_stage() {
    let place = Place::new();
    let mut library = String::from("mod effect;\n");
    for stage in Stage::ALL {
        let files = template::rust(&format!("of-{}", stage.name()), stage).expect("a template");
        let text = |path: &str| &files.iter().find(|file| file.path.ends_with(path)).expect("a file").text;
        place.write("effect.rs", text("src/effect.rs"));
        place.write("number.rs", text("src/number.rs"));
        let source = text("src/lib.rs");
        assert!(source.contains("mod effect; // the contract"), "{source}");
        let module = source
            .replace("mod effect; // the contract, a copy of this program's", "")
            .replace("use effect::*", "use crate::effect::*");
        // Every effect exports its table under the same name: one library can hold one.
        let exported = |line: &&str| stage == Stage::Image || !line.starts_with("plugin!(");
        let module: Vec<&str> = module.lines().filter(exported).collect();
        let module = module.join("\n");
        place.write(&format!("{}.rs", stage.name()), &module);
        writeln!(library, "mod {};", stage.name()).expect("text");
    }
    place.write("lib.rs", &library);
    let output = place
        .command("rustc")
        .args("--edition 2024 --crate-type cdylib -D warnings -A dead_code lib.rs -o all.so".split(' '))
        .output();
    let output = output.expect("a Rust compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_rust_package_is_built_and_keeps_the_laws() {
    let place = Place::new();
    let written = place.run("effects new my-effect --stage image --rust");
    assert_eq!(written.code, Some(0), "{}", written.errors);
    let built = place.run("effects build my-effect -o my-effect.so");
    assert_eq!(built.code, Some(0), "{}", built.errors);
    let checked = place.json("effects check my-effect.so");
    assert_eq!((&checked["holds"], &checked["effect"]), (&true.into(), &"my-effect".into()), "{checked}");
    assert_eq!((&checked["remarks"], &checked["abi_version"]), (&serde_json::json!([]), &3.into()), "{checked}");
    // Nothing is written over.
    let again = place.run("effects new my-effect --stage ray --rust");
    assert!(again.code == Some(2) && again.errors.contains("Cargo.toml: is there already"), "{}", again.errors);
}
