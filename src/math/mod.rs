//! Rotations, statistics, finite differences and small linear algebra; knows nothing of images.

pub mod finite_difference;
pub mod intersect;
pub mod rotation;
pub mod statistics;
