//! Columns of the tests: what a unit of each pattern would move every measurement by. All tests share one null model.

use super::place::Place;
use crate::null_model::{Columns, Coordinate, Entries, Measured};
use crate::problem::{Problem, State};
use std::ops::Range;

/// Where a test writes its entries for a measurement.
pub(super) struct Writer<'a> {
    put: &'a mut dyn FnMut(usize, [f64; 2]),
}

impl Writer<'_> {
    /// One entry: column of the test, displacement in x and y, px.
    pub fn entry(&mut self, column: usize, displacement: [f64; 2]) {
        (self.put)(column, displacement);
    }
}

/// Fills a measurement's entries.
type Fill<'a> = Box<dyn Fn(&Place, &mut Writer<'_>) + Sync + 'a>;
/// Fills an observed coordinate's entries: column of the test, m per unit.
pub(super) type FillCoordinate<'a> = Box<dyn Fn(Coordinate, &mut dyn FnMut(usize, f64)) + Sync + 'a>;

/// Columns of one test.
pub(super) struct Family<'a> {
    /// Its name.
    pub against: &'static str,
    /// Number of columns.
    pub count: usize,
    /// A measurement touches a few of them alone.
    pub local: bool,
    /// See [`Fill`].
    pub fill: Fill<'a>,
    /// Of observed coordinates; `None` for tests of image measurements.
    pub coordinates: Option<FillCoordinate<'a>>,
}

/// The columns of tests.
pub struct Families<'a> {
    problem: &'a Problem,
    state: &'a State,
    pub(super) list: Vec<Family<'a>>,
    first: Vec<usize>,
    counts: [usize; 2],
    together: bool,
}

impl<'a> Families<'a> {
    /// Of a fit. `together`: two tests may be asked about at once.
    pub(super) fn new(problem: &'a Problem, state: &'a State, list: Vec<Family<'a>>, together: bool) -> Self {
        let mut counts = [0; 2];
        let mut place = |family: &Family<'_>| {
            let count = &mut counts[usize::from(family.local)];
            *count += family.count;
            *count - family.count
        };
        let first = list.iter().map(&mut place).collect();
        Self { problem, state, list, first, counts, together }
    }

    /// Columns of a test, in the order of [`Columns`].
    pub fn of(&self, against: &str) -> Option<Range<usize>> {
        let position = self.list.iter().position(|family| family.against == against)?;
        self.ranges().into_iter().nth(position)
    }

    /// Columns of each test, in the order of [`Columns`]: dense ones first.
    pub(super) fn ranges(&self) -> Vec<Range<usize>> {
        let range = |(family, first): (&Family<'_>, &usize)| {
            let first = first + if family.local { self.counts[0] } else { 0 };
            first..first + family.count
        };
        self.list.iter().zip(&self.first).map(range).collect()
    }
}

impl Columns for Families<'_> {
    fn dense(&self) -> usize {
        self.counts[0]
    }

    fn local(&self) -> usize {
        self.counts[1]
    }

    fn families(&self) -> Vec<Range<usize>> {
        if self.together { Vec::new() } else { self.ranges() }
    }

    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        let point = &self.state.points[measured.point];
        let place = Place::new(self.problem, self.state, measured.observation, measured.predicted, point);
        for (family, first) in self.list.iter().zip(&self.first) {
            let mut put = |column: usize, [dx, dy]: [f64; 2]| match family.local {
                true => {
                    x.local(first + column, dx);
                    y.local(first + column, dy);
                }
                false => {
                    x.dense(first + column, dx);
                    y.dense(first + column, dy);
                }
            };
            (family.fill)(&place, &mut Writer { put: &mut put });
        }
    }

    fn coordinate(&self, coordinate: Coordinate, entries: &mut Entries<'_>) {
        for (family, first) in self.list.iter().zip(&self.first) {
            let Some(fill) = &family.coordinates else { continue };
            fill(coordinate, &mut |column, value| match family.local {
                true => entries.local(first + column, value),
                false => entries.dense(first + column, value),
            });
        }
    }
}
