//! What a block would show before it is measured.
//!
//! The null model of an error-free block has the answer without a random number. Of the column `c` of an effect (the
//! derivative of the measurements by one of its parameters) everything that an adjustment estimates leaves the
//! information `m = c'Qc`. An effect of size `a` lowers `v'Pv` by a noncentral chi-square variable of noncentrality
//! `a^2 m`. The diagnosis takes the effect in where that exceeds its price:
//!
//! ```text
//!   density of the drop of v'Pv
//!        ▲      without the effect      of size a
//!        │ ╲                          ╭───────╮
//!        │  ╲                  ╭──────╯ 80 %  ╰──────╮
//!        └───────────────┼──────────────┼────────────────►
//!                      price          a^2 m
//! ```
//!
//! The smallest size is the one of a power of 80 %: `a = sqrt(noncentrality(price, dof) / m)`. An effect just below it
//! may be there unseen; what it would do to the points follows from the same linearisation. Reliability by Baarda (1968)
//! is the same of one wrong measurement.

pub mod choose;
pub mod goal;
mod hidden;
mod limits;
pub mod notice;
mod precision;
mod reliability;
pub mod said;
mod visible;
mod why;

pub use hidden::{Hidden, Typical};
pub use limits::Limits;
pub use precision::{OfChecks, OfPoint, Precision, Spread};
pub use reliability::Reliability;
pub use visible::{Size, Visible};

use crate::adjust::AdjustError;
use crate::adjust::native::pool::Pool;
use crate::block::{Block, Role};
use crate::diagnose::added::Added;
use crate::diagnose::knowledge::{Known, with_known};
use crate::diagnose::linearised::linearise_expected;
use crate::diagnose::run::base_as_stated;
use crate::diagnose::settings::Settings;
use crate::model::Model;
use crate::run::RunError;
use crate::score::power::POWER;
use crate::screening;
use serde::Serialize;

/// What a block would show.
#[derive(Debug, Clone, Serialize)]
pub struct Plan {
    /// Version of these keys.
    pub format: u32,
    /// Name of the block.
    pub block: String,
    /// Images.
    pub images: usize,
    /// Images that see too little to take part.
    pub blind: Vec<String>,
    /// Tie points.
    pub tie_points: usize,
    /// Measurements of tie points.
    pub tie_measurements: usize,
    /// Control points.
    pub control: usize,
    /// Check points.
    pub check: usize,
    /// Images with a GNSS position.
    pub gnss: usize,
    /// Family-wise significance of the diagnosis.
    pub significance: f64,
    /// Probability with which an effect of the smallest size is found.
    pub power: f64,
    /// Is the centre of distortion held at the principal point, because the block does not determine it?
    pub tied_centre: bool,
    /// Effects that the block can show; what hides most of the points' error first.
    pub effects: Vec<Visible>,
    /// Effects that it cannot show, whatever their size.
    pub hidden: Vec<Hidden>,
    /// Standard deviations of points and cameras.
    pub precision: Precision,
    /// Single wrong measurements: how large they must be to show.
    pub reliability: Vec<Reliability>,
    /// Effects whose size is known from the coordinate system.
    pub known: Vec<Known>,
}

impl Plan {
    /// What it shows of an effect.
    pub fn visible(&self, id: &str) -> Option<&Visible> {
        self.effects.iter().find(|own| own.effect == id)
    }
}

/// Level of a test of one residual alone, as usual in reliability (Baarda 1968).
const ALPHA: f64 = 1e-3;
/// Measurements without which an image has no orientation.
const FEWEST: usize = 3;
/// Mistakes of a block that was measured which are faults of one that is planned.
const FAULTS: [&str; 4] = ["unconnected", "too-few", "in-line", "collapsed"];

/// Why a block has no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// It cannot be adjusted, for a reason that its tables show.
    #[error("{0}")]
    Refused(String),
    /// An adjustment that failed.
    #[error(transparent)]
    Diagnose(#[from] RunError),
}

impl From<AdjustError> for PlanError {
    fn from(error: AdjustError) -> Self {
        Self::Diagnose(error.into())
    }
}

