//! Is a plug-in an effect? Every law of the contract, what it leaves unsaid ([`remarks`]), and what a call costs.

use super::remarks;
use crate::effects::abi::EvalFault;
use crate::effects::laws::{self, Sample, Violation, samples};
use crate::effects::plugin::{self, Origin, Plugin, PluginError};
use crate::effects::{Context, Descriptor, Effect, OutsideDomain, Role, Stage, find};
use serde::Serialize;
use std::path::Path;
use std::time::{Duration, Instant};

/// Seed of the places.
const SEED: u64 = 1;
/// Outside of the ordinary places parameters are this many times their typical size: those of a step that goes too far.
const FAR: f64 = 100.0;
/// Of a value that is computed in another order, relative.
const ROUNDING: f64 = 1e-14;
/// How long the cost of a call is measured.
const TIMED: Duration = Duration::from_millis(20);

/// One law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// Its name.
    pub law: &'static str,
    /// What it asks for.
    pub asks: &'static str,
    /// Does the effect keep it?
    pub holds: bool,
    /// What was found where it does not; else empty.
    pub found: String,
}

/// What a check found.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// What the effect says of itself.
    pub descriptor: Descriptor,
    /// The file.
    pub origin: Origin,
    /// Version of the `effect.h` that it was compiled with.
    pub version: u32,
    /// What it could say of itself and does not; no law asks for it.
    pub remarks: Vec<String>,
    /// Every law, in a fixed order.
    pub laws: Vec<Checked>,
    /// Time of a call for values alone, ns.
    pub values_ns: f64,
    /// Time of a call with derivatives, ns.
    pub derivatives_ns: f64,
}

impl Check {
    /// Does the effect keep every law?
    pub fn holds(&self) -> bool {
        self.laws.iter().all(|law| law.holds)
    }
}

/// Names of the laws, and what each asks for, in the order of a check.
pub const LAWS: [(&str, &str); 10] = [
    ("description", "sound: names, units, sizes, ranges, words, picture"),
    ("id", "no built-in effect has it"),
    ("null law", "at nominal parameters exactly the identity"),
    ("exceptions", "throws no exception, wherever it is evaluated"),
    ("finiteness", "finite values and derivatives at ordinary places"),
    ("derivatives", "those of its values"),
    ("purity", "the same call gives the same bits"),
    ("threads", "several callers at once get what one gets alone"),
    ("needs", "answers where its needs are met, and only there"),
    ("surveyed", "on surveyed points: nothing of an image"),
];

