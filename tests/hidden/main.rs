//! Blocks with a hidden effect: the recipes make what they state, and the program finds what they hide.

mod models;
mod recipes;
