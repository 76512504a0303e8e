//! Blocks with a hidden effect: the recipes make what they state, and the program finds what they hide.

mod derived_velocities;
mod exact_survey;
mod judge;
mod models;
mod recipes;
