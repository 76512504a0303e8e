//! Control points, check points, GNSS positions and images by name.

use super::html::Page;
use super::numbers::{fixed, or_dash};
use super::pictures::RunFolder;
use super::tables::Table;
use crate::run::folder::CheckRow;

/// Points of a table that is not folded.
const OPEN: usize = 20;
/// The worst of those that are more.
const WORST: usize = 10;
/// Rows of a folded table; the tables of the folder have all.
const FOLDED: usize = 300;

/// Length of the difference in space, m.
pub(super) fn length(row: &CheckRow) -> f64 {
    row.dx.hypot(row.dy).hypot(row.dz)
}

/// Rows in the order of their differences, the largest first.
pub(super) fn worst_first<'a>(rows: &[&'a CheckRow]) -> Vec<&'a CheckRow> {
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| length(b).total_cmp(&length(a)));
    sorted
}

/// A table of points by name.
pub(super) fn table(caption: &str, rows: &[&CheckRow]) -> Table {
    let mut table = Table::new(caption).text("point", "");
    for name in ["dX", "dY", "dZ", "sX", "sY", "sZ"] {
        table = table.number(name, "mm");
    }
    for name in ["wX", "wY", "wZ", "images"] {
        table = table.number(name, "");
    }
    table = table.number("marks", "px");
    // Millimetres to two decimals where differences are small.
    let largest = rows.iter().map(|row| length(row)).fold(0.0, f64::max);
    let digits = if largest < 0.1 { 2 } else { 1 };
    for row in rows {
        let d = [row.dx, row.dy, row.dz];
        let sigma = [row.sigma_dx, row.sigma_dy, row.sigma_dz];
        let mm = |value: f64| fixed(1e3 * value, digits);
        let standardised = d
            .iter()
            .zip(sigma)
            .map(|(d, sigma)| or_dash(sigma.filter(|sigma| *sigma > 0.0), |sigma| fixed(d / sigma, 1)));
        let cells = std::iter::once(row.point.clone())
            .chain(d.iter().map(|d| mm(*d)))
            .chain(sigma.iter().map(|sigma| or_dash(*sigma, mm)))
            .chain(standardised)
            .chain([
                row.images.map_or("-".into(), |images| images.to_string()),
                or_dash(row.rms_px, |rms| fixed(rms, 2)),
            ]);
        table.row(cells);
    }
    table
}

/// The points of one role: all of them where they are few, else the worst, and more of them folded.
pub(super) fn by_name(page: &mut Page, name: &str, rows: &[&CheckRow]) {
    if rows.len() <= OPEN {
        page.table(&table(name, rows));
        return;
    }
    let worst = worst_first(rows);
    page.table(&table(&format!("{name}: the {WORST} with the largest differences of {}", rows.len()), &worst[..WORST]));
    let shown = worst.len().min(FOLDED);
    let which = if shown < rows.len() { format!("the {shown} worst of {}", rows.len()) } else { "all".to_string() };
    page.data(&format!("{name} by name: {which} (checks.csv has every point)"), |page| {
        page.table(&table("", &worst[..shown]));
    });
}

/// Why control points may differ more than check points, where they do.
pub(super) fn control_beside_check(run: &RunFolder) -> Option<String> {
    let (control, check) = (run.summary.control.as_ref()?, run.summary.check.as_ref()?);
    (control.rms_m.xyz > check.rms_m.xyz).then(|| {
        // Three coordinates a point; an RMS of k values is known to 1 / sqrt(2 k) of itself.
        let uncertainty = 100.0 / (6.0 * control.n as f64).sqrt();
        format!(
            "Control points differ by {} mm, check points by {} mm. The adjustment weighs control, it does not force \
             its differences to zero: both have the errors of their marks and of their survey. An RMS of {} points is \
             itself uncertain by {:.0} %, and check points may be surveyed more precisely.",
            super::headline::short_mm(control.rms_m.xyz),
            super::headline::short_mm(check.rms_m.xyz),
            control.n,
            uncertainty
        )
    })
}

/// GNSS positions by image, folded.
pub(super) fn gnss(page: &mut Page, run: &RunFolder) {
    let mut table = Table::new("").text("image", "");
    for name in ["dX", "dY", "dZ", "3D"] {
        table = table.number(name, "mm");
    }
    for row in run.gnss.iter().take(FOLDED) {
        let length = row.dx.hypot(row.dy).hypot(row.dz);
        let values = [row.dx, row.dy, row.dz, length].map(|value| fixed(1e3 * value, 1));
        table.row(std::iter::once(row.image.clone()).chain(values));
    }
    let n = run.gnss.len();
    let summary = match n > FOLDED {
        true => format!("GNSS positions by image: the first {FOLDED} of {n} (gnss.csv has all)"),
        false => format!("GNSS positions by image: all {n}"),
    };
    page.data(&summary, |page| {
        page.table(&table);
    });
}

/// Images by name, folded; `rms` of each is that of its tie points, px.
pub(super) fn images(page: &mut Page, run: &RunFolder, rms: &[Option<f64>]) {
    let mut table = Table::new("").text("image", "");
    for name in ["X", "Y", "Z"] {
        table = table.number(name, "m");
    }
    for name in ["sX", "sY", "sZ"] {
        table = table.number(name, "mm");
    }
    table = table.number("tie points, RMS", "px");
    for (image, rms) in run.images.iter().zip(rms).take(FOLDED) {
        let place = [image.x, image.y, image.z].map(|value| fixed(value, 3));
        let sigma = [image.sigma_cx, image.sigma_cy, image.sigma_cz];
        let sigma = sigma.map(|sigma| or_dash(sigma, |sigma| fixed(1e3 * sigma, 1)));
        let rms = or_dash(*rms, |rms| fixed(rms, 3));
        table.row(std::iter::once(image.image.clone()).chain(place).chain(sigma).chain([rms]));
    }
    let n = run.images.len();
    let summary = match n > FOLDED {
        true => format!("Images by name: the first {FOLDED} of {n} (images.csv has all)"),
        false => format!("Images by name: all {n}"),
    };
    page.data(&summary, |page| {
        page.table(&table);
    });
}
