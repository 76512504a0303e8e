//! The examples run, and find what they say.

#[cfg(feature = "ceres")]
#[path = "../../examples/diagnose.rs"]
mod diagnose;
#[path = "../../examples/evaluate.rs"]
mod evaluate;
#[path = "../../examples/folder.rs"]
mod folder;

#[cfg(feature = "ceres")]
#[test]
fn a_simulated_error_is_diagnosed() {
    diagnose::main().expect("examples/diagnose.rs");
}

#[test]
fn a_block_of_another_program_is_judged() {
    evaluate::main().expect("examples/evaluate.rs");
}

#[test]
fn a_folder_is_read_and_diagnosed() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/ign-borea");
    let [mistakes, missing] = folder::verdict(folder.as_ref()).expect("examples/folder.rs");
    assert_eq!((mistakes, missing), (vec!["height-offset".to_string()], vec![]));
}
