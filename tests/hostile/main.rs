//! What the surroundings do to the program: paths that are no text, places that take no files, kills, pipes that close, little memory, files that
//! never end, libraries that crash.

mod kills;
mod matrix;
mod outputs;
mod paths;
mod place;
mod plugins;
mod special;
