//! The objective that decides: what a set of hypotheses leaves unexplained, how implausible its sizes are, and its
//! price.
//!
//! ```text
//! J(S) = chi(S) / phi + ln|I + t^2 M_RR|       -2 ln L under the present weights, random effects R by their variance t^2
//!        + sum over h in S of kappa_h           what chance would reach
//! ```
//!
//! `phi` is the variance factor of the model as it stands. It belongs to all observations, so that it may not follow
//! the sets that compete: where a large cause spoils the images, their standard deviation was estimated too large,
//! and a factor that falls with the cause would call GNSS and control too noisy, and ask for random effects that
//! absorb them. Nor may it follow what surveyed coordinates miss the model by: that is what causes explain, and an
//! imprecise survey, whose weights are judged with `phi = 1`, would explain it for less. The weights are estimated anew
//! after each step, image by survey, and the objective falls by the likelihood of that too.
//!
//! `chi(S)` is `v'Pv` of the fit with `S`, where every size of a law is a pseudo-observation of its nominal value (half
//! its plausible range is the standard deviation) and every random value one of zero. `kappa_h` is the drop that `h`
//! alone reaches by chance with probability `alpha / m`, `m` hypotheses being compared: for one hypothesis `J` falls
//! exactly where its test is significant.
//!
//! To first order all of this is linear algebra of one small system `(s, M)` at zero ([`Objective::value`]); a refit
//! decides.

use super::hypothesis::Hypothesis;
use crate::run::squares::Surveyed;
use crate::score::{Penalised, System, variance_factor};
use std::sync::{Arc, Mutex, PoisonError};

/// Some hypotheses, by their position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Members {
    /// Laws, in ascending order.
    pub laws: Vec<usize>,
    /// Random effects with the variance of their values, in the units of their columns squared; in ascending order.
    pub random: Vec<(usize, f64)>,
}

impl Members {
    /// Position of every member.
    pub fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.laws.iter().copied().chain(self.random.iter().map(|(h, _)| *h))
    }

    /// Is a hypothesis one of them?
    pub fn has(&self, hypothesis: usize) -> bool {
        self.all().any(|own| own == hypothesis)
    }

    /// Are all members of another set among them?
    pub fn contains(&self, other: &Self) -> bool {
        other.all().all(|own| self.has(own))
    }

    /// The same without one.
    pub fn without(&self, hypothesis: usize) -> Self {
        let mut members = self.clone();
        members.laws.retain(|own| *own != hypothesis);
        members.random.retain(|(own, _)| *own != hypothesis);
        members
    }

    /// The same with a law.
    pub fn with_law(&self, law: usize) -> Self {
        let mut members = self.clone();
        members.laws.push(law);
        members.laws.sort_unstable();
        members
    }

    /// The same with a random effect.
    pub fn with_random(&self, hypothesis: usize, variance: f64) -> Self {
        let mut members = self.without(hypothesis);
        members.random.push((hypothesis, variance));
        members.random.sort_unstable_by_key(|(own, _)| *own);
        members
    }

    /// Do both have the same members, whatever the variances?
    pub fn same(&self, other: &Self) -> bool {
        let random = |members: &Self| members.random.iter().map(|(h, _)| *h).collect::<Vec<_>>();
        self.laws == other.laws && random(self) == random(other)
    }
}

/// The columns of the laws, conditional on random effects.
pub(super) struct Conditional {
    /// Over the columns of all laws ([`Objective::of_laws`]).
    pub system: System,
    /// `ln|I + t^2 M_RR|`, and the prices of the random effects.
    pub cost: f64,
    /// `ln|I + t^2 M_RR|` of all values, where columns are a sample of them.
    log_determinant: f64,
}

/// A random configuration and the system conditional on it.
type Known = (Vec<(usize, f64)>, Arc<Conditional>);

/// All hypotheses and the system in which they compete.
pub struct Objective<'a> {
    /// Score and information at zero, sizes of laws as pseudo-observations.
    pub(super) system: System,
    /// Hypotheses, variants of one effect under the same id.
    pub hypotheses: &'a [Hypothesis],
    /// Columns of all laws, ascending: the columns of a [`Conditional`].
    law_columns: Vec<usize>,
    /// Columns of each law among those.
    pub(super) of_laws: Vec<Vec<usize>>,
    /// Variance factor of the model as it stands, freed of what surveyed coordinates miss it by.
    pub(super) variance: f64,
    /// Logarithm of the level of a single hypothesis.
    pub ln_level: f64,
    known: Mutex<Vec<Known>>,
}

impl<'a> Objective<'a> {
    /// `system`: all columns at zero; `survey`: what surveyed coordinates have of `v'Pv`; `prior`: information that the
    /// prior of each column adds, zero where nothing is known; `current`: the hypotheses in the model.
    pub fn new(
        system: &System,
        survey: Surveyed,
        prior: &[f64],
        hypotheses: &'a [Hypothesis],
        current: &Members,
        ln_level: f64,
    ) -> Self {
        let mut system = system.clone();
        let information = Arc::make_mut(&mut system.information);
        prior.iter().enumerate().for_each(|(c, own)| information[(c, c)] += own);
        system.least.fill(0.0);
        let laws = || hypotheses.iter().filter(|h| !h.random);
        let mut law_columns: Vec<usize> = laws().flat_map(|law| law.columns.iter().copied()).collect();
        law_columns.sort_unstable();
        law_columns.dedup();
        let of = |h: &Hypothesis| match h.random {
            true => Vec::new(),
            false => h.columns.iter().filter_map(|column| law_columns.binary_search(column).ok()).collect(),
        };
        let of_laws = hypotheses.iter().map(of).collect();
        let variance = 1.0;
        let mut objective =
            Self { system, hypotheses, law_columns, of_laws, variance, ln_level, known: Mutex::default() };
        let (chi_square, redundancy) = (objective.chi_square(current), objective.redundancy());
        // A surveyed coordinate has a redundancy of one at the most.
        let of_images = variance_factor(chi_square - survey.chi_square, (redundancy - survey.count).max(1.0));
        objective.variance = variance_factor(chi_square, redundancy).min(of_images);
        objective
    }

