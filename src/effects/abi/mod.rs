//! Mirror of the C ABI in `cpp/effect.h`: effects that come as a table of C ([`CEffect`]), and effects of Rust that are
//! handed to C++ ([`RustEffect`]).

#![allow(unsafe_code)] // the ABI

mod c_effect;
mod guarded;
mod layout;
mod rust_effect;
mod table;
mod watched;

pub use c_effect::CEffect;
pub use layout::RawEffect;
pub use rust_effect::RustEffect;
pub use watched::Watched;

use super::{BlockContext, Context, ImageContext, SurveyedKind};

/// `MISCLOSURE_ABI_VERSION`.
pub const ABI_VERSION: u32 = 3;

/// The version before, whose tables are read as well: they have neither ranges nor words nor pictures.
pub const ABI_VERSION_BEFORE: u32 = 2;

/// Position of the image in the context of a control or check point, which belongs to none.
pub const NO_IMAGE: u32 = u32::MAX;

/// `misclosure_context`: [`Context`], flat.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
#[allow(missing_docs)] // fields as in Context
pub struct RawContext {
    pub image: u32,
    pub flight: u32,
    pub camera: u32,
    pub image_count: u32,
    pub flight_count: u32,
    pub camera_count: u32,
    pub width_px: f64,
    pub height_px: f64,
    pub column_px: f64,
    pub row_px: f64,
    pub time_s: f64,
    pub tau: f64,
    pub tau_order: f64,
    pub flight_time_s: f64,
    pub flight_span_s: f64,
    pub temperature_c: f64,
    pub mean_temperature_c: f64,
    pub temperature_history: *const f64,
    pub temperature_history_length: u64,
    pub velocity: [f64; 3],
    pub angular_velocity: [f64; 3],
    pub exposure_s: f64,
    pub focus_m: f64,
    pub block_centre: [f64; 3],
    pub survey_mean: [f64; 3],
    pub surveyed_kind: f64,
}

impl RawContext {
    /// Flattens; points into `context.block`, which must outlive every use of the result by C++.
    pub fn new(context: &Context<'_>) -> Self {
        let Context { block, image, column_px, row_px, surveyed } = *context;
        let [image_count, flight_count, camera_count] = block.counts;
        Self {
            image: image.image,
            flight: image.flight,
            camera: image.camera,
            image_count,
            flight_count,
            camera_count,
            width_px: image.width_px,
            height_px: image.height_px,
            column_px,
            row_px,
            time_s: image.time_s,
            tau: image.tau,
            tau_order: image.tau_order,
            flight_time_s: image.flight_time_s,
            flight_span_s: image.flight_span_s,
            temperature_c: image.temperature_c,
            mean_temperature_c: block.mean_temperature_c,
            temperature_history: block.temperature_history.as_ptr().cast(),
            temperature_history_length: block.temperature_history.len() as u64,
            velocity: image.velocity.into(),
            angular_velocity: image.angular_velocity.into(),
            exposure_s: image.exposure_s,
            focus_m: image.focus_m,
            block_centre: block.centre.into(),
            survey_mean: block.survey_centre.into(),
            surveyed_kind: surveyed.map_or(f64::NAN, |kind| f64::from(kind as u32)),
        }
    }

    /// What effects on a control or check point see: the block, no image.
    pub fn of_control(block: &BlockContext) -> Self {
        let image = ImageContext { image: NO_IMAGE, ..ImageContext::default() };
        let (column_px, row_px) = (f64::NAN, f64::NAN);
        Self::new(&Context { block, image: &image, column_px, row_px, surveyed: Some(SurveyedKind::Point) })
    }
}

/// Why a table gave no values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EvalFault {
    /// It cannot be evaluated there.
    #[error("is outside its domain")]
    Outside,
    /// A value is NaN or infinite.
    #[error("gives a value that is not a finite number")]
    NotFinite,
    /// It is to throw nothing.
    #[error("throws an exception")]
    Threw,
}

/// Address of an effect's table, as C++ takes it in arrays.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct EffectHandle(pub *const RawEffect);

/// Why a table is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AbiError {
    /// Made for another version of `effect.h`.
    #[error(
        "made for version {found} of effect.h, this program has version {ABI_VERSION} and reads \
         {ABI_VERSION_BEFORE}: compile it again"
    )]
    Version {
        /// Its version.
        found: u32,
    },
    /// A struct has another size: other compiler settings or another `effect.h`.
    #[error("struct {name} has {found} bytes, expected {expected}: compile it again with this program's effect.h")]
    Size {
        /// The struct.
        name: &'static str,
        /// In the table.
        found: u32,
        /// Here.
        expected: usize,
    },
    /// A field that has no meaning.
    #[error("{0}")]
    Field(String),
}
