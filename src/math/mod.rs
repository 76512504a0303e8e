//! Rotations, statistics, finite differences and small linear algebra; knows nothing of images.

pub mod intersect;
pub mod rotation;
