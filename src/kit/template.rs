//! A commented effect to begin with, which compiles and keeps every law as it stands.

use super::stages::{Sketch, sketch};
use crate::effects::{Stage, find};

/// The contract of an effect in Rust, and the numbers of its formula, for a package of one's own.
const RUST_CONTRACT: &str = include_str!("../../rust/effect.rs");
/// What a template says of itself, for the author to replace: an effect must not go out with the words of an example.
const SUMMARY: &str = "TODO: what happens, in one sentence.";
/// See [`SUMMARY`].
const SOURCE: &str = "TODO: where the formula comes from";
/// See [`SUMMARY`].
const RANGE: &str = "TODO: where the limit comes from, a data sheet or a formula";
/// See [`SUMMARY`]: what it is, what to do about it, what would tell it from its like.
const WORDS: [&str; 3] = [
    "TODO: what it is, in two sentences for the reader of a report.",
    "TODO: what to do about it.",
    "TODO: what would tell it from effects that look like it",
];
/// See [`RUST_CONTRACT`].
const RUST_NUMBER: &str = include_str!("../../rust/number.rs");

/// A file of a template: its path inside the folder where the template is written, and its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Relative, with `/`.
    pub path: String,
    /// What is in it.
    pub text: String,
}

/// Why there is no template of a name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// Not of the form of an id.
    #[error("`{0}` is no name of an effect: expected lower case words with hyphens, as `sensor-pattern`")]
    Form(String),
    /// Taken.
    #[error("`{0}` is an effect that is built in: give yours another name")]
    Taken(String),
}

/// # Errors
/// A name that no effect can have.
pub(super) fn check_name(name: &str) -> Result<(), NameError> {
    let word = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.split('-').all(word) {
        return Err(NameError::Form(name.into()));
    }
    if find(name).is_some() { Err(NameError::Taken(name.into())) } else { Ok(()) }
}

/// `sensor-pattern` -> `SensorPatternEffect`: the suffix keeps clear of the names of the contract.
pub(super) fn type_name(name: &str) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    name.split('-').map(capital).collect::<String>() + "Effect"
}

