//! See the design: evaluate.
