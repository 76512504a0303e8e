//! Which physical effect is missing: residual structure, a score test for every candidate, what this block cannot tell apart, and the loop
//! that adds an effect only when it holds on measurements that the fit did not see.

pub mod candidate;
mod cells;
pub mod fit;
pub mod forward;
pub mod heldout;
mod neighbours;
pub mod outliers;
mod random;
pub mod run;
pub mod scan;
pub mod score;
pub mod structure;
mod variants;
pub mod verdict;
mod weights;
