//! Mirror of the C ABI in `cpp/effect.h`: effects that come as a table of C, and effects of Rust that are handed to C++.

#![allow(unsafe_code)] // the ABI

use super::*;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// `MISCLOSURE_ABI_VERSION`.
pub const ABI_VERSION: u32 = 2;

/// Parameters of an effect, names of a value and needs at most, as a count beyond is no count: five times what the largest effect of the
/// catalogue has.
const MOST: u32 = 256;

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

/// `misclosure_name`.
#[repr(C)]
struct RawName {
    name: *const c_char,
    value: f64,
}

/// `misclosure_parameter`.
#[repr(C)]
struct RawParameter {
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
    names: *const RawName,
    deviation: *const c_char,
}

type RawEval = unsafe extern "C" fn(
    this: *mut c_void,
    context: *const RawContext,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int;

unsafe extern "C" {
    /// `eval` of an effect; see `cpp/guarded.h`.
    fn misclosure_guarded_eval(
        effect: *const RawEffect,
        context: *const RawContext,
        input: *const f64,
        theta: *const f64,
        out: *mut f64,
        d_in: *mut f64,
        d_theta: *mut f64,
    ) -> c_int;
}

/// `MISCLOSURE_DONE`: what an effect answers where it has written its values.
const DONE: c_int = 1;
/// `MISCLOSURE_NOT_FINITE`.
const NOT_FINITE: c_int = 2;
/// `MISCLOSURE_THREW`.
const THREW: c_int = 3;

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

/// `misclosure_effect`.
#[repr(C)]
pub struct RawEffect {
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
    parameters: *const RawParameter,
    needs: *const u32,
    this: *mut c_void,
    eval: Option<RawEval>,
}

/// Address of an effect's table, as C++ takes it in arrays.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct EffectHandle(pub *const RawEffect);

/// Why a table is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AbiError {
    /// Made for another version of `effect.h`.
    #[error("made for version {found} of effect.h, this program has version {ABI_VERSION}: compile it again")]
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

fn field<T>(what: &str, value: Option<T>) -> Result<T, AbiError> {
    value.ok_or_else(|| AbiError::Field(format!("the effect's table has no valid {what}")))
}

/// # Safety
/// `text` is null or a C string that lives while this runs.
unsafe fn text(what: &str, text: *const c_char) -> Result<Cow<'static, str>, AbiError> {
    // SAFETY: a C string by the contract of this function.
    let text = unsafe { field(what, (!text.is_null()).then(|| CStr::from_ptr(text))) }?;
    Ok(field(what, text.to_str().ok())?.to_owned().into())
}

/// # Safety
/// `first` is null, or the first of `count` values that live while this runs.
unsafe fn array<'a, T>(what: &str, first: *const T, count: u32) -> Result<&'a [T], AbiError> {
    if count == 0 {
        return Ok(&[]);
    }
    if count > MOST {
        return Err(AbiError::Field(format!("the effect's table has {count} {what}, the most is {MOST}")));
    }
    let usable = !first.is_null() && first.is_aligned();
    // SAFETY: `count` values by the contract of this function.
    field(what, usable.then(|| unsafe { std::slice::from_raw_parts(first, count as usize) }))
}

/// # Safety
/// The pointers of `raw` are as `effect.h` states them.
unsafe fn parameter(raw: &RawParameter) -> Result<Parameter, AbiError> {
    // SAFETY: names, units and lists are C strings and arrays by the contract of this function.
    unsafe {
        let name = text("parameter name", raw.name)?;
        let scopes = [Scope::Global, Scope::Camera, Scope::Flight, Scope::FlightButFirst, Scope::Image];
        let role = match raw.role {
            0 => Role::Estimated,
            1 => Role::Searched(field(
                "search domain",
                match raw.domain {
                    1 => Some(Domain::SensorX),
                    2 => Some(Domain::SensorY),
                    3 => Some(Domain::SensorFraction(raw.domain_min, raw.domain_max)),
                    4 => Some(Domain::Range(raw.domain_min, raw.domain_max)),
                    _ => None,
                },
            )?),
            2 => {
                let mut names = Vec::new();
                for given in array("names of a given parameter", raw.names, raw.name_count)? {
                    // The trait's descriptor has static names; a plug-in is loaded once per run and its few names stay.
                    let name: &'static str =
                        Box::leak(text("name of a value", given.name)?.into_owned().into_boxed_str());
                    names.push((name, given.value));
                }
                Role::Given(names.into())
            }
            3 => Role::Random(Box::leak(text("name of a deviation", raw.deviation)?.into_owned().into_boxed_str())),
            _ => return field("role", None),
        };
        let (nominal, typical) = (raw.nominal, raw.typical);
        let sizes = nominal.is_finite() && typical.is_finite() && typical != 0.0;
        field("nominal value and typical size (finite, not zero)", sizes.then_some(()))?;
        Ok(Parameter {
            name,
            unit: text("unit", raw.unit)?,
            scope: field("scope", scopes.get(raw.scope as usize).copied())?,
            nominal,
            typical,
            role,
            plausible: None,
        })
    }
}

