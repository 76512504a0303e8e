//! What a step changes.

use super::brush::Brush;
use crate::camera::{PARAMETER_COUNT, parameter_indices};
use crate::model::{Datum, Loss, Model, SigmaFactors, TieWeights};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A change of the model or of the measurements that take part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Change {
    /// The model that the laboratory was opened with.
    Base,
    /// The simulated block, measured anew under these errors.
    Simulate {
        /// As `inject --error` takes them.
        errors: Vec<String>,
        /// Of everything random.
        seed: u64,
    },
    /// An effect, or a group of camera parameters that is held (`free:pp`).
    Add {
        /// Its id.
        effect: String,
        /// Start values, and values of what is given.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        values: BTreeMap<String, f64>,
    },
    /// Takes an effect out.
    Remove {
        /// Its id.
        effect: String,
    },
    /// These camera parameters are free, all others held.
    Free {
        /// Names of parameters or groups.
        parameters: Vec<String>,
    },
    /// The centre of distortion moves with the principal point, or by itself.
    TieCentre {
        /// With it?
        tied: bool,
    },
    /// What defines position, orientation and scale.
    Datum {
        /// The datum.
        datum: Datum,
    },
    /// A robust loss on image measurements, or none.
    Loss {
        /// The loss.
        loss: Loss,
    },
    /// Weights by hand; what is not named stays.
    Weights {
        /// By the number of images of a point.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tie_weights: Option<TieWeights>,
        /// Factors on the stated standard deviations.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        factors: Option<Factors>,
    },
    /// Weights from the residuals.
    EstimateWeights,
    /// Measurements that take no part any more.
    SetAside {
        /// Which.
        measurements: Vec<Named>,
    },
    /// Those of a brush take no part any more.
    SetAsideBrush {
        /// The brush, at the parent.
        brush: Brush,
    },
    /// Measurements that take part again.
    TakeBack {
        /// Which.
        measurements: Vec<Named>,
    },
    /// Data snooping.
    SearchOutliers,
    /// Mistakes of people are undone, as `mend` does in a copy of the block.
    Mend {
        /// Kinds of mistakes; none: all that can be undone.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        only: Vec<String>,
    },
    /// Whatever lowers the objective, step by step.
    Improve,
}

/// Factors on the stated standard deviations; what is not named stays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Factors {
    /// As [`SigmaFactors`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image: Option<f64>,
    /// See `image`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mark: Option<f64>,
    /// See `image`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control: Option<f64>,
    /// See `image`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control_z: Option<f64>,
    /// See `image`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gnss: Option<f64>,
    /// See `image`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gnss_z: Option<f64>,
}

impl Factors {
    fn apply(self, to: SigmaFactors) -> Result<SigmaFactors, String> {
        let pick = |own: Option<f64>, other: f64| own.unwrap_or(other);
        let all = SigmaFactors {
            image: pick(self.image, to.image),
            mark: pick(self.mark, to.mark),
            control: pick(self.control, to.control),
            control_z: pick(self.control_z, to.control_z),
            gnss: pick(self.gnss, to.gnss),
            gnss_z: pick(self.gnss_z, to.gnss_z),
        };
        for value in [all.image, all.mark, all.control, all.control_z, all.gnss, all.gnss_z] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("a factor of {value} on a standard deviation: expected a number above 0"));
            }
        }
        Ok(all)
    }
}

/// A measurement by name.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Named {
    /// Image.
    pub image: String,
    /// Point.
    pub point: String,
    /// `tie` or `mark`.
    #[serde(default = "tie")]
    pub kind: String,
}

fn tie() -> String {
    "tie".into()
}

impl Change {
    /// Does a step with this change have a block of its own, for itself and for what stands beneath it?
    pub fn has_block(&self) -> bool {
        matches!(self, Change::Base | Change::Simulate { .. } | Change::Mend { .. })
    }

