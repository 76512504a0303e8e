//! What the rules see: sets of columns, which of them are in, and what each says beside those.

use super::beside::{Beside, Known};
use crate::math::statistics::f_ln_sf;
use crate::score::design_effect::Clusters;
use crate::score::pivoted::Pivoted;
use crate::score::{Penalised, System, fixed, multiple, random, separability, variance_factor};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Laws or chance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nature {
    /// Values that the measurements determine: a law.
    Law,
    /// Independent values per image, of which only the variance is asked.
    Chance,
}

/// How the columns of a set were found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Searched {
    /// Not at all.
    None,
    /// The best of so many places; `drop` is that on the grid: finer grids about the best place find a larger one
    /// without counted tests.
    Places {
        /// Number of places.
        count: f64,
        /// Drop of `v'Pv` at the best of them.
        drop: f64,
        /// Drop at places that it does not reach, as a multiple of what chance gives; one where that tells nothing.
        elsewhere: f64,
    },
    /// In the model at the best of so many places, its place estimated since.
    Placed {
        /// Number of places.
        count: f64,
    },
    /// One value of a range, at this place of the order along it.
    Range(f64),
    /// One of some variants.
    Variant,
    /// With an option that is not the default: a choice that costs what one more parameter does.
    Option,
}

impl Searched {
    /// Natural logarithm of the p-value of a drop of `v'Pv`, corrected for the places that were searched; `rest` is the
    /// redundancy beside it.
    fn ln_p(self, drop: f64, dof: f64, inflation: f64, rest: f64) -> f64 {
        let (statistic, dof, count) = match self {
            // What places elsewhere take away shares the variance factor and the design effect: it takes their place
            // where it is larger.
            Searched::Places { count, drop: on_grid, elsewhere } => {
                (drop.min(on_grid.max(0.0)) / (dof * inflation.max(elsewhere)), dof, count)
            }
            // By the rule that let it in: of its size alone, less what chance gives to the estimate of a place.
            Searched::Placed { count } => ((drop / inflation - (dof - 1.0)).max(0.0), 1.0, count),
            Searched::Option => (drop / ((dof + 1.0) * inflation), dof + 1.0, 1.0),
            _ => (drop / (dof * inflation), dof, 1.0),
        };
        multiple::best_of(f_ln_sf(statistic, dof, rest).min(0.0), count)
    }
}

/// A set of columns: an effect, or a group of camera parameters that the model holds.
#[derive(Debug, Clone)]
pub struct Set {
    /// Id of the effect, `free:f` and so on; variants share it.
    pub id: String,
    /// Its columns.
    pub columns: Vec<usize>,
    /// Law or chance.
    pub nature: Nature,
    /// Names a cause; an empirical field does not.
    pub physical: bool,
    /// How it was found.
    pub search: Searched,
}

/// A set that is in the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    /// Position of the set.
    pub set: usize,
    /// Variance of its values where they are chance, in the units of their columns squared; unused for laws.
    pub variance: f64,
}

/// What the rules see.
#[derive(Clone)]
pub struct Situation<'a> {
    /// Score and information of all columns at zero.
    pub system: &'a System,
    /// The same beside what was asked for last.
    pub known: &'a Known,
    /// Sets.
    pub sets: &'a [Set],
    /// Values that the columns have in the fit that was linearised.
    pub values: &'a [f64],
    /// Values (scaled) that physics allows each column; `None` where it says nothing.
    pub plausible: &'a [Option<[f64; 2]>],
    /// Parts by image and by cell of the sensor of the columns `clustered`, at that fit.
    pub clusters: &'a Clusters,
    /// Position of each column in the parts.
    pub clustered: &'a [Option<usize>],
    /// Design effect of the sets that are chance; one for laws.
    pub design_effects: &'a [f64],
    /// What is in.
    pub taken: Vec<Taken>,
    /// Logarithm of the level of a single test: family-wise over all candidates.
    pub ln_level: f64,
}