/// An effect behind the C ABI.
pub struct CEffect {
    raw: *const RawEffect,
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
    /// `raw` is a table as `effect.h` describes it, and it, its strings, arrays and code stay where they are for as long as the result
    /// lives.
    pub unsafe fn new(raw: *const RawEffect) -> Result<Self, AbiError> {
        field("address", (!raw.is_null() && raw.is_aligned()).then_some(()))?;
        // SAFETY: the five numbers at the front are the same in every version; nothing else is read until they are right. What is
        // read then is as effect.h states it, by the contract of this function.
        unsafe {
            let found = (&raw const (*raw).abi_version).read();
            if found != ABI_VERSION {
                return Err(AbiError::Version { found });
            }
            let sizes = [
                ("misclosure_effect", (&raw const (*raw).effect_size).read(), size_of::<RawEffect>()),
                ("misclosure_parameter", (&raw const (*raw).parameter_size).read(), size_of::<RawParameter>()),
                ("misclosure_name", (&raw const (*raw).name_size).read(), size_of::<RawName>()),
                ("misclosure_context", (&raw const (*raw).context_size).read(), size_of::<RawContext>()),
            ];
            for (name, found, expected) in sizes {
                if found as usize != expected {
                    return Err(AbiError::Size { name, found, expected });
                }
            }
            let table = &*raw;
            let parameters = array("parameters", table.parameters, table.parameter_count)?;
            let needs = [
                Need::Time,
                Need::Temperature,
                Need::Flights,
                Need::Velocity,
                Need::Gnss,
                Need::Control,
                Need::Vertical,
            ];
            let descriptor = Descriptor {
                id: text("id", table.id)?,
                stage: field("stage", Stage::ALL.get(table.stage as usize).copied())?,
                kind: field("kind", [Kind::Physical, Kind::Empirical].get(table.kind as usize).copied())?,
                summary: text("summary", table.summary)?,
                formula: text("formula", table.formula)?,
                parameters: parameters.iter().map(|raw| parameter(raw)).collect::<Result<_, _>>()?,
                needs: array("needs", table.needs, table.need_count)?
                    .iter()
                    .map(|need| field("need", needs.get(*need as usize).copied()))
                    .collect::<Result<_, _>>()?,
                confused_with: text("confused_with", table.confused_with)?,
                source: text("source", table.source)?,
            };
            field("eval", table.eval)?;
            Ok(Self { raw, descriptor })
        }
    }

    /// The table.
    pub fn raw(&self) -> *const RawEffect {
        self.raw
    }

    /// What it is.
    pub fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    /// As [`Effect::eval`], derivatives as the table gives them.
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
        // SAFETY: lengths were checked; the table's code is valid by the contract of `new`.
        let answer = unsafe {
            misclosure_guarded_eval(
                self.raw,
                &raw,
                input.as_ptr(),
                theta.as_ptr(),
                out.as_mut_ptr(),
                address(&mut d_input),
                address(&mut d_theta),
            )
        };
        match answer {
            DONE if [Some(out), d_input, d_theta].iter().flatten().all(|all| all.iter().all(|v| v.is_finite())) => {
                Ok(())
            }
            DONE | NOT_FINITE => Err(EvalFault::NotFinite),
            THREW => Err(EvalFault::Threw),
            _ => Err(EvalFault::Outside),
        }
    }
}

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
        let raw = Box::new(RawEffect {
            abi_version: ABI_VERSION,
            effect_size: size_of::<RawEffect>() as u32,
            parameter_size: size_of::<RawParameter>() as u32,
            name_size: size_of::<RawName>() as u32,
            context_size: size_of::<RawContext>() as u32,
            stage: descriptor.stage as u32,
            kind: descriptor.kind as u32,
            parameter_count: descriptor.parameters.len() as u32,
            // A solver reads no descriptions.
            need_count: 0,
            id: id.as_ptr(),
            summary: c"".as_ptr(),
            formula: c"".as_ptr(),
            confused_with: c"".as_ptr(),
            source: c"".as_ptr(),
            parameters: std::ptr::null(),
            needs: std::ptr::null(),
            this: (&raw mut *target).cast(),
            eval: Some(call_rust),
        });
        Self { raw, _id: id, _target: target }
    }

    /// The table; valid as long as `self`.
    pub fn raw(&self) -> *const RawEffect {
        &raw const *self.raw
    }
}

/// `eval` of a [`RustEffect`]; a panic is an effect outside its domain, for no panic may cross into C++.
unsafe extern "C" fn call_rust(
    this: *mut c_void,
    context: *const RawContext,
    input: *const f64,
    theta: *const f64,
    out: *mut f64,
    d_in: *mut f64,
    d_theta: *mut f64,
) -> c_int {
    let result = catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: C++ hands on `this` of the table, whose target lives as long as the table, and arrays of the lengths that effect.h
        // states.
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
