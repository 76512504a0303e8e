//! See the design: inject.
