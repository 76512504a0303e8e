//! The tables of a block.

use crate::table::{Table, known};
use misclosure::block::{Block, Measurement, Role, TiePoint};
use misclosure::camera::PARAMETERS;

pub fn images(block: &Block) -> Table<'_> {
    let of = |row: usize| &block.images[row];
    let place = |at: Option<nalgebra::Vector3<f64>>| at.map_or([f64::NAN; 3], Into::into);
    let quaternion = move |row: usize| {
        let q = of(row).pose.rotation;
        [q.w, q.i, q.j, q.k]
    };
    Table::new(block.images.len())
        .text("image", move |row| &of(row).name)
        .text("camera", move |row| &block.cameras[of(row).camera.index()].id)
        .text("flight", move |row| &block.flights[of(row).flight.index()])
        .number("time_s", move |row| known(of(row).time_s))
        .number("temperature_c", move |row| known(of(row).temperature_c))
        .place(["x", "y", "z"], move |row| (of(row).pose.centre + block.origin).into())
        .number("qw", move |row| quaternion(row)[0])
        .number("qx", move |row| quaternion(row)[1])
        .number("qy", move |row| quaternion(row)[2])
        .number("qz", move |row| quaternion(row)[3])
        .place(["gnss_x", "gnss_y", "gnss_z"], move |row| place(of(row).gnss.map(|gnss| gnss.position + block.origin)))
        .number("gnss_sigma_xy", move |row| known(of(row).gnss.and_then(|gnss| gnss.sigma_xy)))
        .number("gnss_sigma_z", move |row| known(of(row).gnss.and_then(|gnss| gnss.sigma_z)))
        .place(["vx", "vy", "vz"], move |row| place(of(row).velocity))
        .place(["wx", "wy", "wz"], move |row| place(of(row).angular_velocity))
        .number("exposure_s", move |row| known(of(row).exposure_s))
        .number("focus_m", move |row| known(of(row).focus_m))
}

pub fn cameras(block: &Block) -> Table<'_> {
    let of = |row: usize| &block.cameras[row];
    let table = Table::new(block.cameras.len())
        .text("camera", move |row| &of(row).id)
        .index("width_px", move |row| of(row).width_px)
        .index("height_px", move |row| of(row).height_px)
        .number("pixel_um", move |row| known(of(row).pixel_um));
    let named = PARAMETERS.into_iter().enumerate();
    named.fold(table, |table, (k, name)| table.number(name, move |row| of(row).interior[k]))
}

pub fn points(points: &[TiePoint]) -> Table<'_> {
    Table::new(points.len())
        .text("point", |row| &points[row].name)
        .place(["x", "y", "z"], |row| points[row].position.map_or([f64::NAN; 3], Into::into))
}

pub fn measurements(rows: &[Measurement]) -> Table<'_> {
    Table::new(rows.len())
        .index("image", |row| rows[row].image.0)
        .index("point", |row| rows[row].point.0)
        .number("x", |row| rows[row].x)
        .number("y", |row| rows[row].y)
        .number("sigma", |row| known(rows[row].sigma))
}

pub fn control(block: &Block) -> Table<'_> {
    let of = |row: usize| &block.surveyed[row];
    Table::new(block.surveyed.len())
        .text("point", move |row| &of(row).name)
        .place(["x", "y", "z"], move |row| of(row).position.into())
        .text("role", move |row| if of(row).role == Role::Control { "control" } else { "check" })
        .number("sigma_xy", move |row| known(of(row).sigma_xy))
        .number("sigma_z", move |row| known(of(row).sigma_z))
}
