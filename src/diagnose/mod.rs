//! See the design: diagnose.