/// A template in C++: one header.
///
/// # Errors
/// [`NameError`].
pub fn cpp(name: &str, stage: Stage) -> Result<Vec<File>, NameError> {
    check_name(name)?;
    let Sketch { values, example, formula, estimated, needs, cpp: body, .. } = sketch(stage);
    let (parameter, unit, typical, most) = estimated;
    let count = needs.len();
    let [what, remedy, tell] = WORDS;
    let needs: Vec<String> = needs.iter().map(|need| format!("Need::k{need}")).collect();
    // A parameter that is not used is a warning.
    let context = if body.contains("context") { "context" } else { "/*context*/" };
    let text = format!(
        "\
// {SUMMARY}
//
//   misclosure effects build {name}.h -o {name}.so        compiles it
//   misclosure effects check {name}.so                    does it keep the laws?
//   misclosure improve BLOCK -o RUN --plugin {name}.so    is it what a block lacks?
//
// An effect is a formula from the values without it to the values with it. Two laws: where every estimated parameter
// has its nominal value, `out` is what came in, to the last bit. The formula has no state, throws nothing and may be
// called by several threads.
#include \"effect.h\"

namespace misclosure {{

struct {type_name} {{
  static constexpr const char* id = \"{name}\";
  static constexpr Stage stage = Stage::k{stage};
  // kPhysical names a cause; kEmpirical takes a shape away, and a block that only it explains stays unexplained.
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = \"{SUMMARY}\";
  static constexpr const char* formula = \"{formula}\";
  static constexpr const char* confused_with = \"\";
  static constexpr const char* source = \"{SOURCE}\";
  // Estimated: name, unit, scope (one value in all, per camera, flight, image), nominal value, a size met in practice.
  // UpTo (on both sides of zero) and Within: what is plausible if this cause is at work, and where that comes from.
  // Given: name, unit, value: `--add {name}:NAME=VALUE` gives another. Searched and Random ones: see effect.h.
  static constexpr Parameter parameters[] = {{
      UpTo(Estimated(\"{parameter}\", \"{unit}\", Scope::kGlobal, 0.0, {typical:?}), {most:?},
           \"{RANGE}\"),
  }};
  // What it is, what to do about it, and what would tell it from its like: the report says so. `picture` chooses
  // another picture than that of the stage: see effect.h.
  static constexpr Words words = {{
      \"{what}\",
      \"{remedy}\",
      \"{tell}\"}};
  // What a block must have to test it: kTime, kTemperature, kFlights, kVelocity, kGnss, kControl, kVertical.
  static constexpr std::array<Need, {count}> needs = {{{needs}}};

  // {values}. T is double, or a number that carries derivatives: write `using std::sqrt;` and `sqrt(x)`, and branch on
  // values alone. Returns false where the formula has no meaning. `reads`, which is optional, lists the places of `in`
  // that the formula depends on, where it only hands on the others; derivatives cost less then: static constexpr
  // std::array reads = {{0, 1}};
  template <class T>
  static bool Apply(const Context& {context}, const T* in, const T* theta, T* out) {{
    // TODO: your formula in place of this example: {example}.
{body}  }}
}};
MISCLOSURE_EFFECT({type_name})

}}  // namespace misclosure
",
        type_name = type_name(name),
        stage = capitalised(stage),
        needs = needs.join(", "),
    );
    Ok(vec![File { path: format!("{name}.h"), text }])
}

/// A template in Rust: a package of its own, without dependencies.
///
/// # Errors
/// [`NameError`].
pub fn rust(name: &str, stage: Stage) -> Result<Vec<File>, NameError> {
    check_name(name)?;
    let Sketch { values, example, formula, estimated, needs, rust: body, .. } = sketch(stage);
    let (parameter, unit, typical, most) = estimated;
    let needs: Vec<String> = needs.iter().map(|need| format!("Need::{need}")).collect();
    let context = if body.contains("context") { "context" } else { "_context" };
    let [what, remedy, tell] = WORDS;
    let source = format!(
        "\
//! {SUMMARY}
//!
//!   misclosure effects build {name} -o {name}.so          compiles it
//!   misclosure effects check {name}.so                    does it keep the laws?
//!   misclosure improve BLOCK -o RUN --plugin {name}.so    is it what a block lacks?

mod effect; // the contract, a copy of this program's

use effect::*;

struct {type_name};

impl Effect for {type_name} {{
    const ID: &CStr = c\"{name}\";
    const STAGE: Stage = Stage::{stage};
    // Physical names a cause; Empirical takes a shape away, and a block that only it explains stays unexplained.
    const KIND: Kind = Kind::Physical;
    const SUMMARY: &CStr = c\"{SUMMARY}\";
    const FORMULA: &CStr = c\"{formula}\";
    const CONFUSED_WITH: &CStr = c\"\";
    const SOURCE: &CStr = c\"{SOURCE}\";
    // Estimated: name, unit, scope (one value in all, per camera, flight, image), nominal value, a size met in
    // practice. up_to (on both sides of zero) and within: what is plausible if this cause is at work, and where that
    // comes from.
    const PARAMETERS: &[Parameter] = &[
        Parameter::estimated(c\"{parameter}\", c\"{unit}\", Scope::Global, 0.0, {typical:?})
            .up_to({most:?}, c\"{RANGE}\"),
    ];
    // What it is, what to do about it, and what would tell it from its like: the report says so.
    const WORDS: Option<Words> = Some(Words {{
        what: c\"{what}\",
        remedy: c\"{remedy}\",
        tell: c\"{tell}\",
    }});
    // What a block must have to test it.
    const NEEDS: &[Need] = &[{needs}];

    // {values}. T is f64, or a number that carries derivatives; false where the formula has no meaning.
    fn apply<T: Number>({context}: &Context, input: &[T], theta: &[T], out: &mut [T]) -> bool {{
        // TODO: your formula in place of this example: {example}.
{body}    }}
}}
plugin!({type_name});
",
        type_name = type_name(name),
        stage = capitalised(stage),
        needs = needs.join(", "),
    );
    let manifest = format!(
        "\
[package]
name = \"{name}\"
version = \"0.1.0\"
edition = \"2024\"

[lib]
crate-type = [\"cdylib\"]

# A package of its own, wherever it lies.
[workspace]
"
    );
    let file = |path: &str, text: String| File { path: format!("{name}/{path}"), text };
    Ok(vec![
        file("Cargo.toml", manifest),
        file("src/lib.rs", source),
        file("src/effect.rs", RUST_CONTRACT.into()),
        file("src/number.rs", RUST_NUMBER.into()),
    ])
}

/// `exposure` -> `Exposure`.
pub(super) fn capitalised(stage: Stage) -> String {
    let name = stage.name();
    name[..1].to_uppercase() + &name[1..]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever forgets to replace a text of the example finds it by one word.
    #[test]
    fn every_text_of_the_example_is_marked() {
        for stage in Stage::ALL {
            for (language, files) in [("C++", cpp("mine", stage)), ("Rust", rust("mine", stage))] {
                let files = files.expect("a template");
                let source = files.iter().find(|file| file.path.ends_with("mine.h") || file.path.ends_with("lib.rs"));
                let text = &source.expect("a source").text;
                // Twice the summary, then source, range, three words, formula.
                assert_eq!(text.matches("TODO: ").count(), 8, "{language}, {stage:?}:\n{text}");
                assert!(!text.contains("wave") && !text.contains("sin("), "{language}, {stage:?}:\n{text}");
            }
        }
    }

    #[test]
    fn names_are_those_of_effects() {
        for name in ["", "Pattern", "a b", "-a", "a-", "a--b", "1a", "a_b", "../a"] {
            assert_eq!(cpp(name, Stage::Image), Err(NameError::Form(name.into())), "{name}");
        }
        assert_eq!(rust("focal-time", Stage::Image), Err(NameError::Taken("focal-time".into())));
        assert_eq!(type_name("sensor-pattern2"), "SensorPattern2Effect");
    }
}
