//! The score test: what it says where nothing is missing, and what it predicts where something is.

use crate::in_turn;
mod blocks;
mod drop;
mod null;
mod row;
