//! The simulator of errors: each cause against an expectation derived without it, and the contract of them all.

#[path = "../common/beside.rs"]
mod beside;
mod contract;
mod fixture;
mod instruments;
mod interior;
mod published;
mod ray;
mod sensor;
mod shutter;
