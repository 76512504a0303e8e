//! Blocks of our own simulator and injectors, drawn from a seed: causes, sizes, noise, gross errors and start values
//! that nobody chose.
//!
//! Nothing may be tuned to a single seed: the next ones are as likely.

mod causes;
mod draw;
mod judge;
mod measure;
mod scenes;
