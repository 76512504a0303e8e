//! An effect that comes as a table of C: what the table says is checked before the first call ([`super::table`]).

#![allow(unsafe_code)] // the ABI

use super::guarded::{DONE, fault_of, guarded_eval};
use super::layout::RawEffect;
use super::{ABI_VERSION, AbiError, EvalFault, RawContext, table};
use crate::effects::{Context, Descriptor};

/// An effect behind the C ABI.
pub struct CEffect {
    /// The library's own.
    raw: *const RawEffect,
    /// What solvers get in its place where it is of an older version, and thus shorter than the layout that they know.
    lifted: Option<Box<RawEffect>>,
    version: u32,
    descriptor: Descriptor,
}

// SAFETY: the table is constant and `eval` is thread-safe by the second law of effect.h.
unsafe impl Send for CEffect {}
// SAFETY: as above.
unsafe impl Sync for CEffect {}

impl CEffect {
    /// Checks version and sizes, then reads the table.
    ///
    /// # Errors
    /// What is wrong with the table.
    ///
    /// # Safety
    /// `raw` is a table as `effect.h` of its version describes it, and it, its strings, arrays and code stay where they
    /// are for as long as the result lives.
    pub unsafe fn new(raw: *const RawEffect) -> Result<Self, AbiError> {
        // SAFETY: by the contract of this function.
        let table::Table { version, two, descriptor } = unsafe { table::read(raw) }?;
        let lifted = (version != ABI_VERSION).then(|| Box::new(RawEffect::for_solver(two)));
        Ok(Self { raw, lifted, version, descriptor })
    }

    /// The table, in the layout of this program; that of an older version lives as long as `self`.
    pub fn raw(&self) -> *const RawEffect {
        self.lifted.as_deref().map_or(self.raw, std::ptr::from_ref)
    }

    /// Version of the `effect.h` that it was compiled with.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// What it is.
    pub fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    /// As [`Effect::eval`](crate::effects::Effect::eval), derivatives as the table gives them.
    ///
    /// # Errors
    /// Why there are no values.
    ///
    /// # Panics
    /// If a slice has not the length that stage and parameters ask for.
    pub fn evaluate(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), EvalFault> {
        let (n, m, p) =
            (self.descriptor.stage.inputs(), self.descriptor.stage.outputs(), self.descriptor.parameters.len());
        assert_eq!(
            (input.len(), theta.len(), out.len()),
            (n, p, m),
            "input, theta and output of {}",
            self.descriptor.id
        );
        assert!(d_input.as_ref().is_none_or(|d| d.len() == m * n) && d_theta.as_ref().is_none_or(|d| d.len() == m * p));
        let raw = RawContext::new(context);
        let address = |d: &mut Option<&mut [f64]>| d.as_mut().map_or(std::ptr::null_mut(), |d| d.as_mut_ptr());
        let mut d_input = d_input;
        let mut d_theta = d_theta.filter(|d| !d.is_empty());
        // The call looks at what comes back: every number of a result is finite. SAFETY: lengths were checked; the
        // table's code is valid by the contract of `new`.
        let answer = unsafe {
            guarded_eval(
                self.raw(),
                &raw,
                input.as_ptr(),
                theta.as_ptr(),
                out.as_mut_ptr(),
                address(&mut d_input),
                address(&mut d_theta),
            )
        };
        if answer == DONE { Ok(()) } else { Err(fault_of(answer)) }
    }
}
