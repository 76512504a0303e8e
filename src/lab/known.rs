//! The true value of a parameter that a model estimates, from the causes that were set; or why there is none.

use crate::block::Block;
use crate::camera::{Camera, DCX, DCY, F};
use crate::effects::{Kind, Role, find};
use crate::inject::{self, Applied, Injection, Value};
use crate::math::statistics::mean;
use anyhow::Result;

/// `n - 1` of the standard atmosphere at sea level, as the cause has it.
const REFRACTIVITY: f64 = 2.77e-4;
/// Radius of the Earth that the effect has, m.
const EARTH_RADIUS: f64 = 6_371_000.0;

/// A true value, or why there is none.
pub(super) type Known = Result<f64, String>;

/// The causes of a measurement.
pub(super) struct Causes<'a> {
    truth: &'a Block,
    set: Vec<Injection>,
    applied: Vec<Applied>,
}

/// A parameter of an effect in a model.
pub(super) struct Wanted<'a> {
    /// The effect.
    pub effect: &'a str,
    /// The parameter as the run names it: `a`, `ax[flight]`, or the deviation of a random one.
    pub parameter: &'a str,
    /// Values of the effect's other parameters in the model.
    pub model: &'a dyn Fn(&str) -> Option<f64>,
}

impl<'a> Causes<'a> {
    /// The causes `errors` of a block, with what they draw at random under `seed`.
    pub(super) fn new(truth: &'a Block, errors: &[String], seed: u64) -> Result<Self> {
        let set = errors.iter().map(|text| inject::parse(text)).collect::<Result<Vec<_>>>()?;
        let applied = inject::apply(truth, truth, &set, seed)?.report.applied;
        Ok(Self { truth, set, applied })
    }

