//! Labelled blocks of an independent generator, judged by the rule that they come with.

mod judge;
mod rule;
mod truth;
