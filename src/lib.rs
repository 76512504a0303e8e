//! misclosure: what is left over when a measurement and its model do not meet, and why.
//!
//! An image point is predicted from the camera (twelve numbers of the Fraser model), the pose of its image, the point
//! on the ground, and the *effects* that act on the way between them:
//!
//! ```text
//! P ──frame──► P' ──ray──► P'' ──R(P'' - C)──► (X, Y, Z) ──camera──► (x, y) ──image──► (x, y)'       v = measured - (x, y)'
//!                                  ▲                          ▲
//!                         exposure │                 interior │
//! ```
//!
//! An adjustment finds cameras, poses, points and effects that minimise `v'Pv`, `P` the weights. At the solution, with
//! `A` the derivatives of everything that was estimated, the [null model](null_model) says of any columns `C` that the
//! model lacks what they would explain:
//!
//! ```text
//! Q = P - P A (A'PA)^-1 A'P        s = C'Q v        M = C'Q C        drop of v'Pv: s'M^-1 s        estimate: M^-1 s
//! ```
//!
//! Everything that the diagnosis decides is small linear algebra of `(s, M)`: [`diagnose`]. Axes, rotations, units and
//! names: [`book::conventions`]; the other chapters stand in the [`book`].
//!
//! # Simulate, adjust, diagnose
//!
//! ```
//! use misclosure::adjust::{Options, ceres::Ceres, native::Native};
//! use misclosure::diagnose::{run::diagnose, settings::Settings};
//! use misclosure::{inject, model::{Datum, Model}, run, scenario};
//! use std::ops::ControlFlow;
//!
//! let scenario = scenario::Scenario::preset("dike", &[("points".to_string(), 600.0)].into())?;
//! let truth = scenario::simulate(&scenario, 1)?.block;
//! let errors = [inject::parse("rolling-shutter:readout=0.03")?, inject::parse("noise:px=0.3")?];
//! let mut block = inject::apply(&truth, &truth, &errors, 1)?.block;
//! scenario::add_survey_noise(&mut block, scenario::SurveyNoise { gnss: true, control: true, check: false }, 1);
//!
//! let model = Model { datum: Datum::All, ..Model::default() };
//! let run = run::adjust(&block, &model, &[&Ceres, &Native], &Options::default(), &mut |_, _| ControlFlow::Continue(()))?;
//! assert!(run.agreement.is_some_and(|agreement| agreement.agree));
//!
//! let settings = Settings { plugins: &[], options: Options::default(), significance: 1e-3, snoop: true, tell: &|_| {} };
//! assert_eq!(diagnose(&block, &model, &settings)?.diagnosis.recommended, ["rolling-shutter"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Which module may import which
//!
//! | module | is | imports |
//! |---|---|---|
//! | `files` | regular files, read; TOML in which values change | nothing of ours |
//! | [`math`] | rotations, statistics, intersection, variance components | nothing of ours |
//! | [`score`] | statistics of small systems of score and information | math |
//! | [`geodesy`] | coordinate systems: maps, local ones | nothing of ours |
//! | [`camera`] | the twelve numbers, projection, distortion taken out | math |
//! | [`block`] | what was measured | math, camera |
//! | [`io`] | blocks and models as files | files, math, geodesy, camera, block, model |
//! | [`effects`] | physical effects, one file each, and plug-ins | files, math, camera |
//! | [`model`] | what is believed: free parameters, effects, weights, datum | camera, block, effects |
//! | [`problem`] | block and model as flat arrays; the datum | math, camera, block, effects, model |
//! | [`measure`] | the forward model: predictions and derivatives by hand | math, camera, effects, problem |
//! | [`adjust`] | the solvers, which know nothing of each other | math, camera, effects, problem; native also measure |
//! | [`null_model`] | one linearisation at a converged fit as `(s, M)` of any columns | math, effects, model, problem, measure, adjust |
//! | [`scenario`] | error-free blocks, also of planned missions | math, geodesy, camera, block |
//! | [`mod@inject`] | errors by their cause | files, math, camera, block, scenario |
//! | [`kit`] | an effect of one's own: template, build, check, as an error | files, math, camera, block, effects, model, problem, measure, inject |
//! | [`evaluate`] | surveyed points against any block | math, camera, block |
//! | [`mistakes`] | surveyed groups against the shape that images give | math, camera, block, evaluate |
//! | [`run`] | one adjustment from end to end, and its folder | math, geodesy, camera, block, io, effects, model, problem, measure, adjust, null_model, evaluate, mistakes |
//! | [`snooping`] | data snooping: blunders, and robust fits to find them at | math, score, camera, block, model, problem, measure, adjust, null_model, evaluate, run |
//! | [`residuals`] | structure of the residuals, check points, and their pictures | math, score, camera, block, model, problem, measure, adjust, null_model, evaluate, run |
//! | [`screening`] | what people got wrong, by the shape that the tie points alone give | math, geodesy, camera, block, model, problem, measure, adjust, null_model, evaluate, mistakes, run, snooping, residuals |
//! | [`diagnose`] | which effect is missing | math, score, geodesy, camera, block, effects, model, problem, measure, adjust, null_model, evaluate, mistakes, run, snooping, residuals, screening |
//! | [`plan`] | what a block would show before it is measured | math, score, files, block, io, effects, model, problem, adjust, scenario, inject, mistakes, run, residuals, screening, diagnose |
//! | [`compare`] | runs side by side | camera, io, evaluate, diagnose, run |
//! | [`report`] | tables, pictures, the page of a run | all but io, scenario, inject, kit, study, campaign, validate, lab |
//! | [`study`] | the repetition of the study that this began with | all but snooping, residuals, screening, diagnose, campaign, validate, lab |
//! | [`campaign`] | thousands of cases from one grid, by many workers | all but kit, study, validate, lab |
//! | [`validate`] | problems with certified answers | all but snooping, residuals, screening, diagnose, kit, report, study, campaign, lab |
//! | [`book`] | the pages of `docs/` as chapters | nothing |
//! | `lab` | the laboratory, a page of this machine (feature `lab`) | all but study, campaign, validate |
//!
//! A test holds the sources against this table.

mod files;

pub mod math;

pub mod score;

pub mod geodesy;

pub mod camera;

pub mod block;

pub mod io;

pub mod effects;

pub mod model;

pub mod problem;

pub mod measure;

pub mod adjust;

pub mod null_model;

pub mod scenario;

pub mod inject;

pub mod kit;

pub mod evaluate;

pub mod mistakes;

pub mod run;

pub mod snooping;

pub mod residuals;

pub mod screening;

pub mod diagnose;

pub mod plan;

pub mod compare;

pub mod report;

pub mod study;

pub mod campaign;

pub mod validate;

#[cfg(any(doc, doctest))]
pub mod book;

#[cfg(feature = "lab")]
pub mod lab;

mod cli;

mod faults;

mod memory;

/// The program: reads the command line, runs a command, gives its exit code.
#[doc(hidden)]
pub use cli::main as program;
/// What the Python package does as the program does it; no stable interface.
#[doc(hidden)]
pub use cli::shared;
#[doc(hidden)]
pub use memory::Allocator;
