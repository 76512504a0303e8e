//! Effects of the model: what they need of the block, and their values in `theta`.

use super::{EffectInstance, Problem, ProblemError, State, ThetaEntry};
use crate::block::{Block, Role};
use crate::camera::Camera;
use crate::effects::{self, ImageContext, Need, Scope};
use crate::model::{Datum, EffectTerm, PRIOR_KEY};

/// What of an effect's needs the block lacks under a datum; `None`: it can be tested.
pub fn missing_need(block: &Block, contexts: &[ImageContext], need: Need, datum: Datum) -> Option<&'static str> {
    let known = |value: fn(&ImageContext) -> f64| contexts.iter().all(|context| !value(context).is_nan());
    let controls = block.count(Role::Control) > 0;
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    let uses_control = controls && matches!(datum, Datum::Control | Datum::All);
    let uses_gnss = gnss && matches!(datum, Datum::Gnss | Datum::All);
    let (met, what) = match need {
        Need::Time => (known(|c| c.time_s), "time_s of every image"),
        Need::Temperature => (known(|c| c.temperature_c), "temperature_c of every image"),
        Need::Flights => (block.flights.len() > 1, "at least two flights"),
        Need::Velocity => (known(|c| c.velocity.x), "vx, vy, vz, or times of at least two images of every flight"),
        Need::Gnss => (uses_gnss, "GNSS positions, in a datum that uses them"),
        Need::Control => (uses_control, "control points, in a datum that uses them"),
        Need::Vertical => (uses_control || uses_gnss, "a datum that is not free"),
    };
    (!met).then_some(what)
}

/// Value of the option `against` that takes an image's place in the table instead of its time.
const AGAINST_ORDER: f64 = 1.0;

/// Standard deviation (m/s) from which the error of a velocity is estimated: a micrometre a second moves no image
/// point.
const LEAST_VELOCITY_SIGMA: f64 = 1e-6;

/// How many values a parameter has in a block: lens and sensor are a camera's own, so where there are several cameras,
/// each has its own value of an effect of interior orientation or image.
fn scope_in(block: &Block, stage: effects::Stage, parameter: &effects::Parameter) -> Scope {
    let of_camera = matches!(stage, effects::Stage::Interior | effects::Stage::Image);
    let given = matches!(parameter.role, effects::Role::Given(_));
    if of_camera && !given && parameter.scope == Scope::Global && block.cameras.len() > 1 {
        Scope::Camera
    } else {
        parameter.scope
    }
}

impl Problem {
    /// This problem at `state` with further effects at their start values (absent: nominal), numbered after those that
    /// it has.
    pub fn with_effects(
        &self,
        block: &Block,
        datum: Datum,
        terms: &[EffectTerm],
        state: &State,
    ) -> Result<(Problem, State), ProblemError> {
        let mut problem = self.clone();
        problem.start = state.clone();
        for term in terms {
            problem.add_effect(block, datum, term)?;
        }
        let state = problem.start.clone();
        Ok((problem, state))
    }