/// How much of a plan is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// All of it.
    Whole,
    /// Effects and check points alone, in two thirds of the time: no precision of tie points and parameters, and no
    /// reliability.
    Draft,
}

/// What `block` would show, whose measurements are free of errors, where they err as it states.
///
/// # Errors
/// A block that cannot be adjusted: the error names what it does not determine.
pub fn plan(block: &Block, model: &Model, settings: &Settings<'_>) -> Result<Plan, PlanError> {
    plan_to(Extent::Whole, block, model, settings)
}

/// [`plan`], or a part of it.
///
/// # Errors
/// As [`plan`].
pub fn plan_to(extent: Extent, block: &Block, model: &Model, settings: &Settings<'_>) -> Result<Plan, PlanError> {
    Pool::new(settings.options.threads)?.install(|| plan_in_pool(extent, block, model, settings))
}

fn plan_in_pool(extent: Extent, block: &Block, model: &Model, settings: &Settings<'_>) -> Result<Plan, PlanError> {
    let blind = blind(block);
    refuse_faults(block, model, &blind)?;
    // Nothing errs, so nothing is set aside.
    let settings =
        &Settings { plugins: settings.plugins, options: settings.options.clone(), snoop: false, ..*settings };
    let (model, known) = with_known(block, model);
    (settings.tell)("adjusting the error-free block");
    let (_, fit) = base_as_stated(block, &model, settings)?;
    (settings.tell)("testing what it would show of each effect");
    let added = Added { own: fit.model.effects.len(), ..Added::default() };
    let linearised = linearise_expected(block, &fit, &added, settings)?;
    let effects = visible::of_effects(block, &linearised, settings);
    let hidden = hidden::of_effects(block, &linearised, &effects);
    (settings.tell)("computing the precision of points");
    let certainty = match extent {
        Extent::Whole => Some(precision::certainty(&fit, &settings.options)?),
        Extent::Draft => None,
    };
    let precision = precision::of_fit(block, &fit, certainty.as_ref(), (&effects, &hidden), settings.options.threads)?;
    let reliability = certainty.map_or(Ok(Vec::new()), |certainty| reliability::of(&certainty, ALPHA))?;
    Ok(Plan {
        format: 1,
        block: block.name.clone(),
        images: block.images.len(),
        blind: blind.into_iter().map(|image| block.images[image].name.clone()).collect(),
        tie_points: block.tie_points.len(),
        tie_measurements: block.ties.len(),
        control: block.count(Role::Control),
        check: block.count(Role::Check),
        gnss: block.images.iter().filter(|image| image.gnss.is_some()).count(),
        significance: settings.significance,
        power: POWER,
        tied_centre: fit.model.tie_dc_to_pp && !model.tie_dc_to_pp,
        effects,
        hidden,
        precision,
        reliability,
        known,
    })
}

/// Images that see too little to have an orientation; they take no part.
fn blind(block: &Block) -> Vec<usize> {
    let mut seen = vec![0; block.images.len()];
    block.ties.iter().chain(&block.marks).for_each(|row| seen[row.image.index()] += 1);
    (0..seen.len()).filter(|image| seen[*image] < FEWEST).collect()
}

/// Refuses a block that no adjustment can hold together, and a flight that sees nothing.
fn refuse_faults(block: &Block, model: &Model, blind: &[usize]) -> Result<(), PlanError> {
    for (flight, name) in block.flights.iter().enumerate() {
        let mut of_flight = (0..block.images.len()).filter(|image| block.images[*image].flight.index() == flight);
        if of_flight.clone().next().is_some() && of_flight.all(|image| blind.contains(&image)) {
            return Err(PlanError::Refused(format!(
                "all images of flight {name} have fewer than {FEWEST} measurements: look at flying height, overlap and \
                 where the camera looks"
            )));
        }
    }
    let mistakes = screening::of_values(block).into_iter().chain(screening::of_datum(block, model));
    let faults: Vec<String> =
        mistakes.filter(|own| FAULTS.contains(&own.kind.as_str())).map(|own| own.sentence).collect();
    if faults.is_empty() { Ok(()) } else { Err(PlanError::Refused(faults.join(" "))) }
}
