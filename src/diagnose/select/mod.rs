//! What sets of columns say conditional on those that are in the model: the tests behind the table of candidates.

mod beside;
mod situation;

pub use beside::{Beside, Known};
pub use situation::{Judged, Nature, Searched, Set, Situation, Taken};
