//! The score test: what it says where nothing is missing, and what it predicts where something is.

mod blocks;
mod drop;
mod null;
