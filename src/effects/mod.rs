//! The effect contract: what nature does to a measurement beyond the plain camera.
//!
//! An effect acts at one [`Stage`] of the measurement chain:
//!
//! ```text
//! (r, C) --exposure--> (r', C');   P --ray--> P';   (X, Y, Z) = R' (P' - C')
//! interior --interior--> interior';   (x, y) = fraser(interior', X, Y, Z) --image--> (x', y')
//! antenna: (r, C) --position--> A --frame--> A';   control and check points: P --control--> S --frame--> S'
//! ```
//!
//! Several effects of one stage act one after the other, in the order of the model. Ray effects get the pose that the
//! exposure stage made; interior effects get the image's own `r`, not the row's `r'`, so that an image has one interior
//! orientation. Two laws hold for every effect: at the nominal parameters it is exactly the identity (*null law*), and
//! it has no state and is thread-safe (*purity*).

pub mod abi;
pub mod answer;
mod common;
mod context;
mod descriptor;
pub mod formula;
pub mod laws;
pub mod literature;
mod numeric;
mod picture;
pub mod plugin;
mod registry;
mod spline;
mod stage;

// One file per effect, by name; the order of the catalogue is that of `registry.rs`.
pub mod decentring_high;
pub mod earth_curvature;
pub mod flat_port;
pub mod focal_flight;
pub mod focal_image;
pub mod focal_spline;
pub mod focal_temperature;
pub mod focal_time;
pub mod forward_motion;
pub mod gnss_delay;
pub mod gnss_drift;
pub mod gnss_lever_arm;
pub mod gnss_shift;
pub mod gravity_sag;
pub mod image_fourier;
pub mod image_grid;
pub mod local_flaw;
pub mod map_scale;
pub mod pp_flight;
pub mod pp_image;
pub mod pp_time;
pub mod radial_high;
pub mod refraction;
pub mod rolling_shutter;
pub mod unflatness;

pub use context::{BlockContext, Context, ImageContext, SurveyedKind};
pub use descriptor::{Descriptor, Domain, HALF_DIAGONAL_PX, Kind, Need, Parameter, Plausible, Role, Scope};
pub use picture::{By, Picture, Words};
pub use registry::{catalogue, find};
pub use stage::{IMAGE_INTERIOR, Stage, fill_identity};

use crate::math::lane::{LANES, Lane};
use answer::{Answer, Inputs, Thetas};

/// The effect cannot be evaluated there (outside its domain).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("outside the effect's domain")]
pub struct OutsideDomain;

/// A functional effect. Shapes: `n = stage.inputs()`, `m = stage.outputs()`, `p = parameters.len()`.
pub trait Effect: Send + Sync {
    /// What it is.
    fn descriptor(&self) -> &Descriptor;

    /// `out (m) = e(input (n), theta (p))`; where asked for, `d_input` (m x n) and `d_theta` (m x p), both row-major,
    /// are overwritten whole. Columns of `d_theta` of given parameters are zero.
    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain>;

    /// The same of eight measurements, each with its own `theta`; `input` and answer have one [`Lane`] a number. Here
    /// it asks one by one; an effect whose [`formula`] is written for any number answers them side by side. Gives the
    /// inputs on which the answers may depend otherwise than by handing them on: the columns of all others in `d_input`
    /// are those of the identity, and are not written.
    ///
    /// # Errors
    /// The place of the first that lies outside the effect's domain.
    fn eval_eight(
        &self,
        contexts: &[Context<'_>; LANES],
        input: &[Lane],
        thetas: &Thetas<'_>,
        answer: &mut Answer<'_, Lane>,
    ) -> Result<Inputs, usize> {
        answer::one_by_one(self, contexts, input, thetas, answer)
    }

    /// Which of column and row of the context the answers depend on. They are the place at which the chain ends, which
    /// the effect itself moves: whoever predicts looks for it ([`crate::measure`]), and only where an effect reads it.
    fn reads_place(&self) -> [bool; 2] {
        [false; 2]
    }

    /// Derivatives of the output (m) by column (`axis` 0) or row (1) of the context, where it
    /// [reads](Self::reads_place) it. Here they are numerical.
    fn by_place(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        axis: usize,
        derivative: &mut [f64],
    ) -> Result<(), OutsideDomain> {
        let at = |place: &[f64], out: &mut [f64]| {
            let context = Context { column_px: place[0], row_px: place[1], ..*context };
            self.eval(&context, input, theta, out, None, None)
        };
        numeric::by_place(self.descriptor(), &at, [context.column_px, context.row_px], axis, derivative)
    }

    /// The same effect behind the C ABI, for effects that came as a plug-in; `None` for built-in ones, which have a
    /// derivation in each language.
    fn c_abi(&self) -> Option<*const std::ffi::c_void> {
        None
    }

    /// A plug-in with its library's own derivatives in the place of numerical ones of its values, which cost ten times
    /// as much; `None` for every other effect. For the iterations of a solver: what these find is compared by whoever
    /// takes the numerical ones.
    fn with_own_derivatives(&self) -> Option<std::sync::Arc<dyn Effect>> {
        None
    }

    /// The file of a plug-in.
    fn origin(&self) -> Option<&plugin::Origin> {
        None
    }

    /// What a plug-in did where it gave no values, since this was last asked: an adjustment knows only that there are
    /// none.
    fn take_fault(&self) -> Option<plugin::Fault> {
        None
    }
}
