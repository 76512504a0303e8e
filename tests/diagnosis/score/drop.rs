//! The predicted drop of `v'Pv` against that of the refit, for every candidate that is linear in its parameters: within
//! five per cent up to ten standard deviations. Random and scanned effects are not: their refits estimate a variance,
//! or a place.

use super::blocks::{UNTESTABLE, everything_free, fitted, measured_under, preset, settings, small, with_noise};
use super::in_turn::in_turn;
use misclosure::block::Block;
use misclosure::diagnose::added::Added;
use misclosure::diagnose::candidate::{Addition, Candidate, candidates};
use misclosure::diagnose::competition::Competition;
use misclosure::diagnose::linearised::{Questions, with_candidates};
use misclosure::diagnose::objective::Members;
use misclosure::diagnose::refit::Refits;
use misclosure::diagnose::select::Searched;
use misclosure::effects::{self, Domain, Kind, Role};
use misclosure::run::fit::Fit;
use std::collections::BTreeSet;

/// What the catalogue asks.
const PREDICTED: f64 = 0.05;
/// Sizes in standard deviations: roots of the noncentrality.
const SIZES: [f64; 2] = [5.0, 10.0];

/// Typical sizes at which every effect is linear; the noncentrality goes with the square of the size.
const SMALL: f64 = 1e-3;

/// Information of what is held, in typical sizes.
const HELD: f64 = 1e18;

/// A candidate whose prediction may miss by more.
struct Exception {
    block: Option<&'static str>,
    id: &'static str,
    /// Predicted over refitted, less one.
    miss: std::ops::Range<f64>,
    reason: &'static str,
}

const EXCEPTIONS: [Exception; 2] = [
    Exception {
        block: None,
        id: "decentring-high",
        miss: -0.9..0.0,
        reason: "without it the centre of distortion runs hundreds of pixels away, and the score is taken there: it \
                 under-predicts",
    },
    Exception {
        block: Some("small"),
        id: "unflatness",
        miss: -0.1..0.1,
        reason: "few points: noise drives directions of which the base leaves little out of the linear range (without \
                 noise: 25.0776, 25.0784)",
    },
];

fn blocks() -> [Block; 3] {
    [small(), preset("dike", &[("points", 1000.0), ("check", 0.0)]), preset("closerange", &[])]
}

/// Predicted drop of a single candidate and that of its refit; `None` where the base leaves nothing of it.
fn predicted_and_refitted(block: &Block, base: &Fit, candidate: &Candidate) -> Option<(f64, f64)> {
    let added = &Added::default();
    let settings = settings();
    let tested = vec![(candidate.clone(), Searched::None)];
    let linearised = with_candidates(block, base, added, Questions { tested, ..Questions::nothing() }, &settings)
        .expect("a null model");
    let competition = Competition::new(&linearised, &Default::default(), &settings);
    // A refit has no prior of what is plausible: the objective adds that to what the refit leaves. Coefficients that
    // are not determined are held.
    let mut prior = linearised.prior_of_refit();
    let columns = &linearised.sets[0].columns;
    let estimated = linearised.situation(&settings).beside().determined(columns);
    columns.iter().filter(|column| !estimated.contains(column)).for_each(|column| prior[*column] = HELD);
    let objective = &competition.objective_under(&linearised, &prior);
    if objective.hypotheses.is_empty() {
        return None;
    }
    let (current, with) = (&Members::default(), Members::default().with_law(0));
    let predicted = objective.chi_square(current) - objective.chi_square(&with);
    let (linearised, settings) = (&linearised, &settings);
    let refits = Refits { block, fit: base, added, linearised, objective, current, settings };
    let refit = refits.refit(&with).expect("a refit");
    Some((predicted, base.chi_square() - refit.fit.chi_square()))
}

/// The candidates that are linear in their parameters; a lag is held at its nominal value.
fn linear_candidates(block: &Block) -> Vec<Candidate> {
    let base = fitted(block, &everything_free());
    let mut list = candidates(block, &base.problem, &base.model, &[]);
    list.retain(|candidate| candidate.testable() && !candidate.random() && !candidate.scanned());
    for candidate in &mut list {
        if let Addition::Effect(term) = &mut candidate.addition {
            let parameters = &term.effect.descriptor().parameters;
            let searched = parameters.iter().filter(|p| matches!(p.role, Role::Searched(Domain::Range(..))));
            let searched: Vec<String> = searched.map(|p| p.name.to_string()).collect();
            term.held.extend(searched);
        }
    }
    list
}

/// Predicted drop and that of the refit, with an effect of `sigmas` standard deviations in the block.
fn drops(block: &Block, candidate: &Candidate, sigmas: f64, seed: u64) -> Option<(f64, f64)> {
    let term = candidate.term()?;
    let model = everything_free();
    let exact = measured_under(block, term, SMALL);
    let (drop, _) = predicted_and_refitted(&exact, &fitted(&exact, &model), candidate)?;
    let size = SMALL * sigmas / drop.sqrt();
    let noisy = with_noise(&measured_under(block, term, size), seed);
    predicted_and_refitted(&noisy, &fitted(&noisy, &model), candidate)
}

#[test]
fn the_predicted_drop_is_that_of_the_refit() {
    let mut failures = Vec::new();
    let mut tested = BTreeSet::new();
    for block in blocks() {
        let candidates = linear_candidates(&block);
        let all: Vec<_> = candidates.iter().flat_map(|candidate| SIZES.map(|sigmas| (candidate, sigmas))).collect();
        let lines =
            in_turn(&all, |(candidate, sigmas)| (candidate.id.clone(), *sigmas, drops(&block, candidate, *sigmas, 1)));
        for (id, sigmas, drops) in lines {
            let Some((predicted, drop)) = drops else {
                println!("{:12} {id:18} {sigmas:4.0} sigma: nothing left by the base", block.name);
                continue;
            };
            tested.insert(id.clone());
            let miss = predicted / drop - 1.0;
            println!(
                "{:12} {id:18} {sigmas:4.0} sigma: predicted {predicted:9.3}, refit {drop:9.3}, {:+.2} %",
                block.name,
                100.0 * miss
            );
            let here =
                |exception: &&Exception| exception.id == id && exception.block.is_none_or(|name| name == block.name);
            let exception = EXCEPTIONS.iter().find(here).filter(|_| miss.abs() >= PREDICTED);
            let allowed = exception.map_or(-PREDICTED..PREDICTED, |exception| exception.miss.clone());
            if let Some(exception) = exception {
                println!("{:31} {}", "", exception.reason);
            }
            if !allowed.contains(&miss) {
                failures.push(format!("{} {id} at {sigmas} sigma: {:+.1} %", block.name, 100.0 * miss));
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    let linear = |effect: &&&dyn effects::Effect| {
        let place = |role: &Role| matches!(role, Role::Random(_) | Role::Searched(Domain::SensorX));
        effect.descriptor().kind == Kind::Physical
            && !effect.descriptor().parameters.iter().any(|parameter| place(&parameter.role))
    };
    let all: BTreeSet<String> =
        effects::catalogue().iter().filter(linear).map(|effect| effect.descriptor().id.to_string()).collect();
    let untestable: BTreeSet<String> = UNTESTABLE.iter().map(|id| id.to_string()).collect();
    assert!(tested.is_disjoint(&untestable), "blocks of this size cannot tell these: {UNTESTABLE:?}");
    assert_eq!(&tested | &untestable, all, "every other linear effect is tested in some block");
}
