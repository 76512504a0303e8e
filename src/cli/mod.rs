//! See the design: cli.
