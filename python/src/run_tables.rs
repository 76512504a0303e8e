//! The tables of a result.

use crate::table::{Table, known};
use misclosure::run::folder::{GnssRow, OutlierRow, Tables};
use misclosure::run::{ResidualKind, ResidualRow};

pub fn residuals(rows: &[ResidualRow]) -> Table<'_> {
    Table::new(rows.len())
        .index("image", |row| rows[row].image.0)
        .index("point", |row| rows[row].point)
        .text("kind", |row| if rows[row].kind == ResidualKind::Tie { "tie" } else { "mark" })
        .number("x", |row| rows[row].observed[0])
        .number("y", |row| rows[row].observed[1])
        .number("rx", |row| rows[row].residual[0])
        .number("ry", |row| rows[row].residual[1])
        .number("sigma", |row| rows[row].sigma)
}

/// Poses, and every further column of `images.csv` that has numbers: standard deviations, values of effects.
pub fn images(tables: &Tables) -> Table<'_> {
    let block = &tables.images;
    let of = |row: usize| &block.images[row];
    let quaternion = move |row: usize| {
        let q = of(row).pose.rotation;
        [q.w, q.i, q.j, q.k]
    };
    let table = Table::new(block.images.len())
        .text("image", move |row| &of(row).name)
        .text("camera", move |row| &block.cameras[of(row).camera.index()].id)
        .text("flight", move |row| &block.flights[of(row).flight.index()])
        .place(["x", "y", "z"], move |row| of(row).pose.centre.into())
        .number("qw", move |row| quaternion(row)[0])
        .number("qx", move |row| quaternion(row)[1])
        .number("qy", move |row| quaternion(row)[2])
        .number("qz", move |row| quaternion(row)[3]);
    let is_number = |cell: &String| cell.is_empty() || cell.parse::<f64>().is_ok();
    let numeric = block.extra_image_columns.iter().filter(|(_, cells)| cells.iter().all(is_number));
    numeric.fold(table, |table, (name, cells)| {
        table.number(name.clone(), move |row| cells[row].parse().unwrap_or(f64::NAN))
    })
}

pub fn points(tables: &Tables) -> Table<'_> {
    let rows = &tables.points;
    Table::new(rows.len())
        .text("point", move |row| &rows[row].point)
        .place(["x", "y", "z"], move |row| [rows[row].x, rows[row].y, rows[row].z])
        .place(["sigma_x", "sigma_y", "sigma_z"], move |row| {
            [rows[row].sigma_x, rows[row].sigma_y, rows[row].sigma_z].map(known)
        })
        .index("images", move |row| rows[row].images.unwrap_or(0) as u32)
        .number("gsd_m", move |row| known(rows[row].gsd_m))
        .number("correlation_xy", move |row| known(rows[row].correlation_xy))
        .place(["easting", "northing", "height"], move |row| {
            [rows[row].easting, rows[row].northing, rows[row].height].map(known)
        })
}

pub fn checks(tables: &Tables) -> Table<'_> {
    let rows = &tables.checks;
    Table::new(rows.len())
        .text("point", move |row| &rows[row].point)
        .text("role", move |row| &rows[row].role)
        .place(["dx", "dy", "dz"], move |row| [rows[row].dx, rows[row].dy, rows[row].dz])
        .place(["x", "y", "z"], move |row| [rows[row].x, rows[row].y, rows[row].z])
        .place(["sigma_dx", "sigma_dy", "sigma_dz"], move |row| {
            [rows[row].sigma_dx, rows[row].sigma_dy, rows[row].sigma_dz].map(known)
        })
        .index("images", move |row| rows[row].images.unwrap_or(0) as u32)
        .number("rms_px", move |row| known(rows[row].rms_px))
        .place(["easting", "northing", "height"], move |row| {
            [rows[row].easting, rows[row].northing, rows[row].height].map(known)
        })
}

pub fn covariance(tables: &Tables) -> Table<'_> {
    let rows = &tables.covariance;
    Table::new(rows.len())
        .text("camera", move |row| &rows[row].camera)
        .text("parameter", move |row| &rows[row].parameter)
        .text("with_camera", move |row| &rows[row].with_camera)
        .text("with_parameter", move |row| &rows[row].with_parameter)
        .number("covariance", move |row| rows[row].covariance)
        .number("correlation", move |row| known(rows[row].correlation))
}

pub fn outliers(rows: &[OutlierRow]) -> Table<'_> {
    Table::new(rows.len())
        .text("image", |row| &rows[row].image)
        .text("point", |row| &rows[row].point)
        .text("kind", |row| &rows[row].kind)
        .text("reason", |row| &rows[row].reason)
}

pub fn gnss(rows: &[GnssRow]) -> Table<'_> {
    Table::new(rows.len())
        .text("image", |row| &rows[row].image)
        .place(["dx", "dy", "dz"], |row| [rows[row].dx, rows[row].dy, rows[row].dz])
        .place(["x", "y", "z"], |row| [rows[row].x, rows[row].y, rows[row].z])
        .number("time_s", |row| known(rows[row].time_s))
        .number("heading_deg", |row| known(rows[row].heading_deg))
}
