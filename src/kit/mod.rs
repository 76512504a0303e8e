//! The researcher's kit: an effect of one's own, from an empty folder to an adjustment.
//!
//! ```text
//! template, formula ──► a header, or Rust package ──build──► FILE.so ──check──► every law, and what a call costs
//!                                                              └──► adjust, diagnose, improve --plugin; inject --plugin
//! ```
//!
//! Whoever uses the library needs none of this: an [`Effect`](crate::effects::Effect) of one's own enters a model as
//! [`EffectRef::Plugin`](crate::model::EffectRef), and [`laws::check`](crate::effects::laws::check) is the same check.

pub mod build;
pub mod check;
pub mod expression;
pub mod formula;
pub mod headers;
pub mod inject;
pub mod reference;
pub mod remarks;
mod stages;
pub mod template;
