//! `caseNNN_*.truth.json`: what the other generator put into a block, in its own names.

use crate::judging::rule::{Hidden, STANDS_FOR, Truth};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Its names of the catalogue's effects.
const NAMES: [(&str, &str); 20] = [
    ("f_time", "focal-time"),
    ("f_temp", "focal-temperature"),
    ("f_flight", "focal-flight"),
    ("f_jitter", "focal-image"),
    ("pp_time", "pp-time"),
    ("pp_flight", "pp-flight"),
    ("pp_jitter", "pp-image"),
    ("k4", "radial-high"),
    ("decentring4", "decentring-high"),
    ("unflat", "unflatness"),
    ("local", "local-flaw"),
    ("gnss_lever", "gnss-lever-arm"),
    ("gnss_time", "gnss-delay"),
    ("gnss_shift", "gnss-shift"),
    ("gnss_drift", "gnss-drift"),
    ("rolling_shutter", "rolling-shutter"),
    ("refraction", "refraction"),
    ("forward_motion", "forward-motion"),
    ("map_scale", "map-scale"),
    // Under which a share may stand besides: the effect alone.
    ("itself", ""),
];

/// Causes that are in no catalogue.
const OUTSIDERS: [&str; 5] = ["sinus", "seam", "row_jitter", "ripple", "swirl"];

#[derive(Deserialize)]
struct File {
    effects: Vec<Effect>,
    correct: Correct,
    noise_correlation_px: f64,
}

#[derive(Deserialize)]
struct Effect {
    name: String,
    noncentrality: f64,
    explained_share: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
struct Correct {
    cp_rms_mm: f64,
}

/// Reads a truth.
///
/// # Panics
/// A file that is none, or that has a name which this module does not know: then it is the judge that is wrong.
pub fn read(path: &Path) -> Truth {
    let text = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let file: File = serde_json::from_slice(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Truth {
        hidden: file.effects.iter().map(hidden).collect(),
        correlated_noise: file.noise_correlation_px > 0.0,
        check_mm: file.correct.cp_rms_mm,
    }
}

fn hidden(effect: &Effect) -> Hidden {
    let outsider = OUTSIDERS.contains(&effect.name.as_str());
    let above = effect.explained_share.iter().filter(|(_, share)| **share > STANDS_FOR);
    Hidden {
        name: if outsider { effect.name.clone() } else { id_of(&effect.name).into() },
        outsider,
        noncentrality: effect.noncentrality,
        stand_ins: above.map(|(name, _)| id_of(name).to_string()).filter(|id| !id.is_empty()).collect(),
    }
}

/// The catalogue's id of a name, which may be of one camera alone (`k4@0`).
fn id_of(name: &str) -> &'static str {
    let plain = name.split('@').next().unwrap_or(name);
    let known = NAMES.iter().find(|(theirs, _)| *theirs == plain);
    known.unwrap_or_else(|| panic!("`{name}` is no known name of an effect")).1
}
