//! S1: a focal length that is wrong and held (figure 4).

use super::findings::s1_curves;
use crate::report::figures::{Axis, LineChart, Panel, Series, line_chart};
use crate::report::html::Page;
use crate::report::numbers::{fixed, mm, percent, px};
use crate::report::tables::Table;
use crate::study::cases::{FOCAL_ERRORS_PX, s1_key};
use crate::study::results::{Results, asymmetry, proportionality};
use anyhow::Result;

pub fn section(page: &mut Page, results: &Results) -> Result<()> {
    page.section("S1: an erroneous focal length");
    page.paragraph(
        "The focal length of the start values is wrong by -50 to +50 px and held; everything else is free. Once with \
         all flights, once without the oblique one. The image measurements have no error.",
    );
    let (all, nadir) = (s1_curves(results, "all")?, s1_curves(results, "nadir")?);
    let scaled = |curve: &[[f64; 2]], factor: f64| curve.iter().map(|[x, y]| [*x, factor * y]).collect::<Vec<_>>();
    let panel = |title: &str, y: Axis, series: Vec<Series>| Panel {
        title: title.into(),
        x: Axis::new("error of f", "px"),
        y,
        series,
    };
    let rms = || Axis::new("RMS", "mm").from_zero();
    let chart = LineChart {
        title: "Check points and camera height against the error of the focal length".into(),
        panels: vec![
            panel("check points, all flights", rms(), vec![Series::new("all flights", scaled(&all[0], 1e3))]),
            panel("check points, nadir flights", rms(), vec![Series::new("nadir flights", scaled(&nadir[0], 1e3))]),
            panel(
                "change of mean camera height",
                Axis::new("change", "m"),
                vec![Series::new("all flights", all[1].clone()), Series::new("nadir flights", nadir[1].clone())],
            ),
        ],
        columns: 3,
        ..LineChart::default()
    };
    page.figure(
        "s1",
        line_chart(&chart),
        "Figure 4: left all flights, middle nadir flights, right the camera height of both.",
    );
    let mut table =
        (Table::new("S1 in figures: RMS at the check points, change of camera height, reprojection RMS of the ties"))
            .number("error of f", "px")
            .number("RMS, all", "mm")
            .number("RMS, nadir", "mm")
            .number("height, all", "m")
            .number("height, nadir", "m")
            .number("ties, all", "px")
            .number("ties, nadir", "px");
    for (k, error) in FOCAL_ERRORS_PX.into_iter().enumerate() {
        let residual = |group: &str| Ok::<_, anyhow::Error>(px(results.adjusted(&s1_key(group, error))?.tie_rms_px));
        table.row([
            error.to_string(),
            mm(all[0][k][1]),
            mm(nadir[0][k][1]),
            fixed(all[1][k][1], 4),
            fixed(nadir[1][k][1], 4),
            residual("all")?,
            residual("nadir")?,
        ]);
    }
    for (name, curves) in [("All flights", &all), ("Nadir flights", &nadir)] {
        let sizes: Vec<[f64; 2]> = curves[0].iter().map(|[x, y]| [x.abs(), *y]).collect();
        let ((rms, rms_law), (height, height_law)) = (proportionality(&sizes), proportionality(&curves[1]));
        table.note(format!(
            "{name}: {} mm RMS per px of error, linear to {}, symmetric to {}; {} mm of camera height per px, linear \
             to {}.",
            mm(rms),
            percent(rms_law),
            percent(asymmetry(&curves[0])),
            mm(height),
            percent(height_law)
        ));
    }
    page.table(&table);
    Ok(())
}
