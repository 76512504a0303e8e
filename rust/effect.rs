//! The contract of an effect, in Rust: the mirror of `effect.h`, for a plug-in that is a package of its own.
//!
//! An effect is written once, as a formula over a [`Number`]; derivatives follow from it. `plugin!(MyEffect)` exports it. Two laws: at the
//! nominal values of its parameters an effect is exactly the identity, and it has no state and may be called from several threads at once.
//! A panic is caught and is an error that names the effect.

#![allow(dead_code)] // an effect uses a part of it

pub use std::ffi::CStr;
use std::ffi::{c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

#[path = "number.rs"] // beside this file, wherever it is
mod number;
pub use number::{Dual, Number};

/// `MISCLOSURE_ABI_VERSION` of the `effect.h` that this mirrors.
pub const ABI_VERSION: u32 = 3;

// ---------------------------------------------------------------------------------------------------------- an effect

/// Where in the measurement chain an effect acts: what it is given, and what it gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Stage {
    /// r 3 (rotation vector, world to camera), C 3 -> the same 6.
    Exposure = 0,
    /// r 3, C 3, P 3 -> P 3.
    Ray = 1,
    /// Interior 12 (f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2), r 3 -> interior 12.
    Interior = 2,
    /// x, y, interior 12 -> x, y.
    Image = 3,
    /// r 3, C 3 -> antenna 3.
    Position = 4,
    /// P 3 -> surveyed 3.
    Control = 5,
    /// Surveyed 3 -> surveyed 3, of points and of antennas.
    Frame = 6,
}

impl Stage {
    /// Number of input values.
    pub const fn inputs(self) -> usize {
        [6, 9, 15, 14, 6, 3, 3][self as usize]
    }

    /// Number of output values.
    pub const fn outputs(self) -> usize {
        [6, 3, 12, 2, 3, 3, 3][self as usize]
    }
}

/// Names a cause, or only takes a shape away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// A physical cause.
    Physical = 0,
    /// A shape without a cause.
    Empirical = 1,
}

/// How many values a parameter has in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Scope {
    /// One.
    Global = 0,
    /// One per camera.
    Camera = 1,
    /// One per flight.
    Flight = 2,
    /// One per flight, that of the first held.
    FlightButFirst = 3,
    /// One per image.
    Image = 4,
}

/// What a block must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Need {
    /// Times of the images.
    Time = 0,
    /// Temperatures of the images.
    Temperature = 1,
    /// Two flights or more.
    Flights = 2,
    /// Velocities, or times.
    Velocity = 3,
    /// GNSS in the datum.
    Gnss = 4,
    /// Control points in the datum.
    Control = 5,
    /// Either of the two.
    Vertical = 6,
}

/// In which picture an effect is seen: residuals without it and with it. One that the stage can move: `Surveyed` of the
/// control and frame stage, `Gnss` of the position and frame stage, the others of the stages that end in an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// That of the stage: row (exposure), sensor (ray, interior, image), GNSS by heading (position), surveyed (control,
    /// frame).
    OfStage,
    /// Displacement by place on the sensor.
    Sensor,
    /// Displacement along the motion, against the image row.
    Row,
    /// Radial displacement, against the distance from the principal point.
    Radius,
    /// Scale of each image.
    Scale(By),
    /// Shift of each image.
    Shift(By),
    /// GNSS residuals along the track, across and up.
    Gnss(By),
    /// Residuals of surveyed coordinates, against the distance from their centre.
    Surveyed,
}

impl Picture {
    /// `picture` and `picture_by` of a table.
    const fn numbers(self) -> [u32; 2] {
        match self {
            Self::OfStage => [0, 0],
            Self::Sensor => [1, 0],
            Self::Row => [2, 0],
            Self::Radius => [3, 0],
            Self::Scale(by) => [4, by as u32],
            Self::Shift(by) => [5, by as u32],
            Self::Gnss(by) => [6, by as u32],
            Self::Surveyed => [7, 0],
        }
    }
}

