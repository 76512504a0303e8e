//! Which effects belong to the model: rules over the small system of a null model, each one function from a [`Situation`] to an [`Event`].
//!
//! | rule | says |
//! |---|---|
//! | [`need`] | what is in stays significant beside everything else that is in, and predicts images that its estimate did not see |
//! | [`entry`] | the surest of what is significant among all candidates enters, or is looked into where physics does not allow its size |
//! | [`chance`] | a law enters before independent values per image of the same quantity, and these only for what remains beside it |
//! | [`challenge`] | a structure that is left takes out only what it could itself be |
//! | [`instead`] | what is in has the names of all laws that could stand in its place |
//!
//! The same tests decide entry and need. No rule refits: whoever carries an event out fits, linearises again and asks again.

mod beside;
pub mod challenge;
pub mod chance;
pub mod entry;
mod event;
mod excerpt;
pub mod instead;
pub mod need;
mod situation;
#[cfg(test)]
mod tests;

pub use beside::{Beside, Known};
pub use event::Event;
pub use excerpt::Excerpt;
pub use situation::{Judged, Nature, Searched, Set, Situation, Taken};

/// What is asked for next: what has to leave leaves before anything enters. `None`: nothing enters, nothing leaves.
pub fn next(situation: &Situation<'_>) -> Option<Event> {
    need::rule(situation).or_else(|| entry::rule(situation))
}
