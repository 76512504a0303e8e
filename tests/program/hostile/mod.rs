//! The program in hostile surroundings: paths that are not UTF-8, outputs that refuse files, kills, pipes that close,
//! too little memory, files that never end, plug-ins that crash.

mod kills;
mod matrix;
mod memory;
mod outputs;
mod paths;
mod place;
mod plugins;
mod special;
