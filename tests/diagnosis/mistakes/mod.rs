//! Mistakes of people: each is made by rewriting values as a person would, and must be named; where nobody made one,
//! none is named.

use crate::common;
mod cameras;
mod clean;
mod conventions;
mod datum;
mod few;
mod groups;
mod images;
mod made;
mod marks;
mod members;
mod mend;
mod places;
mod real;
mod verdict;