    /// In a few words, for the tree.
    pub fn words(&self) -> String {
        let count = |n: usize| if n == 1 { "1 measurement".to_string() } else { format!("{n} measurements") };
        match self {
            Change::Base => "base model".into(),
            Change::Simulate { errors, .. } if errors.is_empty() => "measured without errors".into(),
            Change::Simulate { errors, .. } => format!("measured with {}", errors.join(", ")),
            Change::Add { effect, .. } => format!("+ {effect}"),
            Change::Remove { effect } => format!("− {effect}"),
            Change::Free { parameters } if parameters.is_empty() => "camera held".into(),
            Change::Free { parameters } => format!("free: {}", parameters.join(" ")),
            Change::TieCentre { tied: true } => "centre of distortion tied".into(),
            Change::TieCentre { tied: false } => "centre of distortion free".into(),
            Change::Datum { datum } => format!("datum {}", name(datum)),
            Change::Loss { loss } => format!("loss {}", name(loss)),
            Change::Weights { tie_weights, factors } => {
                let ties = tie_weights.map(|weights| format!("tie weights {}", name(&weights)));
                let factors = factors.map(|_| "other standard deviations".to_string());
                ties.into_iter().chain(factors).collect::<Vec<_>>().join(", ")
            }
            Change::EstimateWeights => "weights from the residuals".into(),
            Change::SetAside { measurements } => format!("{} set aside", count(measurements.len())),
            Change::SetAsideBrush { .. } => "brushed measurements set aside".into(),
            Change::TakeBack { measurements } => format!("{} taken back", count(measurements.len())),
            Change::SearchOutliers => "outliers searched".into(),
            Change::Mend { only } if only.is_empty() => "mistakes mended".into(),
            Change::Mend { only } => format!("mended: {}", only.join(", ")),
            Change::Improve => "what lowers the objective".into(),
        }
    }

    /// The model with this change, where it is one of the model's settings: then effects and measurements stay as they
    /// are.
    ///
    /// # Errors
    /// A name that nothing has; a change that changes nothing.
    pub fn of_settings(&self, model: &Model) -> Result<Option<Model>, String> {
        let mut changed = model.clone();
        match self {
            Change::Free { parameters } => {
                changed.free = [false; PARAMETER_COUNT];
                for name in parameters {
                    let indices = parameter_indices(name).ok_or_else(|| {
                        format!(
                            "free: no camera parameter or group {name:?}; expected names as f, pp, radial, k1, all, \
                                 none"
                        )
                    })?;
                    indices.into_iter().for_each(|k| changed.free[k] = true);
                }
            }
            Change::TieCentre { tied } => changed.tie_dc_to_pp = *tied,
            Change::Datum { datum } => changed.datum = *datum,
            Change::Loss { loss } => changed.loss = *loss,
            Change::Weights { tie_weights, factors } => {
                changed.tie_weights = tie_weights.unwrap_or(changed.tie_weights);
                changed.sigma_factors = factors.unwrap_or_default().apply(changed.sigma_factors)?;
            }
            _ => return Ok(None),
        }
        let same = changed.free == model.free
            && changed.tie_dc_to_pp == model.tie_dc_to_pp
            && changed.datum == model.datum
            && changed.loss == model.loss
            && changed.tie_weights == model.tie_weights
            && changed.sigma_factors == model.sigma_factors;
        if same {
            return Err(format!("{}: the model is so already", self.words()));
        }
        Ok(Some(changed))
    }
}

/// The name that a setting has in files.
pub fn name<T: Serialize>(setting: &T) -> String {
    serde_json::to_value(setting).ok().and_then(|value| value.as_str().map(String::from)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_read_as_they_are_documented() {
        let read = |text: &str| serde_json::from_str::<Change>(text);
        let add = read(r#"{"kind":"add","effect":"rolling-shutter"}"#).expect("a change");
        assert_eq!(add.words(), "+ rolling-shutter");
        let aside = read(r#"{"kind":"set_aside","measurements":[{"image":"a","point":"b"}]}"#).expect("a change");
        assert!(matches!(&aside, Change::SetAside { measurements } if measurements[0].kind == "tie"));
        assert!(read(r#"{"kind":"set_aside_brush","brush":{"view":"images","ids":[3]}}"#).is_ok());
        assert!(read(r#"{"kind":"improve"}"#).is_ok());
        let mend = read(r#"{"kind":"mend","only":["scale"]}"#).expect("a change");
        assert!(mend.has_block() && mend.words() == "mended: scale" && read(r#"{"kind":"mend"}"#).is_ok());
        assert!(read(r#"{"kind":"dance"}"#).is_err() && read(r#"{"kind":"add","effects":"x"}"#).is_err());
    }

    #[test]
    fn a_setting_that_is_so_already_is_refused() {
        let model = Model::default();
        assert!(Change::Datum { datum: Datum::Free }.of_settings(&model).is_err());
        let held = Change::Free { parameters: vec!["f".into(), "pp".into()] }.of_settings(&model).expect("a model");
        assert_eq!(held.expect("of settings").free.iter().filter(|free| **free).count(), 3);
        assert!(Change::Free { parameters: vec!["q".into()] }.of_settings(&model).is_err());
        let wrong = Factors { image: Some(-1.0), ..Factors::default() };
        assert!(Change::Weights { tie_weights: None, factors: Some(wrong) }.of_settings(&model).is_err());
    }
}
