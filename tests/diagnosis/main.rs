//! What the diagnosis finds and what it does not: labelled, random and hidden blocks, blunders, mistakes, p-values.

#[path = "../common/beside.rs"]
mod beside;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/in_turn.rs"]
mod in_turn;
mod judging;

mod blunders;
mod cases;
mod check_points;
mod fresh;
mod hidden;
mod mistakes;
mod plan;
mod residuals;
mod score;
mod snooping;
