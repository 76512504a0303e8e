//! What a plan is wanted to reach, and how far it is from that.

use super::notice::Asked;
use super::said::Said;
use super::why::{imprecise, too_small, unseen};
use super::{Plan, Precision};
use crate::effects;
use crate::inject::mistakes;
use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// Shortfall of a goal that no size reaches: an effect that stays hidden. As large as that of a size a million times
/// too large, so that whatever shows it comes first.
const HIDDEN: f64 = 14.0;
/// Shortfall of effects that may be called each other, at least: that they look alike over a hundredth of their size is
/// still no separation.
const ALIKE: f64 = 0.01;

/// A goal.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// Standard deviation of a horizontal coordinate that 95 % of the tie points stay below, m.
    Plan(f64),
    /// The same of the height, m.
    Height(f64),
    /// An effect is seen from this size on, in `unit`: every parameter that has this unit.
    Effect {
        /// Its id.
        id: String,
        /// Size.
        size: f64,
        /// Unit.
        unit: String,
    },
    /// Neither of two effects is called the other.
    Separate(String, String),
    /// A mistake is noticed.
    Notice(Asked),
}

/// Where a plan stands with a goal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// The goal, as it was given.
    pub goal: String,
    /// What the plan has, in the unit of the goal. Not known where an effect stays hidden, and of effects to separate.
    pub value: Option<f64>,
    /// Unit of `value`.
    pub unit: String,
    /// Is it reached?
    pub reached: bool,
    /// Why it is not reached.
    pub why: Option<String>,
    /// Natural logarithm of how many times too large the value is; zero where the goal is reached.
    #[serde(skip)]
    pub shortfall: f64,
}

impl FromStr for Goal {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "`{text}` is no goal. Expected a length such as \"height 10 mm\" or \"plan 5 mm\". Or an effect with a \
                 size and its unit, such as \"focal-temperature 0.1 px/K\". Or \"separate EFFECT EFFECT\", or a \
                 mistake such as \"notice height-offset 0.05 m\""
            )
        };
        let effect = |id: &str| match effects::find(id) {
            Some(_) => Ok(id.to_string()),
            None => Err(format!("`{text}`: there is no effect `{id}` (misclosure effects list)")),
        };
        let size = |text: &str| text.parse::<f64>().ok().filter(|size| *size > 0.0 && size.is_finite());
        match text.split_whitespace().collect::<Vec<_>>().as_slice() {
            ["notice", mistake, sized @ ..] => {
                let (kind, subject) = match mistake.split_once(":of=") {
                    Some((kind, subject)) => (kind, Some(subject.to_string())),
                    None => (*mistake, None),
                };
                if mistakes::find(kind).is_none() {
                    return Err(format!("`{text}`: there is no mistake `{kind}` (misclosure inject --list)"));
                }
                let size = match sized {
                    [] => None,
                    [number, unit] => Some((size(number).ok_or_else(expected)?, unit.to_string())),
                    _ => return Err(expected()),
                };
                Ok(Self::Notice(Asked { kind: kind.into(), subject, size }))
            }
            ["separate", a, b] => Ok(Self::Separate(effect(a)?, effect(b)?)),
            [what @ ("height" | "plan"), length, unit @ ("mm" | "m")] => {
                let metres = size(length).ok_or_else(expected)? * if *unit == "mm" { 1e-3 } else { 1.0 };
                Ok(if *what == "height" { Self::Height(metres) } else { Self::Plan(metres) })
            }
            [id, number, unit] => {
                let size = size(number).ok_or_else(expected)?;
                Ok(Self::Effect { id: effect(id)?, size, unit: unit.to_string() })
            }
            _ => Err(expected()),
        }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plan(metres) => write!(f, "plan {} mm", 1e3 * metres),
            Self::Height(metres) => write!(f, "height {} mm", 1e3 * metres),
            Self::Effect { id, size, unit } => write!(f, "{id} {size} {unit}"),
            Self::Separate(a, b) => write!(f, "separate {a} {b}"),
            Self::Notice(asked) => write!(f, "notice {asked}"),
        }
    }
}

impl Goal {
    /// The mistake that has to be noticed, where it is that.
    pub fn mistake(&self) -> Option<&Asked> {
        match self {
            Self::Notice(asked) => Some(asked),
            _ => None,
        }
    }

