//! An effect of Rust behind the C ABI: what a solver in C++ gets of it.

#![allow(unsafe_code)] // the ABI

use super::layout::{RawEffect, RawEffect2};
use super::{ABI_VERSION, RawContext};
use crate::effects::{BlockContext, Context, Effect, ImageContext, SurveyedKind};
use std::ffi::{CString, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// An effect that exists in Rust alone, behind the C ABI for the length of a solve.
pub struct RustEffect<'a> {
    raw: Box<RawEffect>,
    _id: CString,
    _target: Box<Target<'a>>,
}

struct Target<'a> {
    effect: &'a dyn Effect,
    block: &'a BlockContext,
    images: &'a [ImageContext],
}

impl<'a> RustEffect<'a> {
    /// Wraps; the contexts are those that the solver's contexts were flattened from.
    pub fn new(effect: &'a dyn Effect, block: &'a BlockContext, images: &'a [ImageContext]) -> Self {
        let descriptor = effect.descriptor();
        let id = CString::new(descriptor.id.replace('\0', "")).unwrap_or_default();
        let mut target = Box::new(Target { effect, block, images });
        let raw = Box::new(RawEffect::for_solver(RawEffect2 {
            abi_version: ABI_VERSION,
            effect_size: 0,
            parameter_size: 0,
            name_size: 0,
            context_size: 0,
            stage: descriptor.stage as u32,
            kind: descriptor.kind as u32,
            parameter_count: descriptor.parameters.len() as u32,
            need_count: 0,
            id: id.as_ptr(),
            summary: std::ptr::null(),
            formula: std::ptr::null(),
            confused_with: std::ptr::null(),
            source: std::ptr::null(),
            parameters: std::ptr::null(),
            needs: std::ptr::null(),
            this: (&raw mut *target).cast(),
            eval: Some(call_rust),
        }));
        Self { raw, _id: id, _target: target }
    }

    /// The table; valid as long as `self`.
    pub fn raw(&self) -> *const RawEffect {
        &raw const *self.raw
    }
}

/// `eval` of a [`RustEffect`]; a panic is an effect outside its domain, for no panic may cross into C++.
unsafe extern "C-unwind" fn call_rust(
    this: *mut c_void,
    context: *const RawContext,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int {
    let result = catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: C++ hands on `this` of the table, whose target lives as long as the table, and arrays of the lengths
        // that effect.h states.
        unsafe {
            let target = &*this.cast::<Target<'_>>();
            let raw = &*context;
            let none = ImageContext::default();
            let image = target.images.get(raw.image as usize).unwrap_or(&none);
            let kinds = [SurveyedKind::Point, SurveyedKind::Antenna];
            let surveyed = kinds.into_iter().find(|kind| f64::from(*kind as u32) == raw.surveyed_kind);
            let (column_px, row_px) = (raw.column_px, raw.row_px);
            let context = Context { block: target.block, image, column_px, row_px, surveyed };
            let descriptor = target.effect.descriptor();
            let (n, m, p) = (descriptor.stage.inputs(), descriptor.stage.outputs(), descriptor.parameters.len());
            let matrix =
                |first: *mut f64, size: usize| (!first.is_null()).then(|| std::slice::from_raw_parts_mut(first, size));
            let theta = if p == 0 { &[] } else { std::slice::from_raw_parts(theta, p) };
            target.effect.eval(
                &context,
                std::slice::from_raw_parts(input, n),
                theta,
                std::slice::from_raw_parts_mut(out, m),
                matrix(d_in, m * n),
                matrix(d_theta, m * p),
            )
        }
    }));
    c_int::from(matches!(result, Ok(Ok(()))))
}
