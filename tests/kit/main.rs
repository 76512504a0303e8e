//! The researcher's kit: from an empty folder with the installed package alone to an effect that is found, and every way in which that can fail.

#[path = "../common/mod.rs"]
mod common;

mod examples;
mod failures;
mod injected;
mod installed;
mod library;
mod place;
mod templates;
#[path = "../common/transcript.rs"]
mod transcript;
mod worked_through;
