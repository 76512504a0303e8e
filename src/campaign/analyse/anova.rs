//! Analysis of variance: which factor matters for a figure.
//!
//! The figure is modelled by a mean and one effect of each level of each factor. A factor explains what the sum of
//! squares rises by without it, beside all others: the sums of squares of type II of a model of main effects, right for
//! unequal numbers of cases, too. Source: Searle (1971), Linear Models, ch. 7.

use super::super::gather::Row;
use super::{REPEATED, finished};
use crate::math::statistics::f_sf;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Levels of a factor at the most: one with as many levels as cases explains everything.
const MOST_LEVELS: usize = 50;
/// Share of the largest singular value below which a direction is not determined.
const SINGULAR: f64 = 1e-10;

/// Which factor matters.
#[derive(Debug, Clone, PartialEq)]
pub struct Anova {
    /// The figure.
    pub figure: String,
    /// Cases that have it.
    pub count: usize,
    /// The factors, the most important first.
    pub sources: Vec<Source>,
    /// What no factor explains: sum of squares and degrees of freedom.
    pub residual: (f64, usize),
    /// Share of the variation that the factors explain together.
    pub explained: f64,
}

/// A factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Its name.
    pub factor: String,
    /// Sum of squares.
    pub squares: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Mean square over that of the residuals.
    pub f: f64,
    /// Probability of a larger F by chance.
    pub p_value: f64,
    /// Mean of the figure at each level.
    pub means: Vec<(String, f64)>,
}

/// `None` where no factor has two levels among the cases with the figure, or nothing is left to judge by.
pub fn anova(rows: &[Row], figure: &str) -> Option<Anova> {
    let cases: Vec<(&Row, f64)> =
        finished(rows).filter_map(|(row, outcome)| Some((row, *outcome.figures.get(figure)?))).collect();
    let factors: Vec<Factor> = cases.first()?.0.factors.keys().filter_map(|name| Factor::new(name, &cases)).collect();
    if factors.is_empty() {
        return None;
    }
    let values = DVector::from_iterator(cases.len(), cases.iter().map(|(_, value)| *value));
    let all: Vec<&Factor> = factors.iter().collect();
    let (squares, rank) = residual(&all, &values);
    let dof = cases.len().checked_sub(rank).filter(|dof| *dof > 0)?;
    let mean = values.mean();
    let total = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    let mut sources: Vec<Source> = factors
        .iter()
        .map(|factor| {
            let others: Vec<&Factor> = factors.iter().filter(|other| other.name != factor.name).collect();
            let (without, rank_without) = residual(&others, &values);
            let (own, own_dof) = ((without - squares).max(0.0), rank - rank_without);
            let f = (own / own_dof as f64) / (squares / dof as f64);
            let p_value = f_sf(f, own_dof as f64, dof as f64);
            Source { factor: factor.name.clone(), squares: own, dof: own_dof, f, p_value, means: factor.means(&values) }
        })
        .filter(|source| source.dof > 0)
        .collect();
    sources.sort_by(|a, b| b.squares.total_cmp(&a.squares));
    let explained = if total > 0.0 { 1.0 - squares / total } else { 0.0 };
    Some(Anova { figure: figure.into(), count: cases.len(), sources, residual: (squares, dof), explained })
}

struct Factor {
    name: String,
    levels: Vec<String>,
    /// Level of each case.
    of_case: Vec<usize>,
}

impl Factor {
    /// `None` of one level, of too many, and of repetitions.
    fn new(name: &str, cases: &[(&Row, f64)]) -> Option<Self> {
        let mut places: BTreeMap<&str, usize> = BTreeMap::new();
        let mut of_case = Vec::with_capacity(cases.len());
        let mut levels = Vec::new();
        for (row, _) in cases {
            let level = row.factors.get(name)?.as_str();
            let place = *places.entry(level).or_insert(levels.len());
            if place == levels.len() {
                levels.push(level.to_owned());
            }
            of_case.push(place);
        }
        let counts = (2..=MOST_LEVELS).contains(&levels.len()) && name != REPEATED;
        counts.then(|| Self { name: name.into(), levels, of_case })
    }

    fn means(&self, values: &DVector<f64>) -> Vec<(String, f64)> {
        let mean = |level: usize| {
            let own: Vec<f64> =
                self.of_case.iter().zip(values.iter()).filter(|(of, _)| **of == level).map(|(_, v)| *v).collect();
            crate::math::statistics::mean(&own)
        };
        self.levels.iter().enumerate().map(|(level, name)| (name.clone(), mean(level))).collect()
    }
}

/// Sum of squares that a mean and the factors leave, and the number of unknowns that are determined.
fn residual(factors: &[&Factor], values: &DVector<f64>) -> (f64, usize) {
    // The first level of each factor is the mean's.
    let columns = 1 + factors.iter().map(|factor| factor.levels.len() - 1).sum::<usize>();
    let mut design = DMatrix::zeros(values.len(), columns);
    design.column_mut(0).fill(1.0);
    let mut first = 1;
    for factor in factors {
        for (case, level) in factor.of_case.iter().enumerate().filter(|(_, level)| **level > 0) {
            design[(case, first + level - 1)] = 1.0;
        }
        first += factor.levels.len() - 1;
    }
    // Normal equations: the entries are zeros and ones.
    let eigen = (design.transpose() * &design).symmetric_eigen();
    let right = eigen.eigenvectors.transpose() * (design.transpose() * values);
    let least = SINGULAR * eigen.eigenvalues.max();
    let kept = (0..columns).filter(|k| eigen.eigenvalues[*k] > least);
    let mut estimate = DVector::zeros(columns);
    let mut rank = 0;
    for k in kept {
        estimate.axpy(right[k] / eigen.eigenvalues[k], &eigen.eigenvectors.column(k), 1.0);
        rank += 1;
    }
    ((values - design * estimate).norm_squared(), rank)
}
