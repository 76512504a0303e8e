//! The rule of judgement for blocks whose causes are known.
//!
//! - Each effect of the catalogue with a noncentrality of [`ASKED_FOR`] or more is recommended, or one that may stand
//!   for it: a candidate that takes more than [`STANDS_FOR`] of its noncentrality, or that the diagnosis declares
//!   inseparable from it.
//! - Nothing else is recommended, but effects that are present with [`ALLOWED`] or more.
//! - With an outsider (a cause that no catalogue knows) of [`ASKED_FOR`] or more the verdict is `unexplained`. Without
//!   any effect it is `adequate`; noise that neighbours share is structure too, so that there `unexplained` is as
//!   right.
//! - Check points end within [`CHECK_RATIO`] of what the true model reaches, but where the truth is not in the
//!   catalogue or the survey itself is wrong.

use super::program::Found;
use std::collections::BTreeSet;

/// A noncentrality that a test at the 0.1 % level sees with certainty, so that a miss is a fault and no bad luck.
pub const ASKED_FOR: f64 = 60.0;
/// A noncentrality that a test may or may not see: naming the effect is right, and so is not naming it.
pub const ALLOWED: f64 = 10.0;
/// Share of an effect's noncentrality above which another candidate says the same: the rest of an effect that is just
/// asked for would not be seen.
pub const STANDS_FOR: f64 = 0.9;
/// Check points of the improved model against those of the true one.
pub const CHECK_RATIO: f64 = 1.1;
/// The effect that is an error of the survey: check points have it too, and say nothing of the adjustment.
const OF_THE_SURVEY: &str = "map-scale";

/// Something that was put into a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// Id of the catalogue, or what an outsider is called.
    pub name: String,
    /// No effect of the catalogue describes it.
    pub outsider: bool,
    /// Drop of `v'Pv` that is to be expected when it enters the model.
    pub noncentrality: f64,
    /// Effects of the catalogue that take more than [`STANDS_FOR`] of that.
    pub stand_ins: BTreeSet<String>,
}

/// What is true of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// What was put in.
    pub hidden: Vec<Hidden>,
    /// Neighbouring measurements err together.
    pub correlated_noise: bool,
    /// 3D RMS of the check points under the true model, mm.
    pub check_mm: f64,
}

/// What is wrong, in words; nothing where all is right.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judgement {
    /// One sentence for each fault.
    pub faults: Vec<String>,
    /// Recommended effects that are not there.
    pub not_there: Vec<String>,
    /// Noncentrality of each effect of the catalogue that was put in, and whether it was named, by itself or by one
    /// that stands for it.
    pub named: Vec<(f64, bool)>,
}

/// Holds what was found against the truth.
pub fn judge(truth: &Truth, found: &Found) -> Judgement {
    let recommended: BTreeSet<&str> = found.recommended.iter().map(String::as_str).collect();
    let stands_for = |other: &str, hidden: &Hidden| {
        let declared = found.inseparable(&hidden.name, other) || found.inseparable(other, &hidden.name);
        hidden.stand_ins.contains(other) || declared
    };
    let (outsiders, effects): (Vec<&Hidden>, Vec<&Hidden>) = truth.hidden.iter().partition(|hidden| hidden.outsider);
    let asked_for: Vec<&Hidden> = effects.iter().copied().filter(|hidden| hidden.noncentrality >= ASKED_FOR).collect();

    let mut faults = Vec::new();
    for hidden in &asked_for {
        let named = recommended.contains(hidden.name.as_str());
        if !named && !recommended.iter().any(|other| stands_for(other, hidden)) {
            faults.push(format!("{} ({:.0}) is not found", hidden.name, hidden.noncentrality));
        }
    }
    let present = |id: &str| effects.iter().any(|hidden| hidden.name == id && hidden.noncentrality >= ALLOWED);
    let excused = |id: &str| asked_for.iter().any(|hidden| stands_for(id, hidden));
    let not_there: Vec<String> =
        recommended.iter().filter(|id| !present(id) && !excused(id)).map(ToString::to_string).collect();
    if !not_there.is_empty() {
        faults.push(format!("not there: {}", not_there.join(", ")));
    }
    faults.extend(wrong_verdict(truth, &outsiders, found));
    let out_of_reach = !outsiders.is_empty() || effects.iter().any(|hidden| hidden.name == OF_THE_SURVEY);
    // Written so that a NaN fails.
    let reached = found.check_mm() <= CHECK_RATIO * truth.check_mm;
    if !out_of_reach && !reached {
        faults.push(format!("check points {:.4} mm, the true model reaches {:.4}", found.check_mm(), truth.check_mm));
    }
    let is_named = |hidden: &&Hidden| {
        recommended.contains(hidden.name.as_str()) || recommended.iter().any(|other| stands_for(other, hidden))
    };
    let named = effects.iter().map(|hidden| (hidden.noncentrality, is_named(hidden))).collect();
    Judgement { faults, not_there, named }
}

fn wrong_verdict(truth: &Truth, outsiders: &[&Hidden], found: &Found) -> Option<String> {
    let right: &[&str] = if outsiders.iter().any(|hidden| hidden.noncentrality >= ASKED_FOR) {
        &["unexplained"]
    } else if !truth.hidden.is_empty() {
        return None;
    } else if truth.correlated_noise {
        &["adequate", "unexplained"]
    } else {
        &["adequate"]
    };
    let verdict = found.verdict.as_str();
    (!right.contains(&verdict)).then(|| format!("verdict {verdict} instead of {}", right.join(" or ")))
}
