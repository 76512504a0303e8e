//! The pages of the repository as chapters: what the code alone does not say, in the order in which one reads it. `make
//! docs` makes a book of them, with a page for each effect and a gallery of findings.
//!
//! 0. [`start`]: a block, an error, an adjustment, a diagnosis; [`architecture`] is the map of the code.
//! 1. [`crate`]: the problem in formulas, an example, and which module does what.
//! 2. [`conventions`]: axes, rotations, residuals, units.
//! 3. [`crate::effects`]: the catalogue, one module for each effect with its formula and where that comes from.
//! 4. [`effects_of_your_own`]: one that the catalogue has not, in C++, C or Rust; [`effect_header`] is its reference,
//!    [`add_an_effect`] takes one into the catalogue, and [`what_an_effect_is_not`] says where the rest would go.
//! 5. [`crate::adjust`] and [`crate::diagnose`]: the solvers, and how a cause is told from another;
//!    [`native_solver`] and [`ceres_side`] are maps of the two, and [`how_it_decides`] explains the method.
//!    [`mistakes`] has what people get wrong, which is looked for first.
//!    [`compare_runs`] sets runs side by side.
//!    [`check_points`] says what a sentence on check points beside a verdict means.
//! 6. [`your_own_block`]: a block from another program, diagnosed and taken back; [`your_odm_project`]: one of
//!    OpenDroneMap;
//!    [`real_block`]: a mistake in a real block, and what else it shows. [`block_format`] has the files of a block,
//!    [`formats`] what each format of other programs can hold.
//! 7. [`laboratory`]: the page in which all that is done with the mouse; [`python`]: the same from notebooks.
//! 8. [`validation`]: problems whose answers are certain; [`benchmarks`]: time and memory; [`study`]: a published
//!    study, repeated.

#[doc = include_str!("../CONVENTIONS.md")]
pub mod conventions {}

// A definition of a link that comes first holds: the files' own lead from file to file.
#[doc = "[add-an-effect.md]: crate::book::add_an_effect"]
#[doc = "[effect-header.md]: crate::book::effect_header"]
#[doc = "[what-an-effect-is-not.md]: crate::book::what_an_effect_is_not"]
#[doc = ""]
#[doc = include_str!("../docs/effects-of-your-own.md")]
pub mod effects_of_your_own {}

#[doc = "[effects-of-your-own.md]: crate::book::effects_of_your_own"]
#[doc = "[effect-header.md]: crate::book::effect_header"]
#[doc = ""]
#[doc = include_str!("../docs/add-an-effect.md")]
pub mod add_an_effect {}

#[doc = "[effects-of-your-own.md]: crate::book::effects_of_your_own"]
#[doc = "[what-an-effect-is-not.md]: crate::book::what_an_effect_is_not"]
#[doc = ""]
#[doc = include_str!("../docs/effect-header.md")]
pub mod effect_header {}

#[doc = "[block-format.md]: crate::book::block_format"]
#[doc = "[how-it-decides.md]: crate::book::how_it_decides"]
#[doc = "[mistakes.md]: crate::book::mistakes"]
#[doc = "[laboratory.md]: crate::book::laboratory"]
#[doc = ""]
#[doc = include_str!("../docs/start.md")]
pub mod start {}

#[doc = "[block-format.md]: crate::book::block_format"]
#[doc = "[effects-of-your-own.md]: crate::book::effects_of_your_own"]
#[doc = "[study.md]: crate::book::study"]
#[doc = ""]
#[doc = include_str!("../docs/python.md")]
pub mod python {}

#[doc = "[ceres-side.md]: crate::book::ceres_side"]
#[doc = "[native-solver.md]: crate::book::native_solver"]
#[doc = "[how-it-decides.md]: crate::book::how_it_decides"]
#[doc = "[mistakes.md]: crate::book::mistakes"]
#[doc = ""]
#[doc = include_str!("../docs/architecture.md")]
pub mod architecture {}

#[doc = "[benchmarks.md]: crate::book::benchmarks"]
#[doc = ""]
#[doc = include_str!("../docs/native-solver.md")]
pub mod native_solver {}

#[doc = "[effects-of-your-own.md]: crate::book::effects_of_your_own"]
#[doc = "[validation.md]: crate::book::validation"]
#[doc = ""]
#[doc = include_str!("../docs/ceres-side.md")]
pub mod ceres_side {}

#[doc = include_str!("../docs/how-it-decides.md")]
pub mod how_it_decides {}

#[doc = include_str!("../docs/mistakes.md")]
pub mod mistakes {}

#[doc = include_str!("../docs/what-an-effect-is-not.md")]
pub mod what_an_effect_is_not {}

#[doc = include_str!("../docs/compare-runs.md")]
pub mod compare_runs {}

#[doc = include_str!("../docs/check-points.md")]
pub mod check_points {}

#[doc = "[formats.md]: crate::book::formats"]
#[doc = ""]
#[doc = include_str!("../docs/your-own-block.md")]
pub mod your_own_block {}

#[doc = "[your-own-block.md]: crate::book::your_own_block"]
#[doc = ""]
#[doc = include_str!("../docs/your-odm-project.md")]
pub mod your_odm_project {}

#[doc = "[mistakes.md]: crate::book::mistakes"]
#[doc = "[effects-of-your-own.md]: crate::book::effects_of_your_own"]
#[doc = ""]
#[doc = include_str!("../docs/real-block.md")]
pub mod real_block {}

#[doc = include_str!("../docs/block-format.md")]
pub mod block_format {}

#[doc = include_str!("../docs/formats.md")]
pub mod formats {}

#[doc = include_str!("../docs/laboratory.md")]
pub mod laboratory {}

#[doc = include_str!("../docs/validation.md")]
pub mod validation {}

#[doc = include_str!("../docs/benchmarks.md")]
pub mod benchmarks {}

#[doc = include_str!("../docs/study.md")]
pub mod study {}
