//! The bridge to `cpp/solve.h`, coarse: flat arrays cross once, one callback per iteration, results come back as
//! vectors.

#![allow(unsafe_code)] // the bridge
#![allow(missing_docs, clippy::missing_safety_doc)] // generated items

use crate::adjust::{Iteration, Progress};
use crate::effects::abi::{AbiError, CEffect, EffectHandle, RawContext, RawEffect};
use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

// SAFETY: both are `repr(C)` mirrors of the C structs of these names and hold plain data; their sizes are checked on
// both sides.
unsafe impl cxx::ExternType for RawContext {
    type Id = cxx::type_id!("misclosure_context");
    type Kind = cxx::kind::Trivial;
}
// SAFETY: as above; an address.
unsafe impl cxx::ExternType for EffectHandle {
    type Id = cxx::type_id!("misclosure_effect_handle");
    type Kind = cxx::kind::Trivial;
}

#[cxx::bridge(namespace = "misclosure::bridge")]
pub mod ffi {
    /// `misclosure::ProblemView`; lengths as stated there.
    struct View<'a> {
        interiors: &'a [f64],
        camera_scales: &'a [f64],
        camera_domains: &'a [f64],
        camera_free: &'a [u8],
        tie_dc_to_pp: bool,
        theta: &'a [f64],
        theta_scales: &'a [f64],
        theta_free: &'a [u8],
        theta_prior_index: &'a [u32],
        theta_prior_mean: &'a [f64],
        theta_prior_sigma: &'a [f64],
        effects: &'a [EffectHandle],
        effect_reads_place: &'a [u8],
        slot_start: &'a [u32],
        slot_scope: &'a [u32],
        slot_base: &'a [u32],
        contexts: &'a [RawContext],
        control_context: &'a [RawContext],
        rotations: &'a [f64],
        centres: &'a [f64],
        pose_free: &'a [u8],
        points: &'a [f64],
        point_start: &'a [u64],
        observation_image: &'a [u32],
        observation_xy: &'a [f64],
        observation_weight: &'a [f64],
        control_point: &'a [u32],
        control_position: &'a [f64],
        control_sigma: &'a [f64],
        gnss_image: &'a [u32],
        gnss_position: &'a [f64],
        gnss_sigma: &'a [f64],
        prior_camera: &'a [u32],
        prior_parameter: &'a [u32],
        prior_value: &'a [f64],
        prior_sigma: &'a [f64],
        loss: u32,
        loss_scale: f64,
    }

    /// `misclosure::SolveOptions`.
    struct SolveOptions {
        max_iterations: u32,
        chi_square_change: f64,
        threads: u32,
        linear_solver: u32,
        covariance: u32,
    }

    /// What became of a call.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    enum Status {
        Converged,
        NotConverged,
        Cancelled,
        CannotProject,
        Singular,
    }

    /// Status and what belongs to it.
    struct Report {
        status: Status,
        /// Of NotConverged and CannotProject.
        reason: String,
        /// Of CannotProject; `u64::MAX`: none.
        image: u64,
        point: u64,
        /// Of Singular: direction `d` has entries `null_start[d]..null_start[d + 1]`.
        null_start: Vec<u64>,
        null_unknowns: Vec<u64>,
        null_components: Vec<f64>,
    }

    struct SolveResult {
        report: Report,
        interiors: Vec<f64>,
        theta: Vec<f64>,
        rotations: Vec<f64>,
        centres: Vec<f64>,
        points: Vec<f64>,
        cost: f64,
        iterations: u32,
        seconds: f64,
        gradient_max: f64,
        shared_unknowns: Vec<u64>,
        shared: Vec<f64>,
        pose_covariances: Vec<f64>,
        point_covariances: Vec<f64>,
        theta_variances: Vec<f64>,
    }

    struct EvaluateResult {
        report: Report,
        residuals: Vec<f64>,
        row_start: Vec<u64>,
        columns: Vec<u64>,
        values: Vec<f64>,
    }

    struct ReduceResult {
        report: Report,
        unknowns: Vec<u64>,
        matrix: Vec<f64>,
        gradient: Vec<f64>,
    }

    struct CovarianceResult {
        report: Report,
        shared_unknowns: Vec<u64>,
        shared: Vec<f64>,
        theta_variances: Vec<f64>,
    }

    extern "Rust" {
        type Watch<'a, 'b>;
        unsafe fn iteration<'a, 'b>(
            self: &mut Watch<'a, 'b>,
            number: u32,
            cost: f64,
            gradient_max: f64,
            seconds: f64,
        ) -> bool;
    }

    unsafe extern "C++" {
        include!("bridge.h");
        include!("exceptions.h");

        #[namespace = ""]
        #[cxx_name = "misclosure_context"]
        type RawContext = crate::effects::abi::RawContext;
        #[namespace = ""]
        #[cxx_name = "misclosure_effect_handle"]
        type EffectHandle = crate::effects::abi::EffectHandle;

        unsafe fn solve<'a, 'b>(
            view: &View<'_>,
            options: &SolveOptions,
            watch: &mut Watch<'a, 'b>,
        ) -> Result<SolveResult>;
        fn evaluate(view: &View<'_>) -> Result<EvaluateResult>;
        fn reduce(view: &View<'_>) -> Result<ReduceResult>;
        fn covariance_at(view: &View<'_>) -> Result<CovarianceResult>;

        /// `refused` is called where `operator new` gets no memory; `end_by_memory` where that would end the program.
        fn watch_exceptions(refused: fn(), end_by_memory: fn());
    }
}

unsafe extern "C" {
    /// The built-in effect of this number, or null behind the last.
    safe fn misclosure_builtin(index: usize) -> *const RawEffect;
}

/// The built-in effects of C++, by the order of their file names.
///
/// # Errors
/// A table that does not fit this build.
pub fn builtin_effects() -> Result<Vec<CEffect>, AbiError> {
    (0..)
        .map(|index| misclosure_builtin(index))
        .take_while(|table| !table.is_null())
        // SAFETY: tables of effect.h that are constants of this program.
        .map(|table| unsafe { CEffect::new(table) })
        .collect()
}

/// Solves; the tables behind `view.effects` must live until this returns, which the callers in this module see to.
///
/// # Errors
/// What C++ threw.
pub fn solve(
    view: &ffi::View<'_>,
    options: &ffi::SolveOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<ffi::SolveResult, cxx::Exception> {
    // SAFETY: unsafe for its lifetimes alone; C++ keeps nothing of what it is handed.
    unsafe { ffi::solve(view, options, watch) }
}

/// Rust's end of the callback.
pub struct Watch<'a, 'b> {
    progress: &'a mut Progress<'b>,
    /// Payload of a panic in the callback.
    pub panic: Option<Box<dyn Any + Send>>,
}

impl<'a, 'b> Watch<'a, 'b> {
    /// Hands iterations to `progress`.
    pub fn new(progress: &'a mut Progress<'b>) -> Self {
        Self { progress, panic: None }
    }

    /// One iteration; false stops the solve: asked for, or because the callback panicked.
    fn iteration(&mut self, number: u32, cost: f64, gradient_max: f64, seconds: f64) -> bool {
        let iteration = Iteration { number: number as usize, cost, gradient_max, seconds };
        match catch_unwind(AssertUnwindSafe(|| (self.progress)(&iteration))) {
            Ok(flow) => flow == ControlFlow::Continue(()),
            Err(payload) => {
                self.panic = Some(payload);
                false
            }
        }
    }
}
