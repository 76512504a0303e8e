//! What an effect says of itself: parameters, what it needs of a block, what it is confused with.

use super::{Picture, Stage, Words};
use std::borrow::Cow;

/// Names a cause, or only takes a shape away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A physical cause.
    Physical,
    /// A shape without a cause: may serve a fit, explains nothing.
    Empirical,
}

/// How many values a parameter has in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Scope {
    /// One.
    Global = 0,
    /// One per camera.
    Camera = 1,
    /// One per flight.
    Flight = 2,
    /// One per flight, the first flight's held at the nominal value.
    FlightButFirst = 3,
    /// One per image.
    Image = 4,
}

/// How a parameter gets its value.
#[derive(Debug, Clone, PartialEq)]
pub enum Role {
    /// Estimated from its start value; a score test needs no other.
    Estimated,
    /// Estimated, but the effect is nonlinear in it: a score test scans the domain before it estimates.
    Searched(Domain),
    /// Given by the user, never estimated; some values have names (`against=order` is 1).
    Given(Cow<'static, [(&'static str, f64)]>),
    /// One value per image, drawn from a normal distribution of mean zero whose standard deviation is the effect's one
    /// reported parameter, estimated as a variance component; the name here is that of the standard deviation.
    Random(&'static str),
    /// The error of the velocity of an image in one coordinate, observed as nominal with the standard deviation of that
    /// velocity; held where it was measured. A test of the effect holds it, and whatever has the effect estimates it.
    VelocityError,
}

/// Search domain of a nonlinear parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// The sensor's width, px.
    SensorX,
    /// The sensor's height, px.
    SensorY,
    /// Between two fractions of the sensor's half diagonal, px.
    SensorFraction(f64, f64),
    /// Between two values in the parameter's unit.
    Range(f64, f64),
}

impl Domain {
    /// Least and largest value, in the parameter's unit, on a sensor of `width_px` x `height_px`.
    pub fn bounds(&self, width_px: f64, height_px: f64) -> (f64, f64) {
        let half_diagonal = 0.5 * width_px.hypot(height_px);
        match *self {
            Self::SensorX => (0.0, width_px),
            Self::SensorY => (0.0, height_px),
            Self::SensorFraction(low, high) => (low * half_diagonal, high * half_diagonal),
            Self::Range(low, high) => (low, high),
        }
    }
}

/// What a parameter can be if the cause that its effect names is at work. What is estimated beyond looks like that
/// cause, and is another.
#[derive(Debug, Clone, PartialEq)]
pub struct Plausible {
    /// Least value, in the parameter's unit.
    pub min: f64,
    /// Greatest value, in the parameter's unit.
    pub max: f64,
    /// Where the limits come from.
    pub source: Cow<'static, str>,
}

/// One parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, as on the command line.
    pub name: Cow<'static, str>,
    /// Unit.
    pub unit: Cow<'static, str>,
    /// Number of values.
    pub scope: Scope,
    /// Value at which the effect is the identity, whatever the searched and given ones are; for those, the default.
    pub nominal: f64,
    /// A size met in practice, same unit; scales the parameter inside the solvers and must not be zero. Of coefficients
    /// in px^-n that on a sensor of half a diagonal of [`HALF_DIAGONAL_PX`], like their plausible range.
    pub typical: f64,
    /// How it gets its value.
    pub role: Role,
    /// Range of physically possible values; of a random parameter that of its standard deviation. `None` for what is
    /// given or searched, for coefficients of a mere shape, and for a plug-in that states none.
    pub plausible: Option<Plausible>,
}

/// Half the diagonal of the sensor that typical sizes and plausible ranges of coefficients in px^-n are stated for.
pub const HALF_DIAGONAL_PX: f64 = 3200.0;

impl Parameter {
    /// Typical size (above zero) on a sensor of this half diagonal. A coefficient in px^-n moves points by its size
    /// times the (n + 1)th power of the distance from the centre: what is typical, and what physics allows, is the
    /// displacement at the corner.
    pub fn typical_on(&self, half_diagonal_px: f64) -> f64 {
        let power = self.unit.strip_prefix("px^-").and_then(|n| n.parse::<i32>().ok());
        self.typical.abs() * power.map_or(1.0, |n| (HALF_DIAGONAL_PX / half_diagonal_px).powi(n + 1))
    }

    /// What is expected where `value` is none that a given parameter can have; `None` where it is one, or any number
    /// is.
    pub fn expected_instead_of(&self, value: f64) -> Option<String> {
        let Role::Given(named) = &self.role else { return None };
        if named.is_empty() || named.iter().any(|(_, number)| *number == value) {
            return None;
        }
        let all: Vec<String> = named.iter().map(|(name, number)| format!("{number} ({name})")).collect();
        Some(all.join(" or "))
    }
}

/// A measured quantity that an effect needs of the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Need {
    /// `time_s` of every image.
    Time = 0,
    /// `temperature_c` of every image.
    Temperature = 1,
    /// At least two flights.
    Flights = 2,
    /// `vx, vy, vz`, or times from which they are derived by flight.
    Velocity = 3,
    /// GNSS positions, in a datum that uses them.
    Gnss = 4,
    /// Control points, in a datum that uses them.
    Control = 5,
    /// Surveyed coordinates, and with them heights against the gravity direction: a datum that is not free.
    Vertical = 6,
}

/// What an effect is: its page in the catalogue follows from this.
#[derive(Debug, Clone, PartialEq)]
pub struct Descriptor {
    /// Fixed id, as on the command line.
    pub id: Cow<'static, str>,
    /// Where it acts.
    pub stage: Stage,
    /// Cause or shape.
    pub kind: Kind,
    /// What happens, in a sentence or two.
    pub summary: Cow<'static, str>,
    /// The formula, in the symbols of CONVENTIONS.md.
    pub formula: Cow<'static, str>,
    /// Its parameters, in the order of `theta`.
    pub parameters: Vec<Parameter>,
    /// What the block must have.
    pub needs: Vec<Need>,
    /// Effects that it is easily confused with, and what tells them apart.
    pub confused_with: Cow<'static, str>,
    /// Literature.
    pub source: Cow<'static, str>,
    /// The picture in which it is seen.
    pub picture: Picture,
    /// What it is to a person, of a cause; `None` of a shape, and of a plug-in that states none.
    pub words: Option<Words>,
}
