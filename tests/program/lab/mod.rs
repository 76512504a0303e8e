//! The laboratory as a program: who is answered, what a step does, and that nothing of the tree is lost.

mod alone;
mod commands;
mod ends;
mod mistakes;
mod planning;
mod program;
mod security;
mod simulated;
mod steps;
mod tree;
