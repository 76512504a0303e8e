//! Blocks to other programs' formats and back: nothing changes, files of other programs give what they say, and no file
//! makes a reader panic.

use crate::beside;
mod blocks_exchange;
mod colmap;
mod commands;
mod fixture;
mod snavely;
mod tutorial;
