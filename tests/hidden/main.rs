//! Blocks with a hidden effect: the recipes make what they state, and the program finds what they hide.

#[path = "../common/mod.rs"]
mod common;

mod derived_velocities;
mod judge;
mod models;
mod recipes;