    /// `-2 ln L` of a set that leaves `chi_square`, but for a constant.
    pub(super) fn misfit(&self, chi_square: f64) -> f64 {
        chi_square / self.variance
    }

    /// Redundancy of the base.
    pub fn redundancy(&self) -> f64 {
        self.system.redundancy
    }

    /// Prices of some members.
    pub fn price(&self, members: &Members) -> f64 {
        members.all().map(|h| self.hypotheses[h].price).sum()
    }

    /// Are the lower terms in of every term of a series that is in? (Principle of marginality, Nelder 1977.) Terms
    /// that the base has are no hypotheses.
    pub fn allows(&self, members: &Members) -> bool {
        let is_in = |id: &str| members.all().any(|own| self.hypotheses[own].id == id);
        let lower = members.all().filter_map(|own| self.hypotheses[own].above);
        lower.into_iter().all(|lower| is_in(lower) || !self.hypotheses.iter().any(|other| other.id == lower))
    }

    /// `J` of some hypotheses to first order.
    pub fn value(&self, members: &Members) -> f64 {
        self.value_within(&self.conditional(&members.random), &members.laws)
    }

    /// `J` of laws beside random effects to first order.
    pub(super) fn value_within(&self, conditional: &Conditional, laws: &[usize]) -> f64 {
        let columns: Vec<&[usize]> = laws.iter().map(|law| self.of_laws[*law].as_slice()).collect();
        let drop = conditional.system.pivoted_in_turn(&columns).drop();
        let price: f64 = laws.iter().map(|law| self.hypotheses[*law].price).sum();
        self.misfit(conditional.system.chi_square - drop) + conditional.cost + price
    }

    /// `v'Pv` that some members leave to first order, their priors included.
    pub fn chi_square(&self, members: &Members) -> f64 {
        let conditional = self.conditional(&members.random);
        let columns: Vec<&[usize]> = members.laws.iter().map(|law| self.of_laws[*law].as_slice()).collect();
        conditional.system.chi_square - conditional.system.pivoted_in_turn(&columns).drop()
    }

    /// `ln|I + t^2 M_RR|` of all values of the random effects among some members, as a refit has them.
    pub fn log_determinant(&self, members: &Members) -> f64 {
        self.conditional(&members.random).log_determinant
    }

    /// The laws conditional on random effects.
    pub(super) fn conditional(&self, random: &[(usize, f64)]) -> Arc<Conditional> {
        let find = |known: &[Known]| known.iter().find(|(of, _)| of == random).map(|(_, own)| own.clone());
        if let Some(own) = find(&self.known.lock().unwrap_or_else(PoisonError::into_inner)) {
            return own;
        }
        let own = Arc::new(self.conditional_on(random));
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        find(&known).unwrap_or_else(|| {
            known.push((random.to_vec(), own.clone()));
            own
        })
    }

    fn conditional_on(&self, random: &[(usize, f64)]) -> Conditional {
        let mut system = self.with_columns_of(&random.iter().map(|(h, _)| *h).collect::<Vec<_>>());
        let mut first = self.law_columns.len();
        let (mut cost, mut of_all) = (0.0, 0.0);
        for (h, variance) in random {
            let own = &self.hypotheses[*h];
            let values = Penalised { columns: (first..first + own.columns.len()).collect(), variance: *variance };
            first += own.columns.len();
            let log_determinant = system.log_determinant(&values);
            cost += own.price + log_determinant;
            of_all += own.values_per_column * log_determinant;
            system = system.beside::<Vec<usize>>(&[], &[values]);
        }
        let laws: Vec<usize> = (0..self.law_columns.len()).collect();
        let system = if random.is_empty() { system } else { system.excerpt(&laws) };
        Conditional { system, cost, log_determinant: of_all }
    }

    /// The columns of all laws, and behind them those of some random effects.
    fn with_columns_of(&self, random: &[usize]) -> System {
        let behind = random.iter().flat_map(|h| &self.hypotheses[*h].columns);
        let columns: Vec<usize> = self.law_columns.iter().chain(behind).copied().collect();
        self.system.excerpt(&columns)
    }

    /// Score and information of the values of a random effect beside some members.
    pub(super) fn of_random(&self, hypothesis: usize, members: &Members) -> System {
        let others: Vec<(usize, f64)> = members.random.iter().copied().filter(|(h, _)| *h != hypothesis).collect();
        let names: Vec<usize> = others.iter().map(|(h, _)| *h).chain([hypothesis]).collect();
        let all = self.with_columns_of(&names);
        // Of the laws those that are members alone.
        let mut kept: Vec<usize> = members.laws.iter().flat_map(|law| self.of_laws[*law].iter().copied()).collect();
        let of_laws = kept.len();
        kept.extend(self.law_columns.len()..all.len());
        let mut system = all.excerpt(&kept);
        let mut first = of_laws;
        for (h, variance) in &others {
            let count = self.hypotheses[*h].columns.len();
            let values = Penalised { columns: (first..first + count).collect(), variance: *variance };
            system = system.beside::<Vec<usize>>(&[], &[values]);
            first += count;
        }
        let laws: Vec<usize> = (0..of_laws).collect();
        let system = system.beside(&[laws], &[]);
        let own: Vec<usize> = (first..system.len()).collect();
        system.excerpt(&own)
    }
}
