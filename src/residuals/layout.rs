//! All tests laid out as columns, and judged together.

use super::asked::{Asked, Spread};
use super::check_points::Heights;
use super::columns::{self, Families, Family};
use super::context::Context;
use super::covariates::Covariate;
use super::found::Found;
use super::place::Place;
use super::{
    Structure, StructureTest, autocorrelation, check, covariates, gnss, image, row_spectrum, sensor, spectrum,
};
use crate::adjust::AdjustError;
use crate::null_model::{Columns, Coordinate, Local};
use crate::problem::{Problem, State};
use crate::score::{System, is_noise};
use std::ops::Range;

/// Coordinates of antennas whose redundancy is taken; of more, an even sample.
const REDUNDANCY_SAMPLE: usize = 300;
/// Name of the columns that tell the redundancy of the positions; no test.
const REDUNDANCY: &str = "(redundancy)";

/// The tests of a fit, laid out as columns.
pub struct Layout<'a> {
    context: Context<'a>,
    cells: sensor::Cells,
    spectrum: Option<spectrum::Spectrum>,
    covariates: Vec<Covariate<'a>>,
    found: Found,
}

impl<'a> Layout<'a> {
    /// Of a fit and its `measurements`.
    ///
    /// # Errors
    /// A state that cannot be evaluated.
    pub fn new(
        problem: &'a Problem,
        state: &'a State,
        measurements: &'a [Local],
        threads: usize,
    ) -> Result<Self, AdjustError> {
        let context = Context::new(problem, state, measurements, threads)?;
        let mut found = Found::default();
        let cells = sensor::Cells::new(&context);
        let spectrum = spectrum::Spectrum::new(&context, &mut found);
        let covariates = covariates::all(&context, &mut found);
        Ok(Self { context, cells, spectrum, covariates, found })
    }

