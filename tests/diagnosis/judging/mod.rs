//! How labelled blocks are judged: the rule, the program as a user runs it, and the tally over many blocks.

#![allow(dead_code, reason = "each test program uses a part of it")]

pub mod program;
pub mod rule;
pub mod tally;
