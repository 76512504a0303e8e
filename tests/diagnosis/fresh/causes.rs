//! Which cause of `src/inject` shows as which effect of the catalogue, and what of it is drawn.

use crate::fresh::scenes::{Kind, Scene};
use misclosure::effects::{self, Role};
use misclosure::inject::Random;
use misclosure::model::{EffectRef, EffectTerm};

/// A cause with its parameters.
#[derive(Debug, Clone)]
pub struct Cause {
    /// Id of the injection.
    pub id: &'static str,
    /// Parameters that grow with the size of the cause: what it does is proportional to them.
    pub sized: Vec<(&'static str, Vec<f64>)>,
    /// The others.
    pub fixed: Vec<(&'static str, String)>,
    /// The effect that describes it; `None` for an outsider.
    pub effect: Option<Term>,
    /// What an outsider brings along that the catalogue does describe.
    pub companion: Option<Box<Cause>>,
}

/// An effect with what the true model knows of it.
#[derive(Debug, Clone, Default)]
pub struct Term {
    /// Id of the catalogue.
    pub id: &'static str,
    /// Start values (of the searched parameters) and given ones.
    pub values: Vec<(&'static str, f64)>,
    /// Parameters that have nothing to describe, or that are known and hard to determine.
    pub held: Vec<&'static str>,
}

impl Cause {
    /// As `inject --error` takes it, the size multiplied by `factor`.
    pub fn text(&self, factor: f64) -> String {
        let list = |values: &[f64]| values.iter().map(|v| (factor * v).to_string()).collect::<Vec<_>>().join("/");
        let sized = self.sized.iter().map(|(name, values)| format!("{name}={}", list(values)));
        let fixed = self.fixed.iter().map(|(name, value)| format!("{name}={value}"));
        let parameters: Vec<String> = sized.chain(fixed).collect();
        format!("{}:{}", self.id, parameters.join(","))
    }

    /// Has it a value of its own for every image?
    pub fn is_chance(&self) -> bool {
        self.effect.as_ref().is_some_and(|term| is_random(term.id))
    }

    /// Its effect with the standard deviation of its values known, where it has one for every image.
    pub fn term_of_size(&self, factor: f64) -> Option<EffectTerm> {
        let deviation = factor * self.sized.first()?.1.first()?;
        let term = self.effect.as_ref().filter(|term| is_random(term.id))?;
        Some(Term { values: vec![("s", deviation)], ..term.clone() }.to_model())
    }

    /// Its name for people.
    pub fn name(&self) -> &'static str {
        self.effect.as_ref().map_or(self.id, |term| term.id)
    }
}

impl Term {
    /// What is held though nothing of it is zero: a place, or a lag.
    pub fn held_places(&self) -> Vec<&'static str> {
        let valued = |name: &&&str| self.values.iter().any(|(of, _)| of == *name);
        self.held.iter().filter(valued).copied().collect()
    }

    /// For a model.
    pub fn to_model(&self) -> EffectTerm {
        let effect = effects::find(self.id).unwrap_or_else(|| panic!("the catalogue has no `{}`", self.id));
        let values = self.values.iter().map(|(name, value)| (name.to_string(), *value)).collect();
        EffectTerm {
            effect: EffectRef::Builtin(effect),
            values,
            held: self.held.iter().map(|h| h.to_string()).collect(),
        }
    }
}

/// Has the effect a value of its own for every image?
pub fn is_random(id: &str) -> bool {
    let effect = effects::find(id).unwrap_or_else(|| panic!("the catalogue has no `{id}`"));
    effect.descriptor().parameters.iter().any(|parameter| matches!(parameter.role, Role::Random(_)))
}

/// Effects that a block of this kind can show: those that need what it records, and that its geometry does not hide.
const EVERYWHERE: [&str; 11] = [
    "focal-temperature",
    "focal-time",
    "focal-flight",
    "focal-image",
    "pp-time",
    "pp-flight",
    "pp-image",
    "local-flaw",
    "unflatness",
    "radial-high",
    "decentring-high",
];
const OF_A_FLIGHT: [&str; 7] =
    ["rolling-shutter", "forward-motion", "map-scale", "gnss-lever-arm", "gnss-delay", "gnss-shift", "gnss-drift"];
const OF_OBLIQUE_IMAGES: [&str; 1] = ["refraction"];
const OF_ROLLED_IMAGES: [&str; 2] = ["gravity-sag", "flat-port"];

/// Effects to draw from.
pub fn effects_of(kind: Kind) -> Vec<&'static str> {
    let more: [&[&str]; 2] = match kind {
        Kind::Dike => [&OF_A_FLIGHT, &OF_OBLIQUE_IMAGES],
        Kind::Mapping => [&OF_A_FLIGHT, &[]],
        Kind::CloseRange => [&[], &OF_ROLLED_IMAGES],
    };
    EVERYWHERE.into_iter().chain(more.into_iter().flatten().copied()).collect()
}