    /// Where a plan stands; `said` of the mistake that has to be noticed.
    pub fn standing(&self, plan: &Plan, said: Option<&Said>) -> Standing {
        let of = |value: Option<f64>, wanted: f64, unit: &str, why: &dyn Fn() -> String| {
            let shortfall = value.map_or(HIDDEN, |value| (value / wanted).ln().clamp(0.0, HIDDEN));
            let reached = shortfall == 0.0;
            let why = (!reached).then(why);
            Standing { goal: self.to_string(), value, unit: unit.into(), reached, why, shortfall }
        };
        let millimetres = |spread: Option<super::Spread>| spread.map(|spread| 1e3 * spread.worst);
        let Precision { plan_m, height_m, plan_limits, height_limits, .. } = &plan.precision;
        match self {
            Self::Plan(metres) => {
                of(millimetres(*plan_m), 1e3 * metres, "mm", &|| imprecise(plan_limits.as_ref(), *metres))
            }
            Self::Height(metres) => {
                of(millimetres(*height_m), 1e3 * metres, "mm", &|| imprecise(height_limits.as_ref(), *metres))
            }
            Self::Effect { id, size, unit } => {
                let sizes = plan.visible(id).into_iter().flat_map(|own| &own.sizes);
                let sizes = sizes.filter(|own| own.unit == *unit);
                let worst = sizes.max_by(|a, b| a.size.total_cmp(&b.size));
                of(worst.map(|worst| worst.size), *size, unit, &|| match worst {
                    Some(worst) => too_small(worst, *size),
                    None => unseen(plan, id, unit),
                })
            }
            Self::Separate(a, b) => {
                let alike = [self.alike(plan, a, b), self.alike(plan, b, a)];
                let shortfall = alike.iter().map(|(shortfall, _)| *shortfall).fold(0.0, f64::max);
                let why: Vec<String> = alike.into_iter().filter_map(|(_, why)| why).collect();
                let why = (!why.is_empty()).then(|| why.join("; "));
                let (goal, unit) = (self.to_string(), String::new());
                Standing { goal, value: None, unit, reached: shortfall == 0.0, why, shortfall }
            }
            Self::Notice(_) => {
                let reached = said.is_some_and(|said| *said != Said::Nothing);
                let why = (!reached).then(|| "a diagnosis of the drawn block says nothing".to_string());
                let shortfall = if reached { 0.0 } else { HIDDEN };
                Standing { goal: self.to_string(), value: None, unit: String::new(), reached, why, shortfall }
            }
        }
    }