/// What a picture of images is drawn against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum By {
    /// Time of exposure.
    Time = 0,
    /// Temperature of the camera.
    Temperature = 1,
    /// Heading of the track.
    Heading = 2,
    /// Place in the block's table.
    Order = 3,
}

/// An effect in words, for somebody who flies drones and never heard the term.
#[derive(Debug, Clone, Copy)]
pub struct Words {
    /// What it is, in two sentences.
    pub what: &'static CStr,
    /// What to do about it, a sentence.
    pub remedy: &'static CStr,
    /// The flight, column or setting that would tell it from its like, without a full stop.
    pub tell: &'static CStr,
}

/// An effect: what it is called, and its formula.
pub trait Effect {
    /// Lower case words with hyphens.
    const ID: &CStr;
    /// Where it acts.
    const STAGE: Stage;
    /// Cause or shape.
    const KIND: Kind;
    /// What happens, in a sentence.
    const SUMMARY: &CStr;
    /// The formula, for people.
    const FORMULA: &CStr;
    /// Effects that look like it.
    const CONFUSED_WITH: &CStr;
    /// Literature.
    const SOURCE: &CStr;
    /// In the order of `theta`.
    const PARAMETERS: &'static [Parameter];
    /// What a block must have.
    const NEEDS: &'static [Need];
    /// What a report says of it. Without words it shows figures alone.
    const WORDS: Option<Words> = None;
    /// The picture in which a report shows it.
    const PICTURE: Picture = Picture::OfStage;

    /// Writes `out` from `input` and `theta`, whole; false where the formula has no meaning.
    fn apply<T: Number>(context: &Context, input: &[T], theta: &[T], out: &mut [T]) -> bool;
}

// ------------------------------------------------------------------------------------------------ structs of effect.h

/// Observed constants, never unknowns. NaN: not known.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Context {
    /// Positions of image, flight and camera in their lists.
    pub image: u32,
    /// See `image`.
    pub flight: u32,
    /// See `image`.
    pub camera: u32,
    /// Numbers of the block.
    pub image_count: u32,
    /// See `image_count`.
    pub flight_count: u32,
    /// See `image_count`.
    pub camera_count: u32,
    /// Sensor, px.
    pub width_px: f64,
    /// Sensor, px.
    pub height_px: f64,
    /// Predicted image point at the end of the chain, px; NaN where no effect reads it.
    pub column_px: f64,
    /// Predicted image point at the end of the chain, px; NaN where no effect reads it.
    pub row_px: f64,
    /// Exposure, s.
    pub time_s: f64,
    /// `(t - mean t) / (max t - min t)` over the block.
    pub tau: f64,
    /// The same from the place in the table.
    pub tau_order: f64,
    /// Since the flight's first image, s.
    pub flight_time_s: f64,
    /// Length of the flight, s.
    pub flight_span_s: f64,
    /// Degrees Celsius.
    pub temperature_c: f64,
    /// Mean over the block, degrees Celsius.
    pub mean_temperature_c: f64,
    temperature_history: *const f64,
    temperature_history_length: u64,
    /// m/s, world axes.
    pub velocity: [f64; 3],
    /// rad/s, camera axes.
    pub angular_velocity: [f64; 3],
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Focus distance, m.
    pub focus_m: f64,
    /// Mean of the projection centres, m.
    pub block_centre: [f64; 3],
    /// Mean of the surveyed coordinates, m.
    pub survey_mean: [f64; 3],
    /// Of a frame effect: 0 control or check point, 1 antenna; else NaN.
    pub surveyed_kind: f64,
}

impl Context {
    /// Time (s) and temperature (degrees Celsius) of the images that have both, by time.
    pub fn temperature_history(&self) -> &[[f64; 2]] {
        if self.temperature_history.is_null() {
            return &[];
        }
        // SAFETY: the caller's array of so many pairs, which outlives the call, by effect.h.
        unsafe { std::slice::from_raw_parts(self.temperature_history.cast(), self.temperature_history_length as usize) }
    }
}

