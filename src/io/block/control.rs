//! `control.csv`: surveyed points, control or check; and which of them stay.

use super::super::csv_table::Table;
use super::super::error::{advice, shown};
use super::super::names::Names;
use super::super::table::TableWriter;
use super::block_toml::ReferenceFrame;
use super::{BLOCK, Error, SetAside};
use crate::block::{Measurement, PointId, Role, SurveyedPoint};
use std::path::Path;

const ROLES: [(&str, Role); 2] = [("control", Role::Control), ("check", Role::Check)];

/// Reads the points and numbers their names.
pub(super) fn read(table: &mut Table, frame: &ReferenceFrame) -> Result<(Vec<SurveyedPoint>, Names), Error> {
    let point = table.column("point")?;
    let coordinates = table.columns(["x", "y", "z"])?;
    let role_column = table.column("role")?;
    let (xy_column, z_column) = (table.optional_column("sigma_xy"), table.optional_column("sigma_z"));
    let (mut points, mut names) = (Vec::new(), Names::default());
    while table.next()? {
        let name = table.text(point)?;
        let (number, is_new) = names.insert(table.name(point)?);
        if !is_new {
            let problem =
                format!("point {} stands twice, first in line {}", shown(name.as_bytes()), table.line(number as usize));
            return Err(table.refuse(point, problem));
        }
        let role = table.text(role_column)?;
        let (_, role) = *ROLES.iter().find(|(text, _)| *text == role).ok_or_else(|| {
            let problem = format!(
                "expected control or check, found {}; {}",
                table.found(role_column),
                advice(role, &["control", "check"])
            );
            table.refuse(role_column, problem)
        })?;
        let surveyed = SurveyedPoint {
            name: name.to_owned(),
            position: table.vector(coordinates)?,
            role,
            sigma_xy: table.optional_positive(xy_column)?,
            sigma_z: table.optional_positive(z_column)?,
        };
        refuse_unknown_precision(table, &surveyed, frame)?;
        points.push(surveyed);
    }
    Ok((points, names))
}

/// Control takes part in the datum and needs a weight; a check point is only compared with.
fn refuse_unknown_precision(table: &Table, point: &SurveyedPoint, frame: &ReferenceFrame) -> Result<(), Error> {
    let sigmas = [
        (point.sigma_xy, frame.sigma.control_xy_m, "sigma_xy", "control_xy_m"),
        (point.sigma_z, frame.sigma.control_z_m, "sigma_z", "control_z_m"),
    ];
    for (sigma, default, column, key) in sigmas {
        if point.role == Role::Control && sigma.is_none() && default.is_infinite() {
            let problem =
                format!("control without standard deviation; give {column} here or {key} in {BLOCK}, [sigma]");
            return Err(table.refuse_row(problem));
        }
    }
    Ok(())
}

/// Refuses a control point without a mark, leaves out check points without one; numbers the others anew.
pub(super) fn keep_marked(
    points: &mut Vec<SurveyedPoint>,
    marks: &mut [Measurement],
    rays: &[u32],
    table: &Table,
    set_aside: &mut SetAside,
) -> Result<(), Error> {
    for (row, point) in points.iter().enumerate() {
        if point.role == Role::Control && rays[row] == 0 {
            let problem = format!(
                "control point {} has no mark; measure it in marks.csv or take its row out",
                shown(point.name.as_bytes())
            );
            return Err(table.refuse_row_at(row, problem));
        }
    }
    let mut kept = 0;
    let renumbered: Vec<PointId> = rays
        .iter()
        .map(|count| {
            let id = PointId::from(kept);
            kept += usize::from(*count > 0);
            id
        })
        .collect();
    for mark in marks {
        mark.point = renumbered[mark.point.index()];
    }
    set_aside.unmarked_checks = points.len() - kept;
    let mut rays = rays.iter();
    points.retain(|_| rays.next().is_some_and(|count| *count > 0));
    Ok(())
}

pub(super) fn write(points: &[SurveyedPoint], path: &Path) -> Result<(), Error> {
    let has_xy = points.iter().any(|point| point.sigma_xy.is_some());
    let has_z = points.iter().any(|point| point.sigma_z.is_some());
    let mut header = vec!["point", "x", "y", "z", "role"];
    header.extend(has_xy.then_some("sigma_xy"));
    header.extend(has_z.then_some("sigma_z"));
    let mut table = TableWriter::create(path, &header)?;
    for point in points {
        let role = match point.role {
            Role::Control => "control",
            Role::Check => "check",
        };
        table.text(&point.name).number(point.position.x).number(point.position.y).number(point.position.z).text(role);
        if has_xy {
            table.optional(point.sigma_xy);
        }
        if has_z {
            table.optional(point.sigma_z);
        }
        table.end_row()?;
    }
    table.finish()
}
