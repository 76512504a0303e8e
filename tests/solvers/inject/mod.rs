//! The simulator of errors: each cause against an expectation derived without it, the contract of them all, and
//! mistakes of people in the files.

mod contract;
mod fixture;
mod instruments;
mod interior;
mod mistakes;
mod published;
mod ray;
mod sensor;
mod shutter;
