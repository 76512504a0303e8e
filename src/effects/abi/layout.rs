//! The structs of `effect.h`. Those of version 3 begin with those of version 2, to which they add fields at the end.

use super::{ABI_VERSION, RawContext};
use std::ffi::{c_char, c_int, c_void};
use std::ptr::null;

/// `misclosure_name`, the same in both versions.
#[repr(C)]
pub(super) struct RawName {
    pub name: *const c_char,
    pub value: f64,
}

/// `misclosure_parameter` of version 2.
#[repr(C)]
pub(super) struct RawParameter2 {
    pub name: *const c_char,
    pub unit: *const c_char,
    pub scope: u32,
    pub role: u32,
    pub nominal: f64,
    pub typical: f64,
    pub domain: u32,
    pub name_count: u32,
    pub domain_min: f64,
    pub domain_max: f64,
    pub names: *const RawName,
    pub deviation: *const c_char,
}

/// `misclosure_parameter`.
#[repr(C)]
pub(super) struct RawParameter {
    pub two: RawParameter2,
    pub plausible_min: f64,
    pub plausible_max: f64,
    pub plausible_source: *const c_char,
}

/// `misclosure_eval`, the same in both versions. A plug-in may throw an exception through it.
pub(super) type RawEval = unsafe extern "C-unwind" fn(
    this: *mut c_void,
    context: *const RawContext,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int;

/// `misclosure_effect` of version 2; its first five numbers are the same in every version.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct RawEffect2 {
    pub abi_version: u32,
    pub effect_size: u32,
    pub parameter_size: u32,
    pub name_size: u32,
    pub context_size: u32,
    pub stage: u32,
    pub kind: u32,
    pub parameter_count: u32,
    pub need_count: u32,
    pub id: *const c_char,
    pub summary: *const c_char,
    pub formula: *const c_char,
    pub confused_with: *const c_char,
    pub source: *const c_char,
    /// Of the version of the table: an array of [`RawParameter2`] or [`RawParameter`].
    pub parameters: *const c_void,
    pub needs: *const u32,
    pub this: *mut c_void,
    pub eval: Option<RawEval>,
}

/// `misclosure_effect`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RawEffect {
    pub(super) two: RawEffect2,
    pub(super) picture: u32,
    pub(super) picture_by: u32,
    pub(super) what: *const c_char,
    pub(super) remedy: *const c_char,
    pub(super) tell: *const c_char,
}

impl RawEffect {
    /// A table for a solver, which reads no descriptions: of `two` it has stage, number of parameters, id and formula.
    pub(super) fn for_solver(two: RawEffect2) -> Self {
        Self {
            two: RawEffect2 {
                abi_version: ABI_VERSION,
                effect_size: size_of::<RawEffect>() as u32,
                parameter_size: size_of::<RawParameter>() as u32,
                name_size: size_of::<RawName>() as u32,
                context_size: size_of::<RawContext>() as u32,
                need_count: 0,
                summary: c"".as_ptr(),
                formula: c"".as_ptr(),
                confused_with: c"".as_ptr(),
                source: c"".as_ptr(),
                parameters: null(),
                needs: null(),
                ..two
            },
            picture: 0,
            picture_by: 0,
            what: null(),
            remedy: null(),
            tell: null(),
        }
    }
}
