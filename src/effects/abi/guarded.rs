//! A call of an effect that no exception leaves, and no number that is none.

use super::layout::RawEffect;
use super::{EvalFault, RawContext};
use std::ffi::c_int;

/// `MISCLOSURE_DONE`: what an effect answers where it has written its values.
pub(super) const DONE: c_int = 1;
/// `MISCLOSURE_NOT_FINITE`.
const NOT_FINITE: c_int = 2;
/// `MISCLOSURE_THREW`.
const THREW: c_int = 3;

/// What an answer that is not [`DONE`] says.
pub(super) fn fault_of(answer: c_int) -> EvalFault {
    match answer {
        NOT_FINITE => EvalFault::NotFinite,
        THREW => EvalFault::Threw,
        _ => EvalFault::Outside,
    }
}

#[cfg(feature = "ceres")]
unsafe extern "C" {
    /// `eval` of an effect; see `cpp/guarded.h`.
    #[link_name = "misclosure_guarded_eval"]
    pub(super) fn guarded_eval(
        effect: *const RawEffect,
        context: *const RawContext,
        input: *const f64,
        theta: *const f64,
        out: *mut f64,
        d_in: *mut f64,
        d_theta: *mut f64,
    ) -> c_int;
}

/// `eval` of an effect where there is no C++ to catch what it throws. A plug-in that `effect.h` makes catches it
/// itself. What another one throws, Rust cannot catch: it ends the program, and the message names the plug-ins.
///
/// # Safety
/// A table that was checked, and arrays of the lengths that `effect.h` states.
#[cfg(not(feature = "ceres"))]
pub(super) unsafe fn guarded_eval(
    effect: *const RawEffect,
    context: *const RawContext,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int {
    use crate::effects::Stage;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    // SAFETY: by the contract of this function.
    unsafe {
        let two = &(*effect).two;
        let (Some(eval), Some(stage)) = (two.eval, Stage::ALL.get(two.stage as usize)) else { return THREW };
        let call = || eval(two.this, context, input, theta, out, d_in, d_theta);
        let answer = catch_unwind(AssertUnwindSafe(call)).unwrap_or(THREW);
        if answer != DONE {
            return answer;
        }
        let (n, m, p) = (stage.inputs(), stage.outputs(), two.parameter_count as usize);
        let written = [(out, m), (d_in, m * n), (d_theta, m * p)];
        match written.into_iter().all(|(first, count)| first.is_null() || all_finite(first, count)) {
            true => DONE,
            false => NOT_FINITE,
        }
    }
}

/// Without a branch inside, so that it runs in vector registers.
#[cfg(not(feature = "ceres"))]
unsafe fn all_finite(first: *const f64, count: usize) -> bool {
    // SAFETY: by the contract of the caller.
    let values = unsafe { std::slice::from_raw_parts(first, count) };
    values.iter().map(|value| u32::from(!value.is_finite())).sum::<u32>() == 0
}
