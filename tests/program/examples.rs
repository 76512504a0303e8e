//! The examples run, and find what they say.

#[cfg(feature = "ceres")]
#[path = "../../examples/diagnose.rs"]
mod diagnose;
#[path = "../../examples/evaluate.rs"]
mod evaluate;

#[cfg(feature = "ceres")]
#[test]
fn a_simulated_error_is_diagnosed() {
    diagnose::main().expect("examples/diagnose.rs");
}

#[test]
fn a_block_of_another_program_is_judged() {
    evaluate::main().expect("examples/evaluate.rs");
}