/// The cause of an effect, of a size that is near what a block shows; its sign, direction and place are drawn.
pub fn cause_of(effect: &'static str, scene: &Scene, random: &mut Random) -> Cause {
    let term = |values: &[(&'static str, f64)], held: &[&'static str]| {
        Some(Term { id: effect, values: values.to_vec(), held: held.to_vec() })
    };
    let plain = |id: &'static str, sized: Vec<(&'static str, Vec<f64>)>| Cause {
        id,
        sized,
        fixed: vec![],
        effect: term(&[], &[]),
        companion: None,
    };
    let sign = if random.index(2) == 0 { 1.0 } else { -1.0 };
    match effect {
        "focal-temperature" => {
            let lag = if random.index(2) == 0 { 0.0 } else { random.uniform(30.0, 200.0) };
            Cause {
                fixed: vec![("lag", lag.to_string())],
                effect: term(&[("lag", lag)], &["lag"]),
                ..plain("temperature-focal", vec![("alpha", vec![0.4 * sign])])
            }
        }
        "focal-time" => {
            Cause { effect: term(&[("against", 1.0)], &[]), ..plain("focal-growth", vec![("b", vec![2e-5 * sign])]) }
        }
        "focal-flight" => plain("focal-steps", vec![("steps", steps(5.0, scene, random))]),
        "focal-image" => plain("focus-hunting", vec![("size", vec![2.0])]),
        "pp-time" => plain("pp-drift", vec![("x", vec![normal(4.0, random)]), ("y", vec![normal(4.0, random)])]),
        "pp-flight" => plain("pp-steps", vec![("x", steps(3.0, scene, random)), ("y", steps(3.0, scene, random))]),
        "pp-image" => plain("sensor-jitter", vec![("size", vec![1.0])]),
        "gravity-sag" => Cause {
            effect: term(&[], &["sx_z", "sy_z", "sx_y", "sy_x"]),
            ..plain("lens-sag", vec![("lateral", vec![9.0])])
        },
        "flat-port" => Cause { effect: term(&[("n", 1.5)], &[]), ..plain("flat-port", vec![("thickness", vec![0.1])]) },
        "local-flaw" => local_flaw(scene, sign, random),
        "unflatness" => Cause {
            effect: term(&[], &["c_02", "c_03", "c_04", "c_12", "c_13", "c_21", "c_22", "c_30", "c_31", "c_40"]),
            ..plain("unflatness", vec![("saddle", vec![normal(2.0, random)]), ("bend", vec![normal(2.0, random)])])
        },
        "radial-high" => plain("radial-high", vec![("corner", vec![12.0 * sign])]),
        "decentring-high" => Cause {
            fixed: vec![("direction_deg", random.uniform(0.0, 360.0).to_string())],
            ..plain("decentring-high", vec![("corner", vec![16.0])])
        },
        "rolling-shutter" => plain("rolling-shutter", vec![("readout", vec![0.005 * sign])]),
        "forward-motion" => plain("forward-motion", vec![("exposure", vec![0.02])]),
        "refraction" => Cause {
            // An air that thins out within the height of the flight: a standard one would show in no block of this
            // size.
            fixed: vec![("scale_height", "1000".into())],
            ..plain("refraction", vec![("strength", vec![60.0])])
        },
        "map-scale" => plain("map-scale", vec![("m", vec![5e-4 * sign])]),
        "gnss-lever-arm" => plain(
            "gnss-lever-arm",
            vec![("x", vec![normal(0.1, random)]), ("y", vec![normal(0.1, random)]), ("z", vec![normal(0.1, random)])],
        ),
        "gnss-delay" => plain("gnss-delay", vec![("dt", vec![0.01 * sign])]),
        "gnss-shift" => plain(
            "gnss-shift",
            vec![
                ("x", vec![normal(0.05, random)]),
                ("y", vec![normal(0.05, random)]),
                ("z", vec![normal(0.1, random)]),
            ],
        ),
        "gnss-drift" => plain("gnss-drift", vec![("offset_m", vec![0.1]), ("rate", vec![5e-4])]),
        other => panic!("no cause of `{other}`"),
    }
}

