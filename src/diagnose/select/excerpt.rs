//! The columns of a system that a question is about: of thousands, those of what is in and of some structures are few.

use super::challenge::Shape;
use super::{Known, Set, Situation};
use crate::diagnose::test::System;

/// A system without the other columns; sets that are not in it have none.
pub struct Excerpt {
    system: System,
    known: Known,
    sets: Vec<Set>,
    values: Vec<f64>,
    plausible: Vec<Option<[f64; 2]>>,
    clustered: Vec<Option<usize>>,
    /// The structures, by its columns.
    pub shapes: Vec<Shape>,
}

impl Excerpt {
    /// Of the columns of what is in and of `shapes`.
    pub fn new(whole: &Situation<'_>, shapes: Vec<Shape>) -> Self {
        let taken = |set: usize| whole.taken.iter().any(|taken| taken.set == set);
        let in_it = (0..whole.sets.len()).filter(|set| taken(*set)).flat_map(|set| &whole.sets[set].columns);
        let mut columns: Vec<usize> = in_it.chain(shapes.iter().flat_map(|shape| &shape.columns)).copied().collect();
        columns.sort_unstable();
        columns.dedup();
        let here = |of: &[usize]| of.iter().filter_map(|column| columns.binary_search(column).ok()).collect();
        let of_set = |(set, of): (usize, &Set)| Set {
            columns: if taken(set) { here(&of.columns) } else { Vec::new() },
            ..of.clone()
        };
        Self {
            sets: whole.sets.iter().enumerate().map(of_set).collect(),
            shapes: shapes.into_iter().map(|shape| Shape { columns: here(&shape.columns), ..shape }).collect(),
            system: whole.system.excerpt(&columns),
            known: Known::default(),
            values: columns.iter().map(|column| whole.values[*column]).collect(),
            plausible: columns.iter().map(|column| whole.plausible[*column]).collect(),
            clustered: columns.iter().map(|column| whole.clustered[*column]).collect(),
        }
    }

    /// What the rules see of it.
    pub fn situation<'a>(&'a self, whole: &Situation<'a>) -> Situation<'a> {
        let Self { system, known, sets, values, plausible, clustered, .. } = self;
        Situation { system, known, sets, values, plausible, clustered, ..whole.clone() }
    }
}
