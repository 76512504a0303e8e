//! misclosure: what is left over when a measurement and its model do not meet, and why.

pub mod math;

pub mod camera;

pub mod block;

pub mod io;

pub mod effects;

pub mod model;

pub mod problem;

pub mod measure;

pub mod adjust;

pub mod scenario;

pub mod inject;

pub mod evaluate;

pub mod run;

pub mod diagnose;

pub mod report;

pub mod study;

pub mod cli;
