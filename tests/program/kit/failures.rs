//! What goes wrong with an effect of one's own has an error that says what and where; a library's faults:
//! tests/program/plugins.

use super::place::{Place, example, prefix};
use crate::common::CHOICES;
use misclosure::effects::Stage;
use misclosure::kit::template;
use std::fs;

/// A header that compiles, with `body` as its formula.
fn with_formula(name: &str, body: &str) -> String {
    let file = template::cpp(name, Stage::Interior).expect("a template").remove(0);
    let start = file.text.find("for (int k = 0; k < 12; ++k)").expect("the formula");
    let end = file.text.find("return true;").expect("its end");
    // Without times, so that a block of any kind serves; a parameter that a free focal length does not take up.
    let text = format!("{}{body}\n    {}", &file.text[..start], &file.text[end..]);
    text.replace("std::array<Need, 1> needs = {Need::kTime}", "std::array<Need, 0> needs = {}")
        .replace("Context& context", "Context&")
}

const SOUND: &str = "for (int k = 0; k < 12; ++k) out[k] = in[k];";

#[test]
fn what_does_not_compile_is_told_by_the_compiler() {
    let place = Place::new();
    place.write("mine.h", &example("sensor-pattern.h").replace("sin(phase)", "sine(phase)"));
    place.write("mine.so", "an older one");
    let run = place.run("effects build mine.h -o mine.so");
    assert_eq!(run.code, Some(2), "{}", run.errors);
    assert!(
        run.errors.contains("mine.h: does not compile; c++ says:\n") && run.errors.contains("sine"),
        "{}",
        run.errors
    );
    assert_eq!(fs::read_to_string(place.path("mine.so")).expect("a file"), "an older one");
    assert_eq!(fs::read_dir(place.path("")).expect("a folder").count(), 2, "nothing is left lying");
}

#[test]
fn a_machine_without_a_compiler_is_told_what_to_install() {
    let place = Place::new();
    place.write("mine.h", &example("sensor-pattern.h"));
    let build = |source: &str, variable: &str| {
        let mut command = place.command(prefix().join("bin/misclosure"));
        command.args(["effects", "build", source, "-o", "mine.so"]).env(variable, "no-such-compiler");
        super::place::Run::of(command.output().expect("the program runs"))
    };
    let run = build("mine.h", "CXX");
    let expected = "`no-such-compiler` cannot be run: No such file or directory (os error 2); a C++ compiler is \
                    needed: install g++";
    assert!(run.code == Some(1) && run.errors.contains(expected), "{}", run.errors);
    fs::create_dir(place.path("package")).expect("a folder");
    place.write("package/Cargo.toml", "");
    let run = build("package", "CARGO");
    assert!(run.code == Some(1) && run.errors.contains("Rust is needed: install it with rustup"), "{}", run.errors);
    let run = place.run("effects build missing.h -o mine.so");
    assert!(run.code == Some(2) && run.errors.contains("missing.h: cannot be read: No such file"), "{}", run.errors);
}

#[test]
fn names_that_no_effect_can_have_are_refused() {
    let place = Place::new();
    for (name, expected) in
        [("Mine", "`Mine` is no name of an effect"), ("focal-time", "is an effect that is built in")]
    {
        let run = place.run(&format!("effects new {name} --stage image"));
        assert!(run.code == Some(2) && run.errors.contains(expected), "{}", run.errors);
    }
    assert_eq!(fs::read_dir(place.path("")).expect("a folder").count(), 0);
}

