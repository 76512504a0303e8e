//! Mistakes of people: each is made by rewriting values as a person would, and must be named; where nobody made one, none is named.

#[path = "../common/mod.rs"]
mod common;

mod clean;
mod groups;
mod made;
mod members;
mod verdict;
