//! What both solvers give: adjustments, the effects and the injectors that they are tried on, the study, real data.

#[path = "../common/beside.rs"]
mod beside;
#[path = "../common/mod.rs"]
mod common;

mod adjust;
#[cfg(feature = "ceres")]
mod effects_derivations;
mod effects_laws;
mod effects_vectors;
mod inject;
mod real_data;
mod scenario;
mod start_values;
#[cfg(feature = "ceres")]
mod study;
mod validate;