#[repr(C)]
struct Name {
    name: *const c_char,
    value: f64,
}

/// A parameter of an effect.
#[repr(C)]
pub struct Parameter {
    name: *const c_char,
    unit: *const c_char,
    scope: u32,
    role: u32,
    nominal: f64,
    typical: f64,
    domain: u32,
    name_count: u32,
    domain_min: f64,
    domain_max: f64,
    names: *const Name,
    deviation: *const c_char,
    plausible_min: f64,
    plausible_max: f64,
    plausible_source: *const c_char,
}

// SAFETY: its pointers are to constants.
unsafe impl Sync for Parameter {}

impl Parameter {
    const fn new(
        name: &'static CStr,
        unit: &'static CStr,
        scope: Scope,
        role: u32,
        nominal: f64,
        typical: f64,
    ) -> Self {
        Self {
            name: name.as_ptr(),
            unit: unit.as_ptr(),
            scope: scope as u32,
            role,
            nominal,
            typical,
            domain: 0,
            name_count: 0,
            domain_min: 0.0,
            domain_max: 0.0,
            names: std::ptr::null(),
            deviation: std::ptr::null(),
            plausible_min: 0.0,
            plausible_max: 0.0,
            plausible_source: std::ptr::null(),
        }
    }

    /// The same with its plausible range: what it can be if the cause that the effect names is at work, and where that
    /// comes from; of a random parameter that of its standard deviation. Nominal and typical value lie in it.
    pub const fn within(mut self, min: f64, max: f64, source: &'static CStr) -> Self {
        self.plausible_min = min;
        self.plausible_max = max;
        self.plausible_source = source.as_ptr();
        self
    }

    /// The same, plausible up to `size` on both sides of zero.
    pub const fn up_to(self, size: f64, source: &'static CStr) -> Self {
        self.within(-size, size, source)
    }

    /// Estimated; at `nominal` nothing happens, `typical` is a size met in practice.
    pub const fn estimated(name: &'static CStr, unit: &'static CStr, scope: Scope, nominal: f64, typical: f64) -> Self {
        Self::new(name, unit, scope, 0, nominal, typical)
    }

    /// Given by the user, else `value`.
    pub const fn given(name: &'static CStr, unit: &'static CStr, value: f64) -> Self {
        Self::new(name, unit, Scope::Global, 2, value, 1.0)
    }

    /// One value per image, normal with mean zero; its standard deviation, called `deviation`, is estimated.
    pub const fn random(name: &'static CStr, unit: &'static CStr, typical: f64, deviation: &'static CStr) -> Self {
        let mut parameter = Self::new(name, unit, Scope::Image, 3, 0.0, typical);
        parameter.deviation = deviation.as_ptr();
        parameter
    }
}

type Eval =
    unsafe extern "C" fn(*mut c_void, *const Context, *const f64, *const f64, *mut f64, *mut f64, *mut f64) -> c_int;

/// `misclosure_effect`.
#[repr(C)]
pub struct Table {
    abi_version: u32,
    effect_size: u32,
    parameter_size: u32,
    name_size: u32,
    context_size: u32,
    stage: u32,
    kind: u32,
    parameter_count: u32,
    need_count: u32,
    id: *const c_char,
    summary: *const c_char,
    formula: *const c_char,
    confused_with: *const c_char,
    source: *const c_char,
    parameters: *const Parameter,
    needs: *const u32,
    this: *mut c_void,
    eval: Eval,
    picture: u32,
    picture_by: u32,
    what: *const c_char,
    remedy: *const c_char,
    tell: *const c_char,
}

// SAFETY: its pointers are to constants.
unsafe impl Sync for Table {}

