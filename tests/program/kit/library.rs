//! An effect of the library's user, without a plug-in.

/// The example is a test: it asserts what it says.
#[path = "../../../examples/custom_effect.rs"]
mod custom_effect;

#[test]
fn the_example_finds_its_effect() {
    custom_effect::main().expect("the example runs");
}
