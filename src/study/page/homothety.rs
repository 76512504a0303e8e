//! S2: a homothety of the images (tables 2 and 3, figures 5 and 6).

use super::tables::{CHANGE_NOTE, SENSOR_PX, arrows, change_rows, change_table, published_change};
use crate::camera::{F, PPX, PPY};
use crate::report::figures::{ArrowSet, VectorField, vector_field};
use crate::report::html::Page;
use crate::report::numbers::{fixed, px, significant, with_sigma};
use crate::report::tables::Table;
use crate::study::published;
use crate::study::results::Results;
use anyhow::Result;

pub fn section(page: &mut Page, results: &Results) -> Result<()> {
    page.section("S2: a homothety in the images");
    page.paragraph(
        "b = 0.005 CQ, centred on the principal point (PP) or on the centre of distortion (DC); everything free.",
    );
    let (pp, dc) = (results.adjusted("s2-pp")?, results.adjusted("s2-dc")?);
    let mut table = (Table::new("Table 2: camera before and after, px"))
        .text("", "")
        .number("original", "px")
        .number("published, about PP", "px")
        .number("ours, about PP", "px")
        .number("published, about DC", "px")
        .number("ours, about DC", "px");
    for (k, name) in ["F", "PP x", "PP y", "DC x", "DC y"].into_iter().enumerate() {
        table.row([
            name.to_string(),
            fixed(published::CAMERA[k], 2),
            fixed(published::S2_ABOUT_PP[k], 2),
            fixed(pp.interior[k], 4),
            fixed(published::S2_ABOUT_DC[k], 2),
            fixed(dc.interior[k], 4),
        ]);
    }
    let ratio = pp.interior[F] / pp.true_interior[F] - 1.0;
    table.note(format!(
        "Relative change of the focal length: {} (the text prints 0.0049). Precision that 0.5 px of noise would leave: \
         F {}.",
        fixed(ratio, 6),
        with_sigma(pp.interior[F], pp.interior_sigma[F])
    ));
    page.table(&table);
    let mut table = change_table("Table 3: variation of the camera");
    published_change(&mut table, "published, about PP", published::S2_CHANGE_ABOUT_PP);
    change_rows(&mut table, "ours, about PP", pp);
    published_change(&mut table, "published, about DC", published::S2_CHANGE_ABOUT_DC);
    change_rows(&mut table, "ours, about DC", dc);
    table.note(CHANGE_NOTE);
    table.note("The published figures can only be of the whole camera: the distortion alone does not change by 15 px.");
    page.table(&table);
    let mut table =
        (Table::new("What is left")).text("", "").number("reprojection RMS", "px").number("check points RMS", "µm");
    table.row(["published".into(), published::S2_REPROJECTION_PX.to_string(), "order of 1".to_string()]);
    for (name, case) in [("ours, about PP", pp), ("ours, about DC", dc)] {
        let micrometres = significant(1e6 * case.erroneous_marks.check.rms_m.xyz, 2);
        table.row([name.into(), px(case.tie_rms_px), micrometres]);
    }
    page.table(&table);
    if let Some(pictures) = &pp.pictures {
        let largest = pictures.injected.iter().map(|v| v.d[0].hypot(v.d[1])).fold(0.0, f64::max);
        let mut error =
            VectorField::single("Homothetic error centred on PP", SENSOR_PX, arrows(&pictures.injected), "px");
        error.marks = vec![("principal point".into(), [pp.true_interior[PPX], pp.true_interior[PPY]])];
        page.figure(
            "s2-error",
            vector_field(&error),
            &format!(
                "Figure 5: the error as it stands in some of the measurements; largest shown {} px (published for the \
                 whole sensor: {} px).",
                px(largest),
                published::S2_LARGEST_PX
            ),
        );
        let set = |label: &str, field| ArrowSet { label: label.into(), arrows: arrows(field), ..ArrowSet::default() };
        let both = VectorField {
            title: "Homothetic error and change of the camera".into(),
            sets: vec![set("error", &pictures.injected), set("change of the camera", &pictures.camera_change)],
            ..error
        };
        page.figure(
            "s2-change",
            vector_field(&both),
            "Figure 6: the error and the change of the camera that takes it up.",
        );
    }
    Ok(())
}
