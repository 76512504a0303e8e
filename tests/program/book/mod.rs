//! README and book: paths and links lead somewhere, commands exist, what a page shows is what the program prints, and
//! what a command makes is as it makes it.

mod commands;
mod contents;
mod made;
mod pages;
mod paths;
mod transcripts;
