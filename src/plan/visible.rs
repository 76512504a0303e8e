//! The smallest size of each effect that a block would show.

use super::hidden::{Typical, typical};
use crate::block::Block;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::hypothesis::{self, Hypothesis, PLACE_PARAMETERS, Prices};
use crate::diagnose::impact;
use crate::diagnose::linearised::Linearised;
use crate::diagnose::select::{Beside, Judged};
use crate::diagnose::settings::Settings;
use crate::effects::{self, Role};
use crate::score::power::{POWER_QUANTILE, noncentrality};
use crate::score::{System, random};
use serde::Serialize;
use std::collections::BTreeMap;

/// Share of its statistic that a flaw has at the next place of the grid, in the mean: four fifths half-way between two
/// places, all of it at one.
const SHARE_ON_GRID: f64 = 0.9;

/// Times the smallest size that is seen beyond which no size is told by which an effect is named.
const FAR: f64 = 10.0;

/// An effect that a block can show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Visible {
    /// Its id.
    pub effect: String,
    /// Of each of its parameters, the others of it zero.
    pub sizes: Vec<Size>,
    /// Where it is supposed to act, by parameter: the place and width of a flaw, a lag.
    pub at: BTreeMap<String, f64>,
    /// Parameters that the block absorbs: whatever their size, other unknowns take them up.
    pub absorbed: Vec<String>,
    /// What these do at a size that is met in practice.
    pub absorbed_typical: Vec<Typical>,
    /// What would tell it from those that look like it.
    pub tell: Option<String>,
}

/// The smallest size of a parameter that is found with the power of the plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Size {
    /// Parameter. Of values that are random by image it is their standard deviation.
    pub parameter: String,
    /// The smallest size that is seen: the diagnosis names it, or an effect that looks like it. In `unit`.
    pub size: f64,
    /// The smallest size that is named as what it is. Not known where that is beyond ten times `size`.
    pub named_size: Option<f64>,
    /// Effects that a diagnosis may name in its place below `named_size`.
    pub looks_like: Vec<String>,
    /// Unit.
    pub unit: String,
    /// What `size` would be if everything else were known: cameras, poses, points and datum. Not known of random
    /// values.
    pub size_alone: Option<f64>,
    /// The largest size that is plausible, by the catalogue of effects. Not known of all.
    pub plausible: Option<f64>,
    /// What an effect of this size, or of the largest plausible one where that is smaller, does to check points
    /// (without any, to tie points) unseen: 3D RMS, m. Not known of random values.
    pub moves_m: Option<f64>,
    /// The same in height alone, m.
    pub moves_height_m: Option<f64>,
}

impl Size {
    /// Does the block show no plausible size?
    pub fn is_beyond_plausible(&self) -> bool {
        self.plausible.is_some_and(|plausible| self.size > plausible)
    }
}

impl Visible {
    /// What it does to the points while it is not seen, m: the worst of its parameters.
    pub fn worst_m(&self) -> Option<f64> {
        self.sizes.iter().filter_map(|size| size.moves_m).reduce(f64::max)
    }
}

/// Physical effects that a linearised block shows.
pub(super) fn of_effects(block: &Block, linearised: &Linearised, settings: &Settings<'_>) -> Vec<Visible> {
    let situation = linearised.situation(settings);
    let beside = situation.beside();
    let hypotheses = hypothesis::all(linearised, &Prices::new(), settings);
    let physical = |judged: &Judged| linearised.sets[judged.set].physical;
    let judged: Vec<Judged> = situation.judge_all(&beside).into_iter().filter(physical).collect();
    let id = |judged: &Judged| linearised.sets[judged.set].id.clone();
    // Random values take in no law.
    let laws = hypotheses.iter().filter(|own| own.physical && !own.random);
    let rivals: Vec<Rival<'_>> = laws.map(|own| Rival::new(own, own.columns.len())).collect();
    let mut shown: Vec<Visible> = Vec::new();
    for one in &judged {
        let Some(hypothesis) = hypotheses.iter().find(|own| own.set == one.set) else { continue };
        let kept = &one.pivoted.kept;
        let columns = linearised.sets[one.set].columns.iter().copied();
        let absorbed: Vec<usize> = match one.component {
            Some(_) => Vec::new(),
            None => columns.filter(|column| !kept.contains(column)).collect(),
        };
        let words = effects::find(&id(one)).and_then(|effect| effect.descriptor().words.as_ref());
        let sizes = sizes(block, linearised, &beside, one, hypothesis, &rivals);
        let is_alone = sizes.iter().all(|size| size.looks_like.is_empty());
        shown.push(Visible {
            effect: id(one),
            sizes,
            at: at(linearised, one.set),
            absorbed: absorbed.iter().map(|column| linearised.parameter(*column).0).collect(),
            absorbed_typical: typical(block, linearised, &absorbed),
            tell: words.filter(|_| !is_alone).map(|words| words.tell.to_string()),
        });
    }
    shown.retain(|own| !own.sizes.is_empty());
    shown.sort_by(|a, b| b.worst_m().unwrap_or(0.0).total_cmp(&a.worst_m().unwrap_or(0.0)));
    shown
}

