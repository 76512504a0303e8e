//! What is left beside the effects that are in: structure that no named effect explains, and what it may take out.

use super::candidate::Candidate;
use super::catalogue;
use super::fit::{DiagnoseError, Fit};
use super::improve::Improvement;
use super::linearised::{Linearised, Questions, with_candidates};
use super::select::challenge::Shape;
use super::select::{Excerpt, Judged, Situation};
use super::settings::Settings;
use super::structure::{self, Structure};
use super::test::fixed;
use crate::adjust::native::null_model::measurements_at;
use crate::block::Block;
use crate::run;

/// What is left.
pub struct Left {
    /// Every candidate that names a cause, beside what is in, surest first.
    pub judged: Vec<Judged>,
    /// Empirical fields that are significant.
    pub fields: Vec<Field>,
    /// Tests of structure.
    pub structure: Structure,
    /// The fit with the columns of empirical fields and of all tests of structure.
    pub shapes: Linearised,
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
    let (shapes, structure) = structure_of(block, improvement, settings)?;
    let of_shapes = shapes.situation(settings, &Default::default());
    let all = of_shapes.judge_all(&of_shapes.beside());
    let fields = all.iter().filter(|judged| judged.ln_p < situation.ln_level).map(|judged| {
        let id = shapes.sets[judged.set].id.clone();
        Field { id, drop: judged.drop, dof: judged.dof }
    });
    let fields = fields.collect();
    Ok(Left { judged, fields, structure, shapes })
}

fn structure_of(
    block: &Block,
    improvement: &Improvement,
    settings: &Settings<'_>,
) -> Result<(Linearised, Structure), DiagnoseError> {
    let fit = &improvement.fit;
    let Fit { problem, solution, .. } = fit;
    let state = &solution.state;
    let comparison = run::compare(block, problem, solution)?;
    let measurements = measurements_at(problem, state, settings.options.threads)?;
    let layout = structure::Layout::new(problem, state, &measurements, settings.options.threads)?;
    let is_field = |candidate: &Candidate| !candidate.physical;
    let (fields, _) = catalogue::candidates(block, fit, &improvement.parts, settings.plugins, is_field);
    layout.analyse(comparison.as_ref(), settings.significance, |columns| {
        let asked = Questions { tested: fields, extra: columns, clustered: true, ..Questions::nothing() };
        let linearised = with_candidates(block, fit, &improvement.parts, asked, settings)?;
        let beside = linearised.situation(settings, &Default::default()).beside().into_system();
        let spread = structure::Spread::of(&linearised.scores);
        Ok((linearised, beside, spread))
    })
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
    if improvement.added.is_empty() {
        return Ok(false);
    }
    let whole = improvement.situation(&left.shapes, settings);
    let excerpt = Excerpt::new(&whole, significant_shapes(&whole, left, settings.significance));
    let situation = excerpt.situation(&whole);
    let shapes = least_shapes(&situation, excerpt.shapes.clone());
    improvement.challenged(block, &situation, &shapes, settings)
}

/// Structures that are significant, each by itself.
fn significant_shapes(situation: &Situation<'_>, left: &Left, significance: f64) -> Vec<Shape> {
    let significant = |against: &str| {
        let test = left.structure.test(against);
        test.is_some_and(|test| test.family_p_value < significance) && !NOISE.contains(&against)
    };
    let tests = left.structure.columns.iter().filter(|(against, _)| significant(against));
    let tests = tests.map(|(against, columns)| Shape { name: against.to_string(), columns: columns.clone() });
    let fields = situation.sets.iter().filter(|set| left.fields.iter().any(|field| field.id == set.id));
    tests.chain(fields.map(|set| Shape { name: set.id.clone(), columns: set.columns.clone() })).collect()
}

/// The fewest structures that explain what is left: the surest, then the surest beside it, and so on.
fn least_shapes(situation: &Situation<'_>, mut open: Vec<Shape>) -> Vec<Shape> {
    let mut beside = situation.beside();
    let mut shapes = Vec::new();
    while shapes.len() < MOST_SHAPES {
        let judged = open
            .iter()
            .enumerate()
            .filter_map(|(position, shape)| Some((position, fixed::test(&beside, &shape.columns, |_| 1.0)?.ln_p)));
        let surest = judged.min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((position, _)) = surest.filter(|(_, ln_p)| *ln_p < situation.ln_level) else { break };
        let shape = open.swap_remove(position);
        beside = beside.and(&shape.columns);
        shapes.push(shape);
    }
    shapes
}