impl Table {
    /// The table of an effect whose inputs and parameters are `N` together.
    pub const fn of<E: Effect, const N: usize>() -> Self {
        let [picture, picture_by] = E::PICTURE.numbers();
        let [what, remedy, tell] = match E::WORDS {
            Some(Words { what, remedy, tell }) => [what.as_ptr(), remedy.as_ptr(), tell.as_ptr()],
            None => [std::ptr::null(); 3],
        };
        Self {
            abi_version: ABI_VERSION,
            effect_size: size_of::<Table>() as u32,
            parameter_size: size_of::<Parameter>() as u32,
            name_size: size_of::<Name>() as u32,
            context_size: size_of::<Context>() as u32,
            stage: E::STAGE as u32,
            kind: E::KIND as u32,
            parameter_count: E::PARAMETERS.len() as u32,
            need_count: E::NEEDS.len() as u32,
            id: E::ID.as_ptr(),
            summary: E::SUMMARY.as_ptr(),
            formula: E::FORMULA.as_ptr(),
            confused_with: E::CONFUSED_WITH.as_ptr(),
            source: E::SOURCE.as_ptr(),
            parameters: E::PARAMETERS.as_ptr(),
            needs: E::NEEDS.as_ptr().cast(),
            this: std::ptr::null_mut(),
            eval: eval::<E, N>,
            picture,
            picture_by,
            what,
            remedy,
            tell,
        }
    }
}

/// Exports an effect as the plug-in of this library.
macro_rules! plugin {
    ($effect:ty) => {
        #[unsafe(no_mangle)]
        extern "C" fn misclosure_plugin() -> *const $crate::effect::Table {
            use $crate::effect::{Effect, Table};
            const N: usize = <$effect>::STAGE.inputs() + <$effect>::PARAMETERS.len();
            static TABLE: Table = Table::of::<$effect, N>();
            &TABLE
        }
    };
}
pub(crate) use plugin;

const OUTSIDE: c_int = 0;
const DONE: c_int = 1;
const NOT_FINITE: c_int = 2;
const THREW: c_int = 3;

/// `eval` of an effect: on numbers, or on [`Dual`]s over inputs and parameters.
unsafe extern "C" fn eval<E: Effect, const N: usize>(
    _this: *mut c_void,
    context: *const Context,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int {
    let (n, m, p) = (E::STAGE.inputs(), E::STAGE.outputs(), E::PARAMETERS.len());
    let answer = catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: arrays of these lengths, or null, by effect.h.
        let (context, input, theta, out, d_in, d_theta) = unsafe {
            let matrix = |first: *mut f64, size: usize| {
                if first.is_null() { &mut [][..] } else { std::slice::from_raw_parts_mut(first, size) }
            };
            let theta = if p == 0 { &[][..] } else { std::slice::from_raw_parts(theta, p) };
            let input = std::slice::from_raw_parts(input, n);
            (&*context, input, theta, matrix(out, m), matrix(d_in, m * n), matrix(d_theta, m * p))
        };
        if d_in.is_empty() && d_theta.is_empty() {
            if !E::apply(context, input, theta, out) {
                return OUTSIDE;
            }
        } else {
            let variable = |(k, value): (usize, &f64)| Dual::<N>::variable(*value, k);
            let inputs: Vec<_> = input.iter().enumerate().map(variable).collect();
            let parameters = theta.iter().zip(E::PARAMETERS).enumerate().map(|(k, (value, parameter))| {
                // Given ones are constants.
                if parameter.role == 2 { Dual::from(*value) } else { variable((n + k, value)) }
            });
            let parameters: Vec<_> = parameters.collect();
            let mut results = vec![Dual::from(f64::NAN); m];
            if !E::apply(context, &inputs, &parameters, &mut results) {
                return OUTSIDE;
            }
            for (i, result) in results.iter().enumerate() {
                out[i] = result.value;
                if !d_in.is_empty() {
                    d_in[i * n..(i + 1) * n].copy_from_slice(&result.slope[..n]);
                }
                if !d_theta.is_empty() {
                    d_theta[i * p..(i + 1) * p].copy_from_slice(&result.slope[n..]);
                }
            }
        }
        let finite = [&*out, &*d_in, &*d_theta].iter().all(|values| values.iter().all(|value| value.is_finite()));
        if finite { DONE } else { NOT_FINITE }
    }));
    answer.unwrap_or(THREW)
}