fn sizes(
    block: &Block,
    linearised: &Linearised,
    beside: &Beside,
    judged: &Judged,
    hypothesis: &Hypothesis,
    rivals: &[Rival<'_>],
) -> Vec<Size> {
    let first = linearised.sets[judged.set].columns[0];
    if judged.component.is_some() {
        let (_, unit) = linearised.parameter(first);
        let seen = random::smallest_seen(beside, &linearised.sets[judged.set].columns, hypothesis.price);
        let parameter = deviation_of(linearised, first);
        let sized = |size: f64| Size {
            parameter,
            size: size * linearised.unit(first),
            named_size: Some(size * linearised.unit(first)),
            looks_like: Vec::new(),
            unit,
            size_alone: None,
            plausible: plausible(linearised, first),
            moves_m: None,
            moves_height_m: None,
        };
        return seen.map(sized).into_iter().collect();
    }
    let kept = &judged.pivoted.kept;
    let own = Rival::new(hypothesis, kept.len());
    let found: Vec<Found> = kept.iter().map(|column| Found::of(beside, *column, &own, rivals)).collect();
    let scaled = kept.iter().zip(&found).map(|(c, own)| (own.seen / beside.information[(*c, *c)]).sqrt());
    let scaled: Vec<f64> = scaled.collect();
    let values_of = |(column, size): (&usize, &f64)| {
        let mut values = vec![0.0; linearised.values.len()];
        values[*column] = *size;
        values
    };
    let impacts = impact::of_values(block, linearised, &kept.iter().zip(&scaled).map(values_of).collect::<Vec<_>>());
    let size = |(((column, scaled), found), impact): (((&usize, &f64), Found), Option<impact::Impact>)| {
        let (parameter, unit) = linearised.parameter(*column);
        let size = scaled * linearised.unit(*column);
        let left = beside.information[(*column, *column)] / beside.length[*column];
        let size_alone = Some(left.sqrt() * size);
        let factor = (found.named / found.seen).sqrt();
        let named_size = (factor <= FAR).then_some(factor * size);
        let plausible = plausible(linearised, *column);
        let share = plausible.map_or(1.0, |plausible| (plausible / size).min(1.0));
        let (moves_m, moves_height_m) =
            (impact.as_ref().map(|own| share * own.rms_m), impact.map(|own| share * own.height_m));
        let looks_like = found.looks_like;
        Size { parameter, size, named_size, looks_like, unit, size_alone, plausible, moves_m, moves_height_m }
    };
    kept.iter().zip(&scaled).zip(found).zip(impacts).map(size).collect()
}

/// The largest plausible size of a parameter, in its unit.
fn plausible(linearised: &Linearised, column: usize) -> Option<f64> {
    let [min, max] = linearised.plausible[column]?;
    Some(max.max(-min) * linearised.unit(column))
}

/// Values of the parameters that an effect is given.
fn at(linearised: &Linearised, set: usize) -> BTreeMap<String, f64> {
    let term = linearised.candidates[set].as_ref().and_then(Candidate::term);
    term.map(|term| term.values.clone()).unwrap_or_default()
}

/// A hypothesis that may be taken in, for whichever effect is there.
struct Rival<'a> {
    hypothesis: &'a Hypothesis,
    /// Noncentrality of its drop from which that happens with the power of the plan.
    needed: f64,
}

impl<'a> Rival<'a> {
    fn new(hypothesis: &'a Hypothesis, columns: usize) -> Self {
        let needed = match hypothesis.placed {
            // Its price is that on the grid of places, and what the finer search finds by chance.
            true => noncentrality(hypothesis.price - PLACE_PARAMETERS, 1.0) / SHARE_ON_GRID,
            false => noncentrality(hypothesis.price, columns as f64),
        };
        Self { hypothesis, needed }
    }
}

/// Noncentralities of a column from which something is found.
struct Found {
    /// The diagnosis takes in the effect, or one that looks like it.
    seen: f64,
    /// It takes in the effect itself.
    named: f64,
    /// What it may take in below that.
    looks_like: Vec<String>,
}

impl Found {
    /// Another effect takes a share `rho^2` of the noncentrality `l`. It is taken in itself where `rho^2 l` reaches
    /// what it needs, which is less than the effect needs where its price is lower. The lower sum of misfit and price
    /// wins: the drops of both differ by `l (1 - rho^2)` in the mean, with a standard deviation of twice its root. With
    /// a power of 80 % that exceeds the difference of prices `d` from `(0.84 + sqrt(0.84^2 + d))^2` on.
    fn of(beside: &Beside, column: usize, own: &Rival<'_>, rivals: &[Rival<'_>]) -> Self {
        let mut of_column: System = (**beside).clone();
        of_column.score = beside.information.column(column).into_owned();
        let all = beside.information[(column, column)];
        let (mut seen, mut named, mut looks_like) = (own.needed, own.needed, Vec::new());
        for other in rivals.iter().filter(|other| other.hypothesis.id != own.hypothesis.id) {
            let share = of_column.pivoted(&other.hypothesis.columns).drop() / all;
            let by_other = other.needed / share.max(f64::EPSILON);
            let under_root = POWER_QUANTILE.powi(2) + own.hypothesis.price - other.hypothesis.price;
            let against_other = match under_root >= 0.0 {
                true => (POWER_QUANTILE + under_root.sqrt()).powi(2) / (1.0 - share).max(f64::EPSILON),
                false => 0.0,
            };
            let id = &other.hypothesis.id;
            if (by_other < own.needed || against_other > own.needed) && !looks_like.contains(id) {
                looks_like.push(id.clone());
            }
            (seen, named) = (seen.min(by_other), named.max(against_other));
        }
        Self { seen, named, looks_like }
    }
}

/// Name of the standard deviation of random values.
fn deviation_of(linearised: &Linearised, column: usize) -> String {
    let problem = linearised.null.problem();
    let entry = &problem.theta[linearised.null.unknown(column) - problem.layout().theta(0)];
    let parameters = &problem.effects[entry.effect as usize].effect.descriptor().parameters;
    let name = parameters.iter().find_map(|own| match &own.role {
        Role::Random(name) => Some(name.to_string()),
        _ => None,
    });
    name.unwrap_or_default()
}
