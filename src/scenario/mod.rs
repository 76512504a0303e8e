//! See the design: scenario.
