//! A plug-in's table with an eye on it: which fault came first is kept, whichever solver met it.

#![allow(unsafe_code)] // the ABI

use super::guarded::{DONE, fault_of, guarded_eval};
use super::layout::{RawEffect, RawEffect2};
use super::{CEffect, RawContext};
use crate::effects::plugin::Fault;
use std::ffi::{c_int, c_void};
use std::sync::{Mutex, PoisonError};

/// An effect that keeps its first fault.
pub struct Watched {
    called: Box<Called>,
    table: Box<RawEffect>,
}

struct Called {
    effect: CEffect,
    /// Of the faults since it was last asked the one that comes first in the block.
    fault: Mutex<Option<Fault>>,
}

// SAFETY: the table is constant, and what its `this` points to is shared behind a lock.
unsafe impl Send for Watched {}
// SAFETY: as above.
unsafe impl Sync for Watched {}

impl Watched {
    /// Watches an effect.
    pub fn new(effect: CEffect) -> Self {
        let mut called = Box::new(Called { effect, fault: Mutex::new(None) });
        let this: *mut Called = &raw mut *called;
        // SAFETY: the effect's table lives as long as the effect.
        let own = unsafe { *called.effect.raw() };
        let two = RawEffect2 { this: this.cast(), eval: Some(call_watched), ..own.two };
        let table = RawEffect { two, ..own };
        Self { called, table: Box::new(table) }
    }

    /// The effect itself, unwatched.
    pub fn effect(&self) -> &CEffect {
        &self.called.effect
    }

    /// The table for C++; valid as long as `self`.
    pub fn raw(&self) -> *const RawEffect {
        &raw const *self.table
    }

    /// Keeps a fault that was met from Rust.
    pub fn note(&self, fault: Fault) {
        self.called.note(fault);
    }

    /// The fault that comes first in the block of those since the last call.
    pub fn take_fault(&self) -> Option<Fault> {
        self.called.fault.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Called {
    /// Keeps the fault that comes first in the block, whichever thread met it first.
    fn note(&self, fault: Fault) {
        let place = |fault: &Fault| (fault.image, fault.place.map(f64::to_bits));
        let mut first = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        if first.as_ref().is_none_or(|first| place(&fault) < place(first)) {
            *first = Some(fault);
        }
    }
}

/// `eval` of a [`Watched`] table.
unsafe extern "C-unwind" fn call_watched(
    this: *mut c_void,
    context: *const RawContext,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int {
    // SAFETY: C++ hands on `this` of the table, which lives as long as the table, and what effect.h states.
    let (called, context) = unsafe { (&*this.cast::<Called>(), &*context) };
    // SAFETY: arguments are handed on as they came.
    let answer = unsafe { guarded_eval(called.effect.raw(), context, input, theta, out, d_in, d_theta) };
    if answer != DONE {
        let stage = called.effect.descriptor().stage;
        // SAFETY: as many numbers as the stage has inputs, by effect.h.
        let input = unsafe { std::slice::from_raw_parts(input, stage.inputs()) };
        let place = Fault::place_of(context.column_px, context.row_px, stage, input);
        called.note(Fault { what: fault_of(answer), image: context.image, place });
    }
    answer
}