/// What a set says beside what is in.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Position of the set.
    pub set: usize,
    /// Drop of `v'Pv` that it brings.
    pub drop: f64,
    /// Degrees of freedom.
    pub dof: f64,
    /// F, or for chance the standardised sum of squared scores.
    pub statistic: f64,
    /// Natural logarithm of the p-value, corrected for what was searched.
    pub ln_p: f64,
    /// See [`fixed::Tested::design_effect`].
    pub design_effect: f64,
    /// Variance factor beside it, design effect included.
    pub inflation: f64,
    /// Columns that are left, and their factorisation.
    pub pivoted: Pivoted,
    /// Variance component, of chance.
    pub component: Option<random::Component>,
    /// An estimate lies beyond what physics allows by more than chance: a shape that looks like the effect, but not its
    /// cause.
    pub implausible: bool,
}

/// Standard deviations by which an estimate must be beyond its plausible range to be no chance: one in 700.
const BEYOND_SIGMAS: f64 = 3.0;

impl Situation<'_> {
    /// Is an effect in?
    pub fn has(&self, id: &str) -> bool {
        self.taken.iter().any(|taken| self.sets[taken.set].id == id)
    }

    /// The same without one of the effects that are in.
    pub fn without(&self, id: &str) -> Self {
        let mut situation = self.clone();
        situation.taken.retain(|taken| self.sets[taken.set].id != id);
        situation
    }

    /// Columns of each law, and the chances, that are in.
    pub fn parts_in(&self) -> (Vec<Vec<usize>>, Vec<Penalised>) {
        let of = |nature: Nature| self.taken.iter().filter(move |taken| self.sets[taken.set].nature == nature);
        let fixed = of(Nature::Law).map(|taken| self.sets[taken.set].columns.clone()).collect();
        let random = of(Nature::Chance)
            .map(|taken| Penalised { columns: self.sets[taken.set].columns.clone(), variance: taken.variance })
            .collect();
        (fixed, random)
    }

    /// Every set that is not in, judged beside what is in; of several variants the surest, its p-value corrected for
    /// the choice. Surest first.
    pub fn judge_all(&self, beside: &Beside) -> Vec<Judged> {
        let mut done = BTreeSet::new();
        let first = |s: &usize| !self.has(&self.sets[*s].id) && done.insert(&self.sets[*s].id);
        let first: Vec<usize> = (0..self.sets.len()).filter(first).collect();
        let judged = |s: &usize| {
            let variants = (*s..self.sets.len()).filter(|other| self.sets[*other].id == self.sets[*s].id);
            self.best_variant(variants.filter_map(|variant| self.judge(variant, beside)).collect(), beside)
        };
        let mut best: Vec<Judged> = first.par_iter().filter_map(judged).collect();
        best.sort_by(|a, b| a.ln_p.total_cmp(&b.ln_p).then_with(|| b.drop.total_cmp(&a.drop)));
        best
    }

    /// Judges a set beside what is in; `beside` is the system there. `None` where nothing of it is left.
    pub fn judge(&self, set: usize, beside: &Beside) -> Option<Judged> {
        let Set { columns, nature, search, .. } = &self.sets[set];
        match nature {
            Nature::Law => self.judge_law(set, columns, *search, beside),
            Nature::Chance => {
                let component = random::test(beside, columns, self.design_effects[set])?;
                let variance = component.deviation.powi(2) / component.variance;
                let values = Penalised { columns: columns.clone(), variance };
                Some(Judged {
                    set,
                    drop: beside.drop_of_random(&values),
                    dof: 1.0,
                    statistic: component.statistic,
                    ln_p: component.ln_p,
                    design_effect: self.design_effects[set],
                    inflation: component.variance,
                    pivoted: beside.pivoted(&[]),
                    implausible: self.beyond(columns[0], component.deviation, component.sigma),
                    component: Some(component),
                })
            }
        }
    }

    fn judge_law(&self, set: usize, columns: &[usize], search: Searched, beside: &Beside) -> Option<Judged> {
        let tested = fixed::test(beside, columns, |pivoted| {
            let Some((directions, change)) = self.directions(pivoted, beside) else { return 1.0 };
            let rest = beside.redundancy - pivoted.kept.len() as f64;
            let variance = variance_factor(beside.chi_square - pivoted.drop(), rest);
            self.clusters.design_effect(&directions, &change, variance)
        })?;
        let ln_p = search.ln_p(tested.drop, tested.dof, tested.inflation(), beside.redundancy - tested.dof);
        let (estimate, variances) = (tested.set.estimate(), tested.set.variances());
        let sigma = |k: usize| (variances[k] * tested.inflation()).sqrt();
        let implausible = tested.set.kept.iter().enumerate().any(|(k, c)| self.beyond(*c, estimate[k], sigma(k)));
        Some(Judged {
            set,
            implausible,
            drop: tested.drop,
            dof: tested.dof,
            statistic: tested.statistic,
            ln_p,
            design_effect: tested.design_effect,
            inflation: tested.inflation(),
            pivoted: tested.set,
            component: None,
        })
    }

    /// Is a value of a column beyond its plausible range?
    fn beyond(&self, column: usize, value: f64, sigma: f64) -> bool {
        let margin = BEYOND_SIGMAS * sigma;
        self.plausible[column].is_some_and(|[min, max]| value + margin < min || value - margin > max)
    }

    /// Over the clustered columns: directions that whiten a set beside the laws that are in, and what all columns
    /// change by when it is fitted. `None` where a column of the set has no parts.
    fn directions(&self, set: &Pivoted, beside: &Beside) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let count = self.clusters.columns()?;
        let (fixed, _) = self.parts_in();
        let whitening = set.whitening();
        let dof = set.kept.len();
        let mut directions = DMatrix::zeros(count, dof);
        for (i, column) in set.kept.iter().enumerate() {
            let to = self.clustered[*column]?;
            (0..dof).for_each(|k| directions[(to, k)] = whitening[(i, k)]);
        }
        // What is in follows: minus M_ff^-1 M_fc.
        let system = beside.chance.as_deref().unwrap_or(self.system);
        let own = &*beside.laws;
        let n = own.kept.len();
        let mut cross = DMatrix::from_fn(n, dof, |i, k| {
            set.kept
                .iter()
                .enumerate()
                .map(|(j, column)| system.information[(own.kept[i], *column)] * own.scale[i] * whitening[(j, k)])
                .sum()
        });
        own.factor.solve_lower_triangular_mut(&mut cross);
        own.factor.tr_solve_lower_triangular_mut(&mut cross);
        let estimate = own.estimate();
        let mut change = DVector::zeros(count);
        for (i, column) in own.kept.iter().enumerate() {
            let Some(to) = self.clustered[*column] else { continue };
            (0..dof).for_each(|k| directions[(to, k)] -= cross[(i, k)] * own.scale[i]);
            change[to] += estimate[i];
        }
        change += &directions * &set.white;
        for column in fixed.iter().flatten().chain(&set.kept) {
            if let Some(to) = self.clustered[*column] {
                change[to] -= self.values[*column];
            }
        }
        Some((directions, change))
    }

    /// The surest of variants, its p-value corrected for the choice.
    fn best_variant(&self, mut judged: Vec<Judged>, beside: &System) -> Option<Judged> {
        let range = |j: &Judged| match self.sets[j.set].search {
            Searched::Range(place) => place,
            _ => f64::NAN,
        };
        let count = judged.len();
        judged.sort_by(|a, b| range(a).total_cmp(&range(b)));
        let seen = |a: &Judged, b: &Judged| separability::seen_by(beside, &a.pivoted, &b.pivoted);
        let angle: f64 = judged.windows(2).map(|pair| seen(&pair[0], &pair[1]).clamp(0.0, 1.0).acos()).sum();
        let surest = judged.iter().map(|judged| judged.ln_p).min_by(f64::total_cmp)?;
        // How sure it is that there is one says the coarse grid, which of its variants it is the place that each was
        // refined to.
        let placed = judged.iter().all(|judged| matches!(self.sets[judged.set].search, Searched::Places { .. }));
        let mut best = judged.into_iter().min_by(|a, b| {
            let by_drop = b.drop.total_cmp(&a.drop);
            if placed { by_drop } else { a.ln_p.total_cmp(&b.ln_p).then(by_drop) }
        })?;
        best.ln_p = match self.sets[best.set].search {
            Searched::Places { .. } => surest,
            Searched::Range(_) if count > 1 => multiple::best_over_range(best.ln_p, best.drop / best.inflation, angle),
            Searched::Variant => multiple::best_of(best.ln_p, count as f64),
            _ => best.ln_p,
        };
        Some(best)
    }
}
