//! S3: a focal length that grows from image to image (figures 7 and 8, table 4).

use super::tables::{case_rows, check_table, judged_row, published_row, residual_figures};
use crate::camera::F;
use crate::math::probability::p_value;
use crate::report::figures::{Axis, LineChart, LineStyle, Panel, Series, line_chart};
use crate::report::html::Page;
use crate::report::numbers::{fixed, mm, percent};
use crate::scenario::Simulation;
use crate::study::published;
use crate::study::results::Results;
use anyhow::Result;

pub fn section(page: &mut Page, results: &Results, simulation: &Simulation) -> Result<()> {
    page.section("S3: a focal length that varies gradually");
    page.paragraph(
        "f(n) = f (1 + 1e-5)^n over the images in the order of the flights: oblique, nadir 50 m, nadir 30 m, nadir 70 \
         m. One camera is estimated for all images, everything free.",
    );
    let s3 = results.adjusted("s3")?;
    if let Some(pictures) = &s3.pictures {
        let block = &simulation.block;
        let mut series: Vec<Series> =
            block.flights.iter().map(|name| Series::new(name.clone(), Vec::new()).style(LineStyle::Markers)).collect();
        for (index, (image, focal)) in block.images.iter().zip(&pictures.focal_by_image).enumerate() {
            series[image.flight.index()].points.push([index as f64, *focal]);
        }
        let last = block.images.len().saturating_sub(1) as f64;
        let level = |label: &str, f: f64| Series::new(label, vec![[0.0, f], [last, f]]).style(LineStyle::Dashed);
        series.push(level("estimated for all", s3.interior[F]));
        series.push(level("error-free camera", s3.true_interior[F]));
        let panel = Panel {
            x: Axis::new("image in the order of flight", "").whole(),
            y: Axis::new("focal length", "px"),
            series,
            ..Panel::default()
        };
        let chart = LineChart {
            title: "Focal length along the flights".into(),
            panels: vec![panel],
            columns: 1,
            ..LineChart::default()
        };
        let ends =
            [pictures.focal_by_image.first(), pictures.focal_by_image.last()].map(|f| f.copied().unwrap_or(f64::NAN));
        let [first, last, estimated] = published::S3_FOCAL_PX;
        page.figure(
            "s3-focal",
            line_chart(&chart),
            &format!(
                "Figure 7: the focal length of each image, from its measurements and the true orientation. {} px in \
                 the first, {} px in the last (published: {first}, {last}). Estimated for all: {} px (published: \
                 {estimated}).",
                fixed(ends[0], 2),
                fixed(ends[1], 2),
                fixed(s3.interior[F], 2)
            ),
        );
    }
    let mut table = check_table("Table 4: residuals at the check points");
    published_row(&mut table, published::S3_CHECK_MM);
    case_rows(&mut table, s3);
    weights_rows(&mut table, results, "s3")?;
    if let Some(bowl) = s3.erroneous_marks.bowl {
        table.note(format!(
            "Bowl: height of the fitted quadratic over the length of the points, positive with the ends up. Here it is \
             {} mm, p {}, and explains {} of the scatter in height.",
            mm(bowl.height_m),
            p_value(bowl.p_value),
            percent(bowl.explained)
        ));
    }
    table.note(MARKS_NOTE);
    page.table(&table);
    if let Some(pictures) = &s3.pictures {
        residual_figures(page, "s3", "Gradually varied focal length", &pictures.erroneous, Some(8));
        page.details("The same with exact marks of the check points", |page| {
            residual_figures(
                page,
                "s3-exact",
                "Gradually varied focal length, exact check marks",
                &pictures.exact,
                None,
            );
        });
    }
    Ok(())
}

/// How marks and weights enter.
pub const MARKS_NOTE: &str = "The published check points are measured in the erroneous images, so part of the error \
                              cancels or adds up in the marks themselves. Exact marks show the deformation of the \
                              block alone. The published estimator weights ties by m (m - 1) (multi-points) or m (m - \
                              1)^2 (pairs), m the number of images. Its further radial terms r^9 and r^11 are not in \
                              our camera.";

/// The rows with other weights.
pub fn weights_rows(table: &mut crate::report::tables::Table, results: &Results, key: &str) -> Result<()> {
    for (name, text) in [("multi", "ours, ties weighted as multi-points"), ("pairs", "ours, ties weighted as pairs")] {
        let case = results.adjusted(&format!("{key}-{name}"))?;
        judged_row(table, text, &case.erroneous_marks);
    }
    Ok(())
}
