//! The researcher's kit: from an empty folder with the installed package alone to an effect that is found, and every
//! way in which that can fail.

mod examples;
mod failures;
mod injected;
mod installed;
mod library;
mod place;
mod templates;
mod worked_through;
