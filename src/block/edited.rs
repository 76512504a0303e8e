//! Edits of a block's tables, in memory: what a diagnosis goes on with where conventions are wrong. (Surveyed
//! coordinates are left out instead, and are no part of this: [`super::mended`] changes them, too.)

use super::change_position::change_position;
use super::edit::{Change, Edit};
use super::{Block, Camera, Image};
use crate::camera::{PARAMETERS, fraser};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// The block with some edits; `None` where one of them is none of measurements, cameras, poses, or of what the
/// platform recorded.
pub fn edited(block: &Block, edits: &[Edit]) -> Option<Block> {
    let mut block = block.clone();
    edits.iter().try_for_each(|edit| apply(&mut block, edit))?;
    Some(block)
}

/// Makes one edit; `None` where it is none of those.
pub(super) fn apply(block: &mut Block, edit: &Edit) -> Option<()> {
    // Does a row take part, by what it has in a column?
    let chosen = |cell: &dyn Fn(&str) -> Option<String>| edit.concerns(cell);
    match edit.file.as_str() {
        "block.toml" => {
            let own =
                |camera: &&mut Camera| chosen(&|column| if column == "id" { Some(camera.id.clone()) } else { None });
            if let Change::Copy { id } = &edit.change {
                let copies: Vec<Camera> = block.cameras.iter_mut().filter(own).map(|camera| camera.clone()).collect();
                block.cameras.extend(copies.into_iter().map(|camera| Camera { id: id.clone(), ..camera }));
                return Some(());
            }
            block.cameras.iter_mut().filter(own).try_for_each(|camera| change_camera(camera, &edit.change))
        }
        "images.csv" => {
            let (origin, flights) = (block.origin, &block.flights);
            let camera = |change: &Change| match change {
                Change::Set { column, value } if column == "camera" => {
                    block.cameras.iter().position(|camera| camera.id == *value)
                }
                _ => None,
            };
            let camera = camera(&edit.change);
            let own = |image: &&mut Image| {
                chosen(&|column| match column {
                    "image" => Some(image.name.clone()),
                    "flight" => Some(flights[image.flight.index()].clone()),
                    _ => None,
                })
            };
            let mut images = block.images.iter_mut().filter(own);
            match camera {
                Some(camera) => images.for_each(|image| image.camera = camera.into()),
                None => images.try_for_each(|image| change_image(image, &origin, &edit.change))?,
            }
            Some(())
        }
        file @ ("ties.csv" | "marks.csv") => {
            let (images, ties) = (&block.images, file == "ties.csv");
            let (tie_points, surveyed) = (&block.tie_points, &block.surveyed);
            let rows = if ties { &mut block.ties } else { &mut block.marks };
            let own = |row: &super::Measurement| {
                chosen(&|column| match column {
                    "image" => Some(images[row.image.index()].name.clone()),
                    "point" if ties => Some(tie_points[row.point.index()].name.clone()),
                    "point" => Some(surveyed[row.point.index()].name.clone()),
                    _ => None,
                })
            };
            match &edit.change {
                Change::Remove => rows.retain(|row| !own(row)),
                Change::ExchangeValues { column, values } if column == "image" => {
                    let find = |name: &String| images.iter().position(|image| image.name == *name);
                    let [a, b] = [find(&values[0])?, find(&values[1])?];
                    for row in rows.iter_mut() {
                        let at = row.image.index();
                        row.image = if at == a {
                            b.into()
                        } else if at == b {
                            a.into()
                        } else {
                            row.image
                        };
                    }
                }
                change => {
                    for row in rows.iter_mut().filter(|row| own(row)) {
                        change_pair([&mut row.x, &mut row.y], ["x", "y"], change)?;
                    }
                }
            }
            Some(())
        }
        // Tie points without measurements are intersected or left out.
        "points.csv" => Some(()),
        _ => None,
    }
}

