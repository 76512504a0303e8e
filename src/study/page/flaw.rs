//! S4: a local error on the sensor (figures 9 and 10, tables 5 and 6).

use super::drift::{MARKS_NOTE, weights_rows};
use super::tables::{
    CHANGE_NOTE, SENSOR_PX, arrows, case_rows, change_rows, change_table, check_table, published_change, published_row,
    residual_figures,
};
use crate::report::figures::{VectorField, vector_field};
use crate::report::html::Page;
use crate::study::published;
use crate::study::results::Results;
use anyhow::Result;

pub fn section(page: &mut Page, results: &Results) -> Result<()> {
    page.section("S4: a local error on the sensor");
    page.paragraph(
        "b = lambda exp(-|CQ|²/sigma²) CQ/|CQ| with C (1000, 1000), lambda 10 px, sigma 200 px; everything free. The \
         printed exponent lacks its minus sign: as printed the error would grow without bound.",
    );
    let s4 = results.adjusted("s4")?;
    let mut table = change_table("Table 5: variation of the camera");
    published_change(&mut table, "published", published::S4_CHANGE);
    change_rows(&mut table, "ours", s4);
    for (name, text) in [("multi", "ours, multi-points"), ("pairs", "ours, pairs")] {
        change_rows(&mut table, text, results.adjusted(&format!("s4-{name}"))?);
    }
    table.note(CHANGE_NOTE);
    page.table(&table);
    if let Some(pictures) = &s4.pictures {
        let field = |title: &str, vectors| VectorField::single(title, SENSOR_PX, arrows(vectors), "px");
        page.pair(
            (
                "s4-error",
                vector_field(&field("Local error", &pictures.injected)),
                "The error as it stands in some of the measurements.",
            ),
            (
                "s4-change",
                vector_field(&field("Change of the camera", &pictures.camera_change)),
                "Figure 9: the change of the camera, which has another shape. The scale is not that of the error.",
            ),
        );
    }
    let mut table = check_table("Table 6: residuals at the check points");
    published_row(&mut table, published::S4_CHECK_MM);
    case_rows(&mut table, s4);
    weights_rows(&mut table, results, "s4")?;
    table.note(MARKS_NOTE);
    page.table(&table);
    if let Some(pictures) = &s4.pictures {
        residual_figures(page, "s4", "Local Gaussian error", &pictures.erroneous, Some(10));
        page.details("The same with exact marks of the check points", |page| {
            residual_figures(page, "s4-exact", "Local Gaussian error, exact check marks", &pictures.exact, None);
        });
    }
    Ok(())
}
