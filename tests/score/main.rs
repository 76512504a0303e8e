//! The score test: what it says where nothing is missing, and what it predicts where something is.

mod blocks;
mod drop;
#[path = "../common/in_turn.rs"]
mod in_turn;
mod null;
mod row;
