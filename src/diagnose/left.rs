//! What is left beside the effects that are in: structure that no named effect explains, and what it may take out.

use super::candidate::Candidate;
use super::catalogue;
use super::check_points;
use super::fit::{DiagnoseError, Fit};
use super::improve::Improvement;
use super::linearised::{Linearised, Questions, with_candidates};
use super::select::challenge::{self, Shape};
use super::select::{Excerpt, Judged, Situation};
use super::settings::Settings;
use super::structure::{self, Structure};
use super::test::{System, fixed};
use crate::adjust::native::null_model::{Columns, measurements_at};
use crate::adjust::native::pool::Pool;
use crate::block::Block;

/// What is left.
pub struct Left {
    /// Every candidate that names a cause, beside what is in, surest first.
    pub judged: Vec<Judged>,
    /// Empirical fields that are significant.
    pub fields: Vec<Field>,
    /// Tests of structure.
    pub structure: Structure,
    /// The fit with the columns of empirical fields and of all tests of structure, each of them apart from the others.
    pub shapes: Linearised,
    /// Those that are significant, where an effect could be one of them.
    significant: Option<Significant>,
}

/// Structures of which each by itself is significant.
struct Significant {
    /// The fit with the columns of all of them; `None`: [`Left::shapes`] says enough of the one that counts.
    together: Option<Linearised>,
    /// Their columns in it.
    shapes: Vec<Shape>,
}

/// An empirical field that would take something away still.
pub struct Field {
    /// Its id.
    pub id: String,
    /// Drop of `v'Pv`.
    pub drop: f64,
    /// Columns of it that are left.
    pub dof: f64,
}

/// Tests that tell properties of the noise: they take no effect out.
const NOISE: [&str; 3] = ["autocorrelation", "row-autocorrelation", "row-spectrum"];
/// Structures that are held against an effect at most.
const MOST_SHAPES: usize = 4;

/// Judges what the model as it stands leaves.
pub fn analyse(
    block: &Block,
    improvement: &Improvement,
    linearised: &Linearised,
    settings: &Settings<'_>,
) -> Result<Left, DiagnoseError> {
    let situation = linearised.situation(settings, &improvement.refused());
    let mut judged = situation.judge_all(&situation.beside());
    judged.retain(|judged| linearised.sets[judged.set].physical);
    let fit = &improvement.fit;
    let Fit { problem, solution, .. } = fit;
    let state = &solution.state;
    let heights = check_points::of_fit(block, fit, settings)?;
    let measurements = measurements_at(problem, state, settings.options.threads)?;
    let mut layout = structure::Layout::new(problem, state, &measurements, settings.options.threads)?;
    let asked = |extra: &dyn Columns, wanted: &dyn Fn(&Candidate) -> bool| {
        let is_field = |candidate: &Candidate| !candidate.physical;
        let (mut tested, _) = catalogue::candidates(block, fit, &improvement.parts, settings.plugins, is_field);
        let all = tested.len();
        tested.retain(|(candidate, _)| wanted(candidate));
        let elsewhere = all - tested.len();
        let asked = Questions { tested, extra, clustered: true, elsewhere, ..Questions::nothing() };
        with_candidates(block, fit, &improvement.parts, asked, settings)
    };
    let (shapes, structure) = layout.analyse(&heights, settings.significance, |columns| {
        let linearised = asked(columns, &|_| true)?;
        let beside = linearised.situation(settings, &Default::default()).beside().into_system();
        let spread = structure::Spread::of(&linearised.scores);
        Ok::<_, DiagnoseError>((linearised, beside, spread))
    })?;
    let fields = significant_fields(&shapes, situation.ln_level, settings);
    let mut left = Left { judged, fields, structure, shapes, significant: None };
    let tests = left.significant_tests(settings.significance);
    let shapes = left.shapes_in(&left.shapes, &tests, &layout.families(false, |_| true));
    left.significant = match alone(improvement, &left.shapes, shapes, settings)? {
        Alone::Nothing => None,
        Alone::Surest(shape) => Some(Significant { together: None, shapes: vec![shape] }),
        Alone::Open => {
            let families = layout.families(true, |against| tests.iter().any(|(name, _)| *name == against));
            let together = asked(&families, &|candidate| left.fields.iter().any(|field| field.id == candidate.id))?;
            let shapes = left.shapes_in(&together, &tests, &families);
            Some(Significant { together: Some(together), shapes })
        }
    };
    Ok(left)
}

/// What structures that are left say of the effects that are in, each of them alone.
enum Alone {
    /// None takes one out, and so the fewest that explain what is left do not either.
    Nothing,
    /// The surest, which is among the fewest in any case, takes out the effect that all of them would.
    Surest(Shape),
    /// Which effect goes depends on which the fewest are.
    Open,
}

