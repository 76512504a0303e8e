//! See the design: report.