    /// The true value of a parameter.
    pub(super) fn value(&self, wanted: &Wanted<'_>) -> Known {
        let (name, element) = match wanted.parameter.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((name, element)) => (name, element),
            None => (wanted.parameter, ""),
        };
        if let Some(reason) = no_truth(wanted.effect, name) {
            return Err(reason.into());
        }
        let axis = name.get(1..2).unwrap_or_default();
        match wanted.effect {
            "rolling-shutter" => Ok(self.number("rolling-shutter", "readout")? + self.number("vibration", "readout")?),
            "forward-motion" => self.exposure(),
            "gnss-delay" => self.number("gnss-delay", "dt"),
            "gnss-lever-arm" => self.number("gnss-lever-arm", axis),
            "gnss-shift" => match self.word("gnss-shift", "flight")? {
                Some(flight) => Err(format!("only the flight {flight} is shifted: gnss-drift has a value for each")),
                None => self.number("gnss-shift", axis),
            },
            "gnss-drift" => {
                self.without("gnss-drift", &["gnss-shift"])?;
                let what = if name.starts_with('a') { "offset" } else { "drift" };
                self.drawn(
                    "gnss-drift",
                    what,
                    element,
                    ["x", "y", "z"].iter().position(|own| *own == axis).unwrap_or(0),
                )
            }
            "map-scale" => self.of_map("map-scale", wanted, "m"),
            "earth-curvature" => {
                let q = self.of_map("earth-curvature", wanted, "q")?;
                Ok(if q == 0.0 { 0.0 } else { q * EARTH_RADIUS / self.number("earth-curvature", "radius")? })
            }
            "refraction" => self.refraction(),
            "flat-port" => self.window(wanted),
            "local-flaw" => self.flaw(wanted, name),
            "radial-high" => self.radial(),
            "decentring-high" => self.decentring(name),
            "unflatness" => self.surface(name),
            "gravity-sag" => match self.word("lens-sag", "moves")?.as_deref() {
                Some("both") if matches!(name, "sx_x" | "sy_y") => self.number("lens-sag", "lateral"),
                Some("both") | None => Ok(0.0),
                Some(one) => Err(format!("only {one} moves in this simulation, the effect moves both")),
            },
            "focal-temperature" if name == "lag" => self.number("temperature-focal", "lag"),
            "focal-temperature" => match self.given("temperature-focal", "expansion")? {
                Some(parts) => Ok(parts * 1e-6 * self.one_camera()?.interior[F]),
                None => self.number("temperature-focal", "alpha"),
            },
            "focal-time" => self.without("focal-time", &["focal-growth", "temperature-focal", "focal-steps"]),
            "focal-flight" => self.step("focal-steps", "f", element),
            "focal-image" => self.number("focus-hunting", "size"),
            "pp-time" => match self.word("pp-drift", "against")?.as_deref() {
                Some("order") => Err("pp-drift follows the order of the images here, the effect their time".into()),
                _ => self.number("pp-drift", axis),
            },
            "pp-flight" => self.step("pp-steps", axis, element),
            "pp-image" => self.number("sensor-jitter", "size"),
            _ => Err("no cause of the simulation is of this kind".into()),
        }
    }

    /// The cause of an id, where it was set once.
    fn one(&self, id: &str) -> Result<Option<&Injection>, String> {
        let mut all = self.set.iter().filter(|injection| injection.cause.id() == id);
        match (all.next(), all.next()) {
            (_, Some(_)) => Err(format!("{id} was set twice")),
            (one, None) => Ok(one),
        }
    }

    fn given(&self, id: &str, key: &str) -> Result<Option<f64>, String> {
        let value = self.one(id)?.and_then(|own| own.values.iter().find(|(name, _)| *name == key));
        Ok(value.and_then(|(_, value)| if let Value::Number(number) = value { Some(*number) } else { None }))
    }

    /// A number of a cause; zero of one that was not set.
    fn number(&self, id: &str, key: &str) -> Known {
        Ok(self.given(id, key)?.unwrap_or(0.0))
    }

    fn word(&self, id: &str, key: &str) -> Result<Option<String>, String> {
        let value = self.one(id)?.and_then(|own| own.values.iter().find(|(name, _)| *name == key));
        Ok(value.and_then(|(_, value)| if let Value::Word(word) = value { Some(word.clone()) } else { None }))
    }

    /// Zero, unless a cause that acts alike was set.
    fn without(&self, effect: &str, alike: &[&str]) -> Known {
        match alike.iter().find(|id| self.set.iter().any(|own| own.cause.id() == **id)) {
            Some(cause) => Err(format!("{cause} acts here; {effect} approximates it")),
            None => Ok(0.0),
        }
    }

    /// What a cause drew at random for a flight, as its note says: numbers and their unit.
    fn drawn(&self, id: &str, what: &str, flight: &str, position: usize) -> Known {
        if self.one(id)?.is_none() {
            return Ok(0.0);
        }
        let notes = self.applied.iter().filter(|own| own.id == id).flat_map(|own| &own.notes);
        let note = notes.into_iter().find(|(name, _)| *name == format!("{what}[{flight}]"));
        let number = note.and_then(|(_, text)| text.split(' ').nth(position)?.parse().ok());
        number.ok_or_else(|| format!("{id} noted no {what} of the flight {flight}"))
    }

    /// A step of a flight; the effect has zero for the first one.
    fn step(&self, id: &str, what: &str, flight: &str) -> Known {
        let first = self.truth.flights.first().map_or("", String::as_str);
        Ok(self.drawn(id, what, flight, 0)? - self.drawn(id, what, first, 0)?)
    }

    fn exposure(&self) -> Known {
        if self.one("forward-motion")?.is_none() {
            return Ok(0.0);
        }
        if let Some(exposure) = self.given("forward-motion", "exposure")? {
            return Ok(exposure);
        }
        let mut exposures = self.truth.images.iter().filter_map(|image| image.exposure_s);
        let first = exposures.next().unwrap_or_default();
        match exposures.all(|other| other == first) {
            true => Ok(first),
            false => Err("exposure times differ between images".into()),
        }
    }

    /// Of coordinates of a map: the same ones have to be in it.
    fn of_map(&self, id: &str, wanted: &Wanted<'_>, key: &str) -> Known {
        let Some(drawn) = self.word(id, "in")? else { return Ok(0.0) };
        match given_word(wanted, "in") {
            Some(own) if own == drawn => self.number(id, key),
            own => Err(format!("the map has {drawn} here, the model says {}", own.unwrap_or_default())),
        }
    }

    /// To first order, of air whose density falls exponentially.
    fn refraction(&self) -> Known {
        let strength = self.number("refraction", "strength")?;
        if strength == 0.0 {
            return Ok(0.0);
        }
        let cameras: Vec<f64> = self.truth.images.iter().map(|image| image.pose.centre.z).collect();
        let ground: Vec<f64> = self.truth.surveyed.iter().map(|point| point.position.z).collect();
        let height = 0.5 * (mean(&cameras) + mean(&ground)) + self.number("refraction", "height")?;
        let fall = self.number("refraction", "scale_height")?;
        Ok(strength * REFRACTIVITY * (-height / fall).exp() / (2.0 * fall))
    }

    fn window(&self, wanted: &Wanted<'_>) -> Known {
        let Some(index) = self.given("flat-port", "index")? else { return Ok(0.0) };
        match (wanted.model)("n") {
            Some(own) if own == index => self.number("flat-port", "thickness"),
            own => Err(format!("the window has the index {index} here, the model {}", own.unwrap_or(f64::NAN))),
        }
    }

    fn flaw(&self, wanted: &Wanted<'_>, name: &str) -> Known {
        match self.given("local-flaw", "smooth")? {
            None if name == "lambda" => Ok(0.0),
            None => Err("no flaw was set, so it has neither place nor width".into()),
            Some(smooth) if (wanted.model)("smooth") != Some(smooth) => {
                Err("the flaw of the simulation is smooth at its centre and that of the model is not, or the reverse"
                    .into())
            }
            Some(_) => self.number("local-flaw", name),
        }
    }

    fn radial(&self) -> Known {
        match self.number("radial-high", "order")? {
            0.0 => Ok(0.0),
            9.0 => Ok(self.number("radial-high", "corner")? / self.corner_px()?.powi(9)),
            order => Err(format!("the power is {order} here, 9 in the model")),
        }
    }

    fn decentring(&self, name: &str) -> Known {
        let size = self.number("decentring-high", "corner")?;
        if size == 0.0 {
            return Ok(0.0);
        }
        let (y, x) = self.number("decentring-high", "direction_deg")?.to_radians().sin_cos();
        Ok(size * if name == "q1" { x } else { y } / (3.0 * self.corner_px()?.powi(4)))
    }

    /// In Legendre polynomials: `u v` is `P1 P1`, and `u^2` is `(2 P2 + 1) / 3`.
    fn surface(&self, name: &str) -> Known {
        if self.number("unflatness", "bump")? != 0.0 {
            return Err("the bump of the simulation is no polynomial".into());
        }
        match name {
            "c_11" => self.number("unflatness", "saddle"),
            "c_20" => Ok(2.0 / 3.0 * self.number("unflatness", "bend")?),
            _ => Ok(0.0),
        }
    }

    fn one_camera(&self) -> Result<&Camera, String> {
        match self.truth.cameras.as_slice() {
            [camera] => Ok(camera),
            _ => Err("the value differs between cameras".into()),
        }
    }

    /// Distance of the farthest corner from the centre of distortion, px.
    fn corner_px(&self) -> Known {
        let Camera { interior, width_px, height_px, .. } = self.one_camera()?;
        let farthest = |centre: f64, size: u32| centre.abs().max((f64::from(size) - centre).abs());
        Ok(farthest(interior[DCX], *width_px).hypot(farthest(interior[DCY], *height_px)))
    }
}

/// Why nothing can be true of a parameter whatever was set.
fn no_truth(effect: &str, name: &str) -> Option<&'static str> {
    let Some(effect) = find(effect) else {
        return Some("an effect of a plug-in: which cause is its own is not known here");
    };
    let descriptor = effect.descriptor();
    if descriptor.kind == Kind::Empirical {
        return Some("a shape without a cause: it has no true value");
    }
    let parameter = descriptor.parameters.iter().find(|own| own.name == name)?;
    matches!(parameter.role, Role::Given(_)).then_some("given, not estimated")
}

/// The word of a given parameter in the model.
fn given_word(wanted: &Wanted<'_>, name: &str) -> Option<String> {
    let value = (wanted.model)(name)?;
    let effect = find(wanted.effect)?;
    let parameter = effect.descriptor().parameters.iter().find(|own| own.name == name)?;
    let Role::Given(words) = &parameter.role else { return None };
    words.iter().find(|(_, own)| *own == value).map(|(word, _)| word.to_string())
}
