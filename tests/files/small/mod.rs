//! Small files of other programs, for tests of what they say and for fuzzing.

#![allow(dead_code, reason = "each test program uses a part of it")]

pub mod additions;
pub mod aicon;
pub mod metashape;
pub mod micmac;
pub mod opensfm;
pub mod photomodeler;
pub mod pix4d;