    /// How far `a` is from never being called `b`, and why.
    fn alike(&self, plan: &Plan, a: &str, b: &str) -> (f64, Option<String>) {
        let Some(own) = plan.visible(a) else { return (HIDDEN, Some(unseen(plan, a, ""))) };
        let taken_for = own.sizes.iter().filter(|size| size.looks_like.iter().any(|other| other == b));
        let shortfall = |size: &super::Size| size.named_size.map_or(HIDDEN / 2.0, |named| (named / size.size).ln());
        match taken_for.map(shortfall).reduce(f64::max) {
            None => (0.0, None),
            Some(shortfall) => (shortfall.max(ALIKE), Some(format!("{a} may be called {b}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Hidden, Limits, Size, Spread, Visible};

    #[test]
    fn goals_are_read_and_what_is_none_says_what_is_expected() {
        assert_eq!("height 10 mm".parse(), Ok(Goal::Height(0.01)));
        assert_eq!("separate focal-time  pp-time".parse(), Ok(Goal::Separate("focal-time".into(), "pp-time".into())));
        let effect = Goal::Effect { id: "focal-temperature".into(), size: 0.1, unit: "px/K".into() };
        assert_eq!("focal-temperature 0.1 px/K".parse::<Goal>(), Ok(effect.clone()));
        assert_eq!(effect.to_string(), "focal-temperature 0.1 px/K");
        let asked = Asked { kind: "tilt".into(), subject: Some("gnss".into()), size: Some((0.5, "deg".into())) };
        assert_eq!("notice tilt:of=gnss 0.5 deg".parse(), Ok(Goal::Notice(asked.clone())));
        assert_eq!(Goal::Notice(asked).to_string(), "notice tilt:of=gnss 0.5 deg");
        assert!("notice exchanged".parse::<Goal>().is_ok());
        for wrong in [
            "notice",
            "notice no-kind",
            "notice tilt 3",
            "height",
            "height -1 mm",
            "height 10 km",
            "separate focal-time",
            "no-effect 1 px",
            "",
        ] {
            assert!(wrong.parse::<Goal>().is_err_and(|error| error.contains(wrong)), "{wrong}");
        }
    }

    /// A plan with two parameters of `focal-temperature`, which looks like `focal-time`; `refraction` is hidden.
    fn plan() -> Plan {
        let size = |parameter: &str, size: f64, looks_like: &[&str]| Size {
            parameter: parameter.into(),
            size,
            named_size: Some(1.001 * size),
            looks_like: looks_like.iter().map(|own| own.to_string()).collect(),
            unit: "px/K".into(),
            size_alone: Some(0.1 * size),
            plausible: None,
            moves_m: None,
            moves_height_m: None,
        };
        let visible = |effect: &str, sizes: Vec<Size>| {
            let (at, absorbed, absorbed_typical) = Default::default();
            Visible { effect: effect.into(), sizes, at, absorbed, absorbed_typical, tell: None }
        };
        let temperature = vec![size("a", 0.1, &["focal-time"]), size("b", 0.3, &[])];
        Plan {
            format: 1,
            block: "b".into(),
            images: 3,
            blind: vec![],
            tie_points: 4,
            tie_measurements: 12,
            control: 0,
            check: 0,
            gnss: 0,
            significance: 1e-3,
            power: 0.8,
            tied_centre: false,
            effects: vec![visible("focal-temperature", temperature), visible("focal-time", vec![])],
            hidden: vec![Hidden { effect: "refraction".into(), needs: vec!["more height".into()], typical: vec![] }],
            precision: Precision {
                plan_m: None,
                height_m: Some(Spread { rms: 0.007, typical: 0.005, worst: 0.02 }),
                plan_limits: None,
                height_limits: Some(Limits {
                    rays_m: 0.004,
                    cameras_known_m: 0.01,
                    parameter: Some("f".into()),
                    parameter_known_m: Some(0.012),
                }),
                parameters: Default::default(),
                check: None,
                points: vec![],
            },
            reliability: vec![],
            known: vec![],
        }
    }

    #[test]
    fn a_plan_stands_where_its_sizes_are() {
        let standing = |goal: &str| goal.parse::<Goal>().unwrap().standing(&plan(), None);
        assert!(standing("height 20 mm").reached && !standing("height 19 mm").reached);
        // Twice too large.
        assert!((standing("height 10 mm").shortfall - 2f64.ln()).abs() < 1e-12);
        let why = |goal: &str| standing(goal).why.expect("it is not reached");
        assert_eq!(standing("height 20 mm").why, None);
        assert!(why("height 15 mm").contains("f most (12.0 mm"), "cameras: {}", why("height 15 mm"));
        assert!(why("height 5 mm").contains("poses and datum"), "{}", why("height 5 mm"));
        assert!(why("height 3 mm").contains("control and GNSS do not"), "{}", why("height 3 mm"));
        assert!(why("focal-temperature 0.2 px/K").contains("99.0 %"), "{}", why("focal-temperature 0.2 px/K"));
        assert!(why("focal-temperature 0.01 px/K").contains("too few"), "{}", why("focal-temperature 0.01 px/K"));
        assert!(standing("plan 1 m").why.is_some_and(|why| why.contains("too large")));
        assert_eq!(standing("focal-temperature 0.2 px/K").value, Some(0.3), "the worst parameter");
        let hidden = standing("refraction 1 px");
        assert!(hidden.shortfall == HIDDEN && hidden.why.unwrap().contains("more height"));
        assert!(standing("focal-temperature 1 px").why.unwrap().contains("px/K"));
        let notice = "notice height-offset 5 m".parse::<Goal>().unwrap();
        assert!(notice.standing(&plan(), Some(&Said::Unexplained)).reached);
        assert!(notice.standing(&plan(), Some(&Said::Nothing)).shortfall == HIDDEN);
        let alike = standing("separate focal-time focal-temperature");
        assert!(!alike.reached && alike.shortfall == ALIKE && alike.why.unwrap().contains("may be called"));
    }
}