    /// The columns of the tests that are `wanted`. `together`: two of them may be asked about at once.
    pub fn families(&self, together: bool, wanted: impl Fn(&str) -> bool) -> Families<'_> {
        let problem = self.context.problem;
        let mut list = vec![self.cells.family()];
        list.extend(self.spectrum.as_ref().map(spectrum::Spectrum::family));
        if problem.image_contexts.len() <= image::MOST_IMAGES {
            list.push(image::family(problem.image_contexts.len()));
        }
        for covariate in &self.covariates {
            let Family { against, count, local, fill, .. } = &covariate.family;
            let fill = move |place: &Place, to: &mut columns::Writer<'_>| fill(place, to);
            let (against, count, local) = (*against, *count, *local);
            list.push(Family { against, count, local, fill: Box::new(fill), coordinates: None });
        }
        list.extend(gnss::DIRECTIONS.iter().filter_map(|(name, _)| gnss::family(problem, name)));
        list.push(redundancy(problem));
        list.retain(|family| wanted(family.against));
        Families::new(problem, self.context.state, list, together)
    }

    /// Hands the columns of all tests to `test`, and judges what comes back: a system in which they are the last
    /// columns, and their spread.
    pub fn analyse<T, E>(
        &mut self,
        heights: &Result<Heights, &'static str>,
        significance: f64,
        test: impl FnOnce(&dyn Columns) -> Result<(T, System, Spread), E>,
    ) -> Result<(T, Structure), E> {
        let mut found = std::mem::take(&mut self.found);
        let families = self.families(false, |_| true);
        let (tested, system, spread) = test(&families)?;
        let first = system.len() - families.dense() - families.local();
        let names: Vec<&'static str> = families.list.iter().map(|family| family.against).collect();
        let ranges: Vec<Range<usize>> =
            families.ranges().into_iter().map(|range| first + range.start..first + range.end).collect();
        drop(families);
        let range_of = |name: &str| Some(ranges[names.iter().position(|other| *other == name)?].clone());
        if let Some(rows) = range_of(REDUNDANCY).filter(|rows| !rows.is_empty()) {
            let share = rows.clone().map(|c| system.information[(c, c)]).sum::<f64>() / rows.len() as f64;
            let coordinates = (3 * self.context.problem.gnss.len()) as f64;
            // What the positions determine of the poses, the image measurements do not give up.
            self.context.noise.degrees += (1.0 - share) * coordinates;
            let noise = &mut self.context.gnss_noise;
            noise.degrees = share * coordinates;
            // A residual has a share of the images' errors, too, and its mean over a flight has little else where
            // positions are far better than their weights say: they may be worse than stated here, and no better.
            noise.sum_of_squares = noise.sum_of_squares.max(noise.degrees);
        }
        let context = &self.context;
        let noise = context.noise;
        let asked = |name: &str| Some(Asked { system: &system, spread: &spread, range: range_of(name)?, noise });
        if noise.degrees > 0.0 {
            asked("sensor").iter().for_each(|asked| self.cells.judge(asked, &mut found));
            if let (Some(spectrum), Some(asked)) = (&self.spectrum, asked("spectrum")) {
                spectrum.judge(&asked, &mut found);
            }
            let mut values = image::values(context);
            match asked("image") {
                Some(asked) => image::judge(context, &mut values, &asked, &mut found),
                None => found.skip("image", "too many images to test each"),
            }
            found.pictures.images = values.into_iter().filter(|value| value.n > 0).collect();
            for covariate in &self.covariates {
                let name = covariate.family.against;
                let Some(asked) = asked(name) else { continue };
                let all: Vec<usize> = (0..covariate.family.count).collect();
                found.push(name, asked.test(&all), covariate.description.clone());
            }
            covariates::draw(context, &self.covariates, &mut found);
            if is_noise(noise.sum_of_squares, noise.degrees) {
                context.pool.install(|| {
                    autocorrelation::test(context, &mut found);
                    row_spectrum::test(context, &mut found);
                });
            } else {
                let tests = autocorrelation::TESTS.iter().chain(&[row_spectrum::TEST]);
                tests.for_each(|name| found.skip(name, "the residuals are much smaller than stated"));
            }
            for (name, _) in gnss::DIRECTIONS {
                match asked(name) {
                    Some(asked) => gnss::judge(context, name, &asked, &mut found),
                    None if context.problem.gnss.is_empty() => {}
                    None => found.skip(name, "no velocities, or too many flights"),
                }
            }
        } else {
            found.skip("sensor", "no redundancy");
        }
        check::describe(heights, &mut found);
        holm(&mut found.tests);
        let of_name = |name: &'static str| {
            let shape = found.shapes.iter().find(|(other, _)| *other == name).map(|(_, columns)| columns.clone());
            let position = names.iter().position(|other| *other == name)?;
            Some((name, shape.unwrap_or_else(|| (0..ranges[position].len()).collect())))
        };
        let columns = found.tests.iter().filter(|test| test.decides).filter_map(|test| of_name(test.against)).collect();
        let Found { tests, skipped, pictures, .. } = found;
        let sentence = heights.as_ref().ok().map(|heights| heights.sentence.clone());
        Ok((tested, Structure { tests, skipped, pictures, significance, columns, check_points: sentence }))
    }
}

/// Coordinates of antennas as columns: what is left of each is its redundancy.
fn redundancy(problem: &Problem) -> Family<'_> {
    let stride = (3 * problem.gnss.len()).div_ceil(REDUNDANCY_SAMPLE).max(1);
    let count = 3 * problem.gnss.len().div_ceil(stride);
    let coordinates = move |coordinate: Coordinate, to: &mut dyn FnMut(usize, f64)| {
        let Coordinate::Gnss(g, axis) = coordinate else { return };
        if g.is_multiple_of(stride) {
            to(3 * (g / stride) + axis, problem.gnss[g].sigma[axis]);
        }
    };
    let coordinates: Option<columns::FillCoordinate<'_>> = Some(Box::new(coordinates));
    Family { against: REDUNDANCY, count, local: true, fill: Box::new(|_, _| {}), coordinates }
}

/// Holm's step-down correction over the tests that decide.
fn holm(tests: &mut [StructureTest]) {
    let mut order: Vec<usize> = (0..tests.len()).filter(|k| tests[*k].decides).collect();
    order.sort_by(|a, b| tests[*a].ln_p_value.total_cmp(&tests[*b].ln_p_value));
    let mut largest: f64 = 0.0;
    for (rank, k) in order.iter().enumerate() {
        largest = largest.max((tests[*k].p_value * (order.len() - rank) as f64).min(1.0));
        tests[*k].family_p_value = largest;
    }
}
