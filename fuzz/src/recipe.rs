//! The reader of recipes, and that of the errors that one names.

use super::folder::{said, with_files};
use misclosure::inject::{parse, recipe};

/// One input.
pub fn run(data: &[u8]) {
    with_files(&["recipe.toml"], data, |folder| match recipe::read(&folder.join("recipe.toml")) {
        Ok(recipe) => recipe.causes.iter().filter_map(|cause| parse(cause).err()).for_each(said),
        Err(error) => said(format!("{error:#}")),
    });
}
