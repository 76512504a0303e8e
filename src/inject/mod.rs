//! Errors on purpose: simulates the *cause* of an error in the world and measures again.
//!
//! ```text
//! truth + causes ──► world (poses in motion, air, lens, sensor) ──► exact image points ──► noise, outliers, blunders ──► block
//! ```
//!
//! The measured (image, point) pairs stay as they are; their coordinates, the GNSS positions and the surveyed
//! coordinates are made anew from the truth. Whatever error or noise the block had before is therefore replaced (the
//! [`Report`] says by how much): name every error that the new block shall have in one call. Causes act in the order of
//! the [`registry`], whatever the order in which they are named: first the starting values, then the world, then the
//! instruments, noise last.
//!
//! Nothing here knows the estimator's formulas: a ray is traced, a row's instant is solved for, a trajectory is
//! followed. The one shared thing is the Fraser projection, which both take as the definition of the camera. Where a
//! cause is a mere definition (`radial-high`, say), its summary says so.
//!
//! A [`recipe`] makes a whole block: scenario, causes, random errors.
//!
//! [`mistakes`] of people come after all of this: they rewrite the files of the block.

mod apply;
mod causes;
mod injection;
pub mod mistakes;
mod observe;
mod parameters;
mod random;
pub mod recipe;
mod trajectory;
mod world;

pub use apply::{Applied, Injected, Other, Report, apply, apply_with};
pub use injection::{Injection, parse};
pub use observe::{Action, Dropped, Loss, Observations};
pub use parameters::{DefaultValue, ParameterSpec, Value, Values};
pub use random::Random;
pub use trajectory::Trajectory;
pub use world::World;

use anyhow::Result;

/// What a cause gets to prepare itself: its parameters, the true world, and random numbers of its own.
pub struct Setting<'a> {
    /// Parameters, defaults filled in.
    pub values: &'a Values,
    /// The true world.
    pub world: &'a World,
    /// A stream of random numbers that no other cause draws from.
    pub random: Random,
}

/// A cause at work, or nothing when its size is zero.
pub type Prepared = Result<Option<Box<dyn Action>>>;

/// One kind of error: its name, its parameters, and how it acts on a given world.
pub struct Cause {
    id: &'static str,
    summary: &'static str,
    parameters: &'static [ParameterSpec],
    prepare: fn(&mut Setting) -> Prepared,
}

impl Cause {
    /// Id on the command line.
    pub fn id(&self) -> &'static str {
        self.id
    }

    /// One sentence for the list of causes.
    pub fn summary(&self) -> &'static str {
        self.summary
    }

    /// Parameters, in the order of the list.
    pub fn parameters(&self) -> &'static [ParameterSpec] {
        self.parameters
    }

    /// The cause at work in a world; `None` when its size is zero, so that a zero error changes no bit.
    ///
    /// # Errors
    /// A parameter out of its range, or a block without what the cause needs (times, velocities, GNSS).
    pub fn prepare(&self, setting: &mut Setting) -> Prepared {
        (self.prepare)(setting)
    }
}

/// Every cause, in the order in which they act.
pub fn registry() -> &'static [&'static Cause] {
    causes::REGISTRY
}

/// The cause of an id.
pub fn find(id: &str) -> Option<&'static Cause> {
    registry().iter().copied().find(|cause| cause.id == id)
}
