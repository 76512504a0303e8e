//! The program as a person meets it: commands, laboratory, plug-ins, hard surroundings; and the structure of its source.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/transcript.rs"]
mod transcript;

mod book;
mod cli;
mod cli_adjust;
mod examples;
mod hostile;
mod imports;
mod kit;
#[cfg(feature = "lab")]
mod lab;
mod plugins;