/// A derivative that is not that of the values: the value depends on the parameter, the number that carries derivatives
/// does not know.
#[test]
fn a_wrong_derivative_is_told_by_the_check_and_by_an_adjustment() {
    let place = Place::new();
    let slope = "if constexpr (sizeof(T) == sizeof(double)) out[0] += theta[0];\n    \
                 else out[0] += 1.1 * theta[0] - 0.1 * theta[0].a;";
    place.build("longer", &with_formula("longer", &format!("{SOUND}\n    {slope}")));
    let run = place.run("effects check longer.so");
    assert_eq!(run.code, Some(2));
    assert!(run.errors.contains("longer.so: effect `longer` breaks derivatives"), "{}", run.errors);
    assert!(run.text.contains("derivatives: output 0 by a:"), "{}", run.text);
    small_block(&place);
    // A build of one solver has nothing to compare.
    #[cfg(feature = "ceres")]
    {
        let run = place.run("adjust block -o run --plugin longer.so --add longer --fix f");
        assert_eq!(run.code, Some(4), "{}", run.errors);
        let told = run.errors.replace('\n', " ");
        assert!(told.contains("at longer.a (interior stage, image ") && told.contains(", point "), "{told}");
        assert!(told.contains("misclosure effects check FILE.so tells"), "{told}");
    }
    // Without a second solver it is held against the values.
    for solver in CHOICES.iter().filter(|choice| **choice != "both") {
        let run =
            place.run(&format!("adjust block -o {solver} --plugin longer.so --add longer --fix f --solver {solver}"));
        assert_eq!(run.code, Some(2), "{}", run.errors);
        assert!(run.errors.contains("the derivative by longer.a (interior stage, image "), "{}", run.errors);
    }
}

/// A formula that depends on more than it says, and one that names an input that the stage has not.
#[test]
fn an_input_that_reads_forgets_is_found() {
    let place = Place::new();
    let header = |reads: &str| example("sensor-pattern.h").replace("reads = {0};", &format!("reads = {{{reads}}};"));
    place.build("forgets", &header("1"));
    let run = place.run("effects check forgets.so");
    assert_eq!(run.code, Some(2));
    assert!(run.text.contains("derivatives: output 0 by input 0:"), "{}", run.text);
    place.write("beyond.h", &header("14"));
    let run = place.run("effects build beyond.h -o beyond.so");
    assert_eq!(run.code, Some(2));
    assert!(run.errors.contains("`reads` lists places among the inputs of the stage"), "{}", run.errors);
}

#[test]
fn a_fault_in_an_adjustment_is_named_with_its_image() {
    let place = Place::new();
    small_block(&place);
    // Sound at the nominal value, which is all that a loader can ask for.
    let faults = [
        ("thrower", "throw 1", "throws an exception"),
        ("nan", "out[0] *= 0.0 / 0.0", "gives a value that is not a finite number"),
    ];
    for (name, fault, expected) in faults {
        place.build(
            name,
            &with_formula(name, &format!("{SOUND}\n    if (theta[0] != 0.0) {fault};\n    out[0] += theta[0];")),
        );
        for solver in CHOICES {
            let run =
                place.run(&format!("adjust block -o run --plugin {name}.so --add {name} --fix f --solver {solver}"));
            assert_eq!(run.code, Some(3), "{}", run.errors);
            let told = format!("{name}.so: effect `{name}` (interior stage) {expected}, in image `");
            assert!(run.errors.contains(&told), "{solver}: {}", run.errors);
        }
    }
}

/// An image effect has a point too.
#[test]
fn a_fault_at_a_point_is_named_with_it() {
    let place = Place::new();
    small_block(&place);
    let header = example("sensor-pattern.h").replace("sensor-pattern", "broken");
    place.build(
        "broken",
        &header.replace("out[1] = in[1];", "out[1] = in[1];\n    if (theta[0] != 0.0 && in[0] > 3000.0) throw 1;"),
    );
    let run = place.run("improve block -o run --plugin broken.so");
    assert_ne!(run.code, Some(0), "{}", run.text);
    let told = "broken.so: effect `broken` (image stage) throws an exception, in image `";
    assert!(run.errors.contains(told) && run.errors.contains("` near point `"), "{}", run.errors);
    assert!(!run.errors.contains("internal error"), "{}", run.errors);
}

/// A close range with 60 points, noise of 0.2 px.
pub fn small_block(place: &Place) {
    use misclosure::io::block::write_block;
    let mut block = crate::common::preset("closerange", &[("points", 60.0)], 1).block;
    misclosure::scenario::add_noise(&mut block, 0.2, 1).expect("noise");
    write_block(&block, &place.path("block")).expect("a block");
}