/// Checks the plug-in of a library against every law. Its derivatives are judged as its library gives them.
///
/// # Errors
/// A file that is no plug-in: there is nothing to check.
pub fn check(path: &Path) -> Result<Check, PluginError> {
    let plugin = plugin::open(path)?;
    let effect = AsWritten(&plugin);
    let of = |law: fn(&AsWritten<'_>) -> Result<(), Violation>| law(&effect).map_err(|found| found.detail);
    let kept = [
        of(|effect| laws::description(effect)),
        own_id(effect.descriptor()),
        of(|effect| laws::null_law(effect, SEED)),
        throws_nothing(&plugin),
        finite(&plugin),
        of(|effect| laws::derivatives(effect, SEED)),
        pure(&plugin),
        of(|effect| laws::threads(effect, SEED)),
        of(|effect| laws::needs(effect, SEED)),
        of(|effect| laws::surveyed(effect, SEED)),
    ];
    let laws = LAWS.into_iter().zip(kept).map(|((law, asks), kept)| Checked {
        law,
        asks,
        holds: kept.is_ok(),
        found: kept.err().unwrap_or_default(),
    });
    Ok(Check {
        descriptor: plugin.descriptor().clone(),
        origin: plugin.origin().clone(),
        version: plugin.table().version(),
        remarks: remarks::of(plugin.descriptor(), plugin.table().version()),
        laws: laws.collect(),
        values_ns: cost(&plugin, false),
        derivatives_ns: cost(&plugin, true),
    })
}

fn own_id(descriptor: &Descriptor) -> Result<(), String> {
    match find(&descriptor.id) {
        Some(_) => Err(format!("`{}` is built in: give it another", descriptor.id)),
        None => Ok(()),
    }
}

/// The ordinary places, and as many with parameters far beyond their sizes and image points beside the sensor.
fn throws_nothing(plugin: &Plugin) -> Result<(), String> {
    let near = samples(plugin, SEED);
    let far = near.iter().enumerate().map(|(k, place)| beyond(plugin.descriptor(), place.clone(), k));
    for place in far.chain(near.iter().cloned()) {
        if call(plugin, &place, true).err() == Some(EvalFault::Threw) {
            return Err(format!("{} at {place}", EvalFault::Threw));
        }
    }
    Ok(())
}

fn beyond(descriptor: &Descriptor, mut place: Sample, k: usize) -> Sample {
    for (value, parameter) in place.theta.iter_mut().zip(&descriptor.parameters) {
        if matches!(parameter.role, Role::Estimated | Role::Random(_)) {
            *value *= FAR;
        }
    }
    if descriptor.stage == Stage::Image {
        // A fifth of the sensor beside it, to each side in turn.
        let shift = 0.2 * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        place.input[0] += shift * place.image.width_px;
        place.input[1] += shift * place.image.height_px;
    }
    place
}

fn finite(plugin: &Plugin) -> Result<(), String> {
    for place in samples(plugin, SEED) {
        for derivatives in [false, true] {
            if let Err(fault) = call(plugin, &place, derivatives) {
                let what = if derivatives { ", asked for derivatives," } else { "" };
                return Err(format!("it{what} {fault}, at {place}"));
            }
        }
    }
    Ok(())
}

/// The same call gives the same bits; with and without derivatives the compiler may order the arithmetic differently.
fn pure(plugin: &Plugin) -> Result<(), String> {
    for place in samples(plugin, SEED) {
        let [values, with_derivatives] = [false, true].map(|derivatives| {
            let (first, second) = (call(plugin, &place, derivatives), call(plugin, &place, derivatives));
            if bits(&first) == bits(&second) { Ok(first) } else { Err(format!("{first:?} then {second:?} at {place}")) }
        });
        let same = match (&values?, &with_derivatives?) {
            (Ok(a), Ok(b)) => a[0].iter().zip(&b[0]).all(|(a, b)| (a - b).abs() <= ROUNDING * (1.0 + a.abs())),
            (a, b) => a.as_ref().err() == b.as_ref().err(),
        };
        if !same {
            return Err(format!("its values differ between a call with derivatives and one without, at {place}"));
        }
    }
    Ok(())
}

fn bits(answer: &Answer) -> Result<Vec<u64>, EvalFault> {
    match answer {
        Ok(all) => Ok(all.iter().flatten().map(|value| value.to_bits()).collect()),
        Err(fault) => Err(*fault),
    }
}

/// Output, derivatives by the input and by the parameters; the latter two empty where they were not asked for.
type Answer = Result<[Vec<f64>; 3], EvalFault>;

/// One call of the library.
fn call(plugin: &Plugin, place: &Sample, derivatives: bool) -> Answer {
    let (stage, p) = (plugin.descriptor().stage, place.theta.len());
    let size = if derivatives { stage.outputs() } else { 0 };
    let mut all = [stage.outputs(), size * stage.inputs(), size * p].map(|size| vec![f64::NAN; size]);
    let [out, d_input, d_theta] = &mut all;
    let (d_input, d_theta) = if derivatives { (Some(&mut d_input[..]), Some(&mut d_theta[..])) } else { (None, None) };
    plugin.table().evaluate(&place.context(), &place.input, &place.theta, out, d_input, d_theta)?;
    Ok(all)
}

/// Mean time of a call over the places, ns.
fn cost(plugin: &Plugin, derivatives: bool) -> f64 {
    let places = samples(plugin, SEED);
    let (start, mut calls) = (Instant::now(), 0_u32);
    while start.elapsed() < TIMED {
        for place in &places {
            // Whether it answers is for the laws to say.
            let _ = std::hint::black_box(call(plugin, place, derivatives));
            calls += 1;
        }
    }
    start.elapsed().as_secs_f64() * 1e9 / f64::from(calls.max(1))
}

/// The effect with the derivatives that its library gives.
struct AsWritten<'a>(&'a Plugin);

impl Effect for AsWritten<'_> {
    fn descriptor(&self) -> &Descriptor {
        self.0.descriptor()
    }

    fn reads_place(&self) -> [bool; 2] {
        self.0.reads_place()
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        self.0.table().evaluate(context, input, theta, out, d_input, d_theta).map_err(|_| OutsideDomain)
    }
}
