//! Which physical effect is missing: residual structure, a score test for every candidate, what this block cannot tell apart, and the loop
//! that adds an effect only when it holds on measurements that the fit did not see.

mod augmented;
pub mod candidate;
mod cells;
mod design_effect;
pub mod fit;
pub mod forward;
pub mod heldout;
pub mod models;
mod needed;
mod neighbours;
pub mod outliers;
mod power;
mod random;
pub mod run;
pub mod scan;
pub mod score;
pub mod structure;
pub mod trial;
mod variants;
pub mod verdict;
mod weights;