/// Holds each of `structures` against the effects that are in.
fn alone(
    improvement: &Improvement,
    linearised: &Linearised,
    mut structures: Vec<Shape>,
    settings: &Settings<'_>,
) -> Result<Alone, DiagnoseError> {
    if improvement.added.is_empty() {
        return Ok(Alone::Nothing);
    }
    let whole = improvement.situation(linearised, settings);
    let excerpt = Excerpt::new(&whole, structures.clone());
    let situation = excerpt.situation(&whole);
    let Some(surest) = surest(&situation, &situation.beside(), &excerpt.shapes) else { return Ok(Alone::Nothing) };
    let mut shapes = excerpt.shapes.clone();
    shapes.swap(0, surest);
    let (all, first) = Pool::new(settings.options.threads)?
        .install(|| (challenge::rule(&situation, &shapes), challenge::rule(&situation, &shapes[..1])));
    Ok(match all {
        None => Alone::Nothing,
        all if all == first => Alone::Surest(structures.swap_remove(surest)),
        _ => Alone::Open,
    })
}

/// Empirical fields of which each is significant beside what is in.
fn significant_fields(shapes: &Linearised, ln_level: f64, settings: &Settings<'_>) -> Vec<Field> {
    let situation = shapes.situation(settings, &Default::default());
    let all = situation.judge_all(&situation.beside());
    let significant = all.into_iter().filter(|judged| judged.ln_p < ln_level);
    let field = |judged: Judged| Field { id: shapes.sets[judged.set].id.clone(), drop: judged.drop, dof: judged.dof };
    significant.map(field).collect()
}

impl Left {
    /// Tests that are significant, each by itself, and the columns that stand for them.
    fn significant_tests(&self, significance: f64) -> Vec<(&'static str, Vec<usize>)> {
        let significant = |against: &str| {
            let test = self.structure.test(against);
            test.is_some_and(|test| test.family_p_value < significance) && !NOISE.contains(&against)
        };
        self.structure.columns.iter().filter(|(against, _)| significant(against)).cloned().collect()
    }

    /// Significant tests and fields by their columns in a system that has the columns of `families` behind those of its sets.
    fn shapes_in(
        &self,
        together: &Linearised,
        tests: &[(&'static str, Vec<usize>)],
        families: &structure::Families<'_>,
    ) -> Vec<Shape> {
        let of_test = |(against, own): &(&'static str, Vec<usize>)| {
            let first = together.extra_columns.start + families.of(against)?.start;
            Some(Shape { name: against.to_string(), columns: own.iter().map(|column| first + column).collect() })
        };
        let tests = tests.iter().filter_map(of_test);
        let fields = together.sets.iter().filter(|set| self.fields.iter().any(|field| field.id == set.id));
        tests.chain(fields.map(|set| Shape { name: set.id.clone(), columns: set.columns.clone() })).collect()
    }
}

/// Takes out an effect that what is left could itself be. Did one go?
///
/// # Errors
/// A wish to stop.
pub fn challenge(
    block: &Block,
    improvement: &mut Improvement,
    left: &Left,
    settings: &Settings<'_>,
) -> Result<bool, DiagnoseError> {
    let Some(Significant { together, shapes }) = &left.significant else { return Ok(false) };
    let whole = improvement.situation(together.as_ref().unwrap_or(&left.shapes), settings);
    let excerpt = Excerpt::new(&whole, shapes.clone());
    let situation = excerpt.situation(&whole);
    let shapes = least_shapes(&situation, excerpt.shapes.clone());
    improvement.challenged(block, &situation, &shapes, settings)
}

/// The fewest structures that explain what is left: the surest, then the surest beside it, and so on.
fn least_shapes(situation: &Situation<'_>, mut open: Vec<Shape>) -> Vec<Shape> {
    let mut beside = situation.beside();
    let mut shapes = Vec::new();
    while shapes.len() < MOST_SHAPES {
        let Some(position) = surest(situation, &beside, &open) else { break };
        let shape = open.swap_remove(position);
        beside = beside.and(&shape.columns);
        shapes.push(shape);
    }
    shapes
}

/// Position of the surest of structures beside others, if it is significant there.
fn surest(situation: &Situation<'_>, beside: &System, shapes: &[Shape]) -> Option<usize> {
    let ln_p = |shape: &Shape| Some(fixed::test(beside, &shape.columns, |_| 1.0)?.ln_p);
    let judged = shapes.iter().enumerate().filter_map(|(position, shape)| Some((position, ln_p(shape)?)));
    let surest = judged.min_by(|a, b| a.1.total_cmp(&b.1));
    surest.filter(|(_, ln_p)| *ln_p < situation.ln_level).map(|(position, _)| position)
}
