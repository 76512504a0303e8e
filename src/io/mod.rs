//! See the design: io.
