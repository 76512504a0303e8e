//! The program as a person meets it: commands, laboratory, plug-ins, hard surroundings; and the structure of its
//! source.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/transcript.rs"]
mod transcript;

// Pages show what a build with both solvers prints.
#[cfg(feature = "ceres")]
mod book;
mod campaign;
mod cli;
#[cfg(feature = "ceres")]
mod cli_adjust;
mod config;
mod examples;
mod hostile;
mod imports;
mod kit;
#[cfg(feature = "lab")]
mod lab;
mod lines;
mod plugins;
mod sentences;