/// Changes two numbers by the names of their columns.
fn change_pair([x, y]: [&mut f64; 2], names: [&str; 2], change: &Change) -> Option<()> {
    match change {
        Change::Affine { column, factor, offset } if column == names[0] => *x = factor * *x + offset,
        Change::Affine { column, factor, offset } if column == names[1] => *y = factor * *y + offset,
        Change::ExchangeColumns { columns } if columns.iter().all(|own| names.contains(&own.as_str())) => {
            std::mem::swap(x, y);
        }
        Change::Distort { interior } => [*x, *y] = fraser::distort(interior, *x, *y),
        _ => return None,
    }
    Some(())
}

fn change_camera(camera: &mut Camera, change: &Change) -> Option<()> {
    let position = |column: &String| PARAMETERS.iter().position(|parameter| parameter == column);
    match change {
        Change::Affine { column, factor, offset } => {
            let own = &mut camera.interior[position(column)?];
            *own = factor * *own + offset;
        }
        Change::ExchangeColumns { columns }
            if columns.iter().all(|own| ["width_px", "height_px"].contains(&own.as_str())) =>
        {
            std::mem::swap(&mut camera.width_px, &mut camera.height_px);
        }
        Change::Set { column, value } => match column.as_str() {
            "width_px" => camera.width_px = value.parse().ok()?,
            "height_px" => camera.height_px = value.parse().ok()?,
            _ => camera.interior[position(column)?] = value.parse().ok()?,
        },
        Change::ExchangeColumns { columns: [a, b] } => camera.interior.swap(position(a)?, position(b)?),
        _ => return None,
    }
    Some(())
}

fn change_image(image: &mut Image, origin: &Vector3<f64>, change: &Change) -> Option<()> {
    const CENTRE: [&str; 3] = ["x", "y", "z"];
    const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];
    const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];
    let columns = match change {
        Change::Turn { inverse, after, before } => {
            let [after, before] = [after, before].map(|q| Quaternion::new(q[0], q[1], q[2], q[3]));
            let own = image.pose.rotation;
            let own = if *inverse { own.inverse() } else { own };
            image.pose.rotation = UnitQuaternion::from_quaternion(after * own.into_inner() * before);
            return Some(());
        }
        Change::Clear { columns } => return columns.iter().try_for_each(|column| clear(image, column, &VELOCITY)),
        Change::Affine { column, .. } | Change::Set { column, .. } => std::slice::from_ref(column),
        Change::ExchangeColumns { columns } => columns,
        _ => return None,
    };
    let are_in = |own: &[&str]| columns.iter().all(|column| own.contains(&column.as_str()));
    if are_in(&CENTRE) {
        return change_position(&mut image.pose.centre, origin, CENTRE, change);
    }
    if are_in(&VELOCITY) {
        let mut velocities = image.velocity.iter_mut();
        return velocities.try_for_each(|own| change_position(own, &Vector3::zeros(), VELOCITY, change));
    }
    match change {
        Change::Affine { column, factor, offset } => {
            let value = match column.as_str() {
                "time_s" => &mut image.time_s,
                "temperature_c" => &mut image.temperature_c,
                _ => return None,
            };
            *value = value.map(|own| factor * own + offset);
        }
        Change::ExchangeColumns { columns: [a, b] } => {
            let part = |column: &String| QUATERNION.iter().position(|name| name == column);
            let [x, y, z, w]: [f64; 4] = image.pose.rotation.coords.into();
            let mut parts = [w, x, y, z];
            parts.swap(part(a)?, part(b)?);
            let [w, x, y, z] = parts;
            image.pose.rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        }
        _ => return None,
    }
    Some(())
}

/// Empties a cell of the platform's records; a velocity has three or none.
fn clear(image: &mut Image, column: &str, velocity: &[&str; 3]) -> Option<()> {
    match column {
        "time_s" => image.time_s = None,
        "temperature_c" => image.temperature_c = None,
        column if velocity.contains(&column) => image.velocity = None,
        _ => return None,
    }
    Some(())
}
