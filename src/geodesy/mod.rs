//! Coordinate systems: by the names that programs give them, and local ones at a place of the ellipsoid.

pub mod crs;
pub mod exchanged;
pub mod geographic;
pub mod map;
pub mod survey;
