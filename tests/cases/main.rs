//! Labelled blocks of an independent generator, judged by the rule that they come with.

#[path = "../common/beside.rs"]
mod beside;
#[path = "../judging/mod.rs"]
mod judging;

mod judge;
mod rule;
mod truth;
