//! Pictures, tables and the page that a run leaves behind.
//!
//! This module computes no statistics: it draws what it is given. The page of a run ([`run`]) is made from what its
//! folder holds and nothing else. A figure is a plain struct of `f64` data and one function that turns it into an SVG
//! text; a [`tables::Table`] prints to the terminal and to HTML; a [`html::Page`] collects headings, tables and figures
//! and writes `report.html` (one file, no script, nothing loaded from elsewhere) and the same pictures under
//! `figures/`.
//!
//! ```
//! use misclosure::diagnose::verdict::Verdict;
//! use misclosure::report::{figures, html::Page, tables::Table};
//!
//! let mut page = Page::new("Dike, four flights");
//! page.verdict(Verdict::Missing, "rolling-shutter explains what was left over.");
//! page.section("Residuals");
//! let mut table = Table::new("Check points").text("component", "").number("RMS", "mm");
//! table.row(["height", "0.92"]);
//! page.table(&table);
//! let field = figures::VectorField { title: "Mean residual".into(), width_px: 5120.0, height_px: 3840.0, unit: "px".into(),
//!     ..Default::default() };
//! page.figure("sensor", figures::vector_field(&field), "Mean residual by place on the sensor.");
//! assert!(page.html().contains("no data"));
//! ```
//!
//! The charts are written directly as SVG: the charting crates at hand round to whole pixels, which turns short arrows
//! by degrees, and cannot measure text without a font, which puts legends over data.

pub mod compare;
pub mod diagnosis_tables;
pub mod figures;
pub mod headline;
pub mod html;
pub mod letter;
pub mod numbers;
pub mod pictures;
pub mod run;
pub mod run_tables;
pub mod style;
pub mod tables;
pub mod words;

mod axes;
mod coverage;
mod detectable;
mod diagnosis;
mod finding;
mod frame;
mod geojson;
mod glossary;
mod html_text;
mod points;
mod provenance;
mod scale;
mod sensor_section;
mod sheet;
mod svg;
mod uncertainty;