    /// Adds an effect: its values in `theta`, start values from the term.
    pub(super) fn add_effect(&mut self, block: &Block, datum: Datum, term: &EffectTerm) -> Result<(), ProblemError> {
        let descriptor = term.effect.descriptor();
        for need in &descriptor.needs {
            // An option may make a need void: focal-time against the order of images needs no times.
            let void = *need == Need::Time && term.values.get("against") == Some(&AGAINST_ORDER);
            if let Some(needs) = missing_need(block, &self.image_contexts, *need, datum).filter(|_| !void) {
                return Err(ProblemError::Need { effect: descriptor.id.to_string(), needs });
            }
        }
        let mut known: Vec<String> = Vec::new();
        let mut slots = Vec::new();
        let effect = self.effects.len() as u32;
        for (p, parameter) in descriptor.parameters.iter().enumerate() {
            let scope = scope_in(block, descriptor.stage, parameter);
            slots.push((scope, self.theta.len() as u32));
            let names: Vec<Option<&str>> = match scope {
                Scope::Global => vec![None],
                Scope::Camera => block.cameras.iter().map(|camera| Some(camera.id.as_str())).collect(),
                Scope::Flight | Scope::FlightButFirst => block.flights.iter().map(|name| Some(name.as_str())).collect(),
                Scope::Image => block.images.iter().map(|image| Some(image.name.as_str())).collect(),
            };
            let typical = |instance: usize| parameter.typical_on(half_diagonal_px(block, scope, instance));
            let given = matches!(parameter.role, effects::Role::Given(_));
            let weak = term.values.get(PRIOR_KEY).filter(|_| parameter.role == effects::Role::Estimated);
            let prior_sigma = match &parameter.role {
                effects::Role::Random(sigma) => {
                    known.push((*sigma).to_string());
                    let value = term.values.get(*sigma).copied().unwrap_or(parameter.typical);
                    if value.is_nan() || value <= 0.0 {
                        return Err(ProblemError::Value(format!(
                            "effect `{}`: {sigma} is a standard deviation, expected above 0, got {value}",
                            descriptor.id
                        )));
                    }
                    Some(value)
                }
                _ => weak.map(|factor| factor * typical(0)),
            };
            let is_velocity_error = parameter.role == effects::Role::VelocityError;
            for (instance, name) in names.iter().enumerate() {
                let short = name.map_or_else(|| parameter.name.to_string(), |n| format!("{}[{n}]", parameter.name));
                let of_term = term.values.get(&short).or_else(|| term.values.get(parameter.name.as_ref()));
                let own_sigma = is_velocity_error.then(|| self.image_contexts[instance].velocity_sigma);
                let exact = own_sigma.is_some_and(|sigma| sigma.is_nan() || sigma < LEAST_VELOCITY_SIGMA);
                let reference = scope == Scope::FlightButFirst && instance == 0;
                let held = term.held.iter().any(|name| *name == parameter.name || *name == short);
                // A camera that no oriented image was taken with says nothing of its own values.
                let idle = scope == Scope::Camera && !self.used_camera(instance as u32);
                // A random effect's typical size is that of its standard deviation.
                let start = if reference {
                    parameter.nominal
                } else {
                    *of_term.unwrap_or(&self.nominal(parameter, scope, instance as u32))
                };
                self.start.theta.push(start);
                self.theta.push(ThetaEntry {
                    effect,
                    parameter: p as u32,
                    instance: instance as u32,
                    name: format!("{}.{short}", descriptor.id),
                    free: !given && !held && !reference && !idle && !exact,
                    scale: typical(instance),
                    prior_sigma: own_sigma.or(prior_sigma).filter(|_| !held && !exact),
                    prior_mean: parameter.nominal,
                });
                known.push(short);
            }
            known.push(parameter.name.to_string());
        }
        known.push(PRIOR_KEY.to_string());
        if let Some(factor) = term.values.get(PRIOR_KEY).filter(|factor| factor.is_nan() || **factor <= 0.0) {
            let text = format!("effect `{}`: {PRIOR_KEY} is {factor}, expected above 0", descriptor.id);
            return Err(ProblemError::Value(text));
        }
        let unknown = term.values.keys().chain(&term.held).find(|name| !known.contains(name));
        if let Some(name) = unknown {
            let names: Vec<&str> = descriptor.parameters.iter().map(|p| p.name.as_ref()).collect();
            let hint = format!("; effect `{}` has {}", descriptor.id, names.join(", "));
            return Err(ProblemError::Unknown { kind: "parameter", name: name.clone(), hint });
        }
        self.effects.push(EffectInstance { effect: term.effect.clone(), slots });
        Ok(())
    }

    fn used_camera(&self, camera: u32) -> bool {
        let mut images = self.image_contexts.iter().zip(&self.pose_free);
        images.any(|(context, free)| context.camera == camera && *free != [false; 6])
    }

    /// Default of a parameter; one that is searched on the sensor starts in the middle of its domain.
    fn nominal(&self, parameter: &effects::Parameter, scope: Scope, instance: u32) -> f64 {
        match &parameter.role {
            effects::Role::Searched(effects::Domain::Range(..)) => parameter.nominal,
            effects::Role::Searched(domain) => {
                self.bounds(domain, scope, instance).map_or(parameter.nominal, |(low, high)| 0.5 * (low + high))
            }
            _ => parameter.nominal,
        }
    }

    /// Bounds of a domain on a camera's sensor (the first image's where all share a value); `None` without images.
    fn bounds(&self, domain: &effects::Domain, scope: Scope, instance: u32) -> Option<(f64, f64)> {
        let own = |context: &&ImageContext| scope != Scope::Camera || context.camera == instance;
        let context = self.image_contexts.iter().find(own)?;
        Some(domain.bounds(context.width_px, context.height_px))
    }

    /// Least and largest value of a searched parameter, the entry `t` of `theta`, in its unit; `None` for any other.
    pub fn searched_bounds(&self, t: usize) -> Option<(f64, f64)> {
        let entry = &self.theta[t];
        let of = &self.effects[entry.effect as usize];
        let effects::Role::Searched(domain) = &of.effect.descriptor().parameters[entry.parameter as usize].role else {
            return None;
        };
        self.bounds(domain, of.slots[entry.parameter as usize].0, entry.instance)
    }
}

/// Half the diagonal of the sensor that a value is of: its camera's, or where all cameras share it the largest.
fn half_diagonal_px(block: &Block, scope: Scope, instance: usize) -> f64 {
    match scope {
        Scope::Camera => block.cameras[instance].half_diagonal_px(),
        _ => block.cameras.iter().map(Camera::half_diagonal_px).fold(0.0, f64::max),
    }
}
