//! `points.csv`: approximate coordinates of tie points; and which tie points stay.

use super::super::csv_table::Table;
use super::super::error::shown;
use super::super::names::Names;
use super::super::table::TableWriter;
use super::{Error, SetAside};
use crate::block::{Measurement, PointId, TiePoint};
use nalgebra::Vector3;
use std::path::Path;

/// Reads the coordinates, and numbers the points in `names` in the order of the rows.
pub(super) fn read(table: &mut Table, names: &mut Names) -> Result<Vec<Vector3<f64>>, Error> {
    let point = table.column("point")?;
    let coordinates = table.columns(["x", "y", "z"])?;
    let mut positions = Vec::new();
    while table.next()? {
        table.text(point)?;
        let (number, is_new) = names.insert(table.name(point)?);
        if !is_new {
            let name = shown(table.cell(point));
            let problem = format!("point {name} stands twice, first in line {}", table.line(number as usize));
            return Err(table.refuse(point, problem));
        }
        positions.push(table.vector(coordinates)?);
    }
    Ok(positions)
}

/// Leaves out the points that do not intersect (fewer than two rays) and their measurements; numbers the others anew.
pub(super) fn keep_intersecting(
    ties: &mut Vec<Measurement>,
    rays: &[u32],
    names: &Names,
    positions: &[Vector3<f64>],
    set_aside: &mut SetAside,
) -> Vec<TiePoint> {
    let kept = rays.iter().filter(|count| **count >= 2).count();
    set_aside.one_ray_points = rays.iter().filter(|count| **count == 1).count();
    set_aside.unmeasured_points = rays.len() - kept - set_aside.one_ray_points;
    let mut points = Vec::with_capacity(kept);
    let mut renumbered = vec![None; rays.len()];
    for (number, count) in rays.iter().enumerate() {
        if *count >= 2 {
            renumbered[number] = Some(PointId::from(points.len()));
            let name = String::from_utf8_lossy(names.get(number)).into_owned();
            points.push(TiePoint { name, position: positions.get(number).copied() });
        }
    }
    ties.retain_mut(|tie| match renumbered[tie.point.index()] {
        Some(point) => {
            tie.point = point;
            true
        }
        None => false,
    });
    points
}

pub(super) fn write(points: &[TiePoint], path: &Path) -> Result<(), Error> {
    let mut table = TableWriter::create(path, &["point", "x", "y", "z"])?;
    for point in points {
        if let Some(position) = point.position {
            table.text(&point.name).number(position.x).number(position.y).number(position.z).end_row()?;
        }
    }
    table.finish()
}