fn normal(scale: f64, random: &mut Random) -> f64 {
    scale * random.normal()
}

/// One value by flight, zero for the first.
fn steps(scale: f64, scene: &Scene, random: &mut Random) -> Vec<f64> {
    (0..scene.flights()).map(|flight| if flight == 0 { 0.0 } else { normal(scale, random) }).collect()
}

/// Somewhere on the sensor, but not so near its edge that most of it lies outside.
fn local_flaw(scene: &Scene, sign: f64, random: &mut Random) -> Cause {
    let [width, height] = scene.sensor_px();
    let centre = [random.uniform(0.15, 0.85) * width, random.uniform(0.15, 0.85) * height];
    let sigma = random.uniform(0.06, 0.16) * width;
    let smooth = random.index(2) as f64;
    Cause {
        id: "local-flaw",
        sized: vec![("lambda", vec![1.5 * sign])],
        fixed: vec![
            ("centre_x", centre[0].to_string()),
            ("centre_y", centre[1].to_string()),
            ("sigma", sigma.to_string()),
            ("smooth", smooth.to_string()),
        ],
        effect: Some(Term {
            id: "local-flaw",
            values: vec![("centre_x", centre[0]), ("centre_y", centre[1]), ("sigma", sigma), ("smooth", smooth)],
            // A sharp flaw jumps at its centre, where a fit of the place can stop.
            held: if smooth == 0.0 { vec!["centre_x", "centre_y"] } else { vec![] },
        }),
        companion: None,
    }
}

/// A cause that no catalogue knows.
pub fn outsider(scene: &Scene, random: &mut Random) -> Cause {
    let moves = scene.kind != Kind::CloseRange;
    if moves && random.index(2) == 0 { vibration(random) } else { stitch(random) }
}

/// Displaced pixels, in waves that are too short for any of the smooth effects.
fn stitch(random: &mut Random) -> Cause {
    let axis = ["both", "x", "y"][random.index(3)];
    let wavelength = random.uniform(250.0, 700.0);
    Cause {
        id: "sensor-stitch",
        sized: vec![("amplitude", vec![0.15])],
        fixed: vec![("wavelength", wavelength.to_string()), ("axis", axis.into())],
        effect: None,
        companion: None,
    }
}

/// A shaking camera, some periods while the rows of an image are read; the readout shows as a rolling shutter.
fn vibration(random: &mut Random) -> Cause {
    let readout = random.uniform(0.002, 0.005);
    let periods = random.uniform(1.5, 5.0);
    let shutter = Cause {
        id: "rolling-shutter",
        sized: vec![],
        fixed: vec![("readout", readout.to_string())],
        effect: Some(Term { id: "rolling-shutter", ..Term::default() }),
        companion: None,
    };
    Cause {
        id: "vibration",
        sized: vec![("angle", vec![1e-4])],
        fixed: vec![("frequency", (periods / readout).to_string()), ("readout", readout.to_string())],
        effect: None,
        companion: Some(Box::new(shutter)),
    }
}
