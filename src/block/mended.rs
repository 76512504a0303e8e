//! A block in which mistakes are undone, in memory: the edits that `mend` makes in its files, those of surveyed
//! coordinates among them.

use super::change_position::change_position;
use super::edit::{Change, Edit};
use super::edited::apply;
use super::{Block, Gnss, Image, Role, SurveyedPoint};

/// Columns of an antenna position.
const GNSS: [&str; 3] = ["gnss_x", "gnss_y", "gnss_z"];
/// Columns of a surveyed point.
const POINT: [&str; 3] = ["x", "y", "z"];

/// The block with these edits, in their order. Names, and the order of images and points, stay as they are: numbers
/// of images and points are those of the block before. An image that an edit leaves out keeps its row, without
/// measurements and without a position.
///
/// # Errors
/// The edit that this block cannot have.
pub fn mended<'e>(block: &Block, edits: &'e [Edit]) -> Result<Block, &'e Edit> {
    let mut block = block.clone();
    for edit in edits {
        let done = match edit.file.as_str() {
            "control.csv" => change_points(&mut block, edit),
            "images.csv" if is_of_positions(&edit.change) => change_positions(&mut block, edit),
            _ => apply(&mut block, edit),
        };
        done.ok_or(edit)?;
    }
    Ok(block)
}

fn change_points(block: &mut Block, edit: &Edit) -> Option<()> {
    let origin = block.origin;
    if let Change::ExchangeValues { column, values: [a, b] } = &edit.change {
        return if column == "point" { exchange(&mut block.surveyed, a, b) } else { None };
    }
    let is_chosen = |point: &SurveyedPoint| {
        edit.concerns(|column| match column {
            "point" => Some(point.name.clone()),
            "role" => Some(if point.role == Role::Control { "control" } else { "check" }.into()),
            _ => None,
        })
    };
    for point in block.surveyed.iter_mut().filter(|point| is_chosen(point)) {
        match &edit.change {
            Change::Set { column, value } if column == "role" => {
                point.role = match value.as_str() {
                    "control" => Role::Control,
                    "check" => Role::Check,
                    _ => return None,
                };
            }
            change => change_position(&mut point.position, &origin, POINT, change)?,
        }
    }
    Some(())
}

/// Two points get each other's name: in place of that each gets the other one's coordinates, so that marks keep their
/// points.
fn exchange(points: &mut [SurveyedPoint], a: &str, b: &str) -> Option<()> {
    let find = |name: &str| points.iter().position(|point| point.name == name);
    let (a, b) = (find(a)?, find(b)?);
    if a == b {
        return None;
    }
    points.swap(a, b);
    let name = std::mem::take(&mut points[a].name);
    points[a].name = std::mem::replace(&mut points[b].name, name);
    Some(())
}

/// Does the change concern antenna positions, or whole rows that hold them?
fn is_of_positions(change: &Change) -> bool {
    let is_one = |column: &String| GNSS.contains(&column.as_str());
    match change {
        Change::Affine { column, .. } | Change::Set { column, .. } => is_one(column),
        Change::ExchangeColumns { columns } => columns.iter().all(is_one),
        Change::Clear { columns } | Change::Shift { columns, .. } => columns.iter().all(is_one),
        Change::Remove => true,
        Change::ExchangeValues { .. } | Change::Turn { .. } | Change::Distort { .. } | Change::Copy { .. } => false,
    }
}

fn change_positions(block: &mut Block, edit: &Edit) -> Option<()> {
    let (origin, flights) = (block.origin, &block.flights);
    let is_chosen = |image: &Image| {
        edit.concerns(|column| match column {
            "image" => Some(image.name.clone()),
            "flight" => Some(flights[image.flight.index()].clone()),
            _ => None,
        })
    };
    let chosen: Vec<usize> = (0..block.images.len()).filter(|k| is_chosen(&block.images[*k])).collect();
    match &edit.change {
        Change::Clear { columns } if GNSS.iter().all(|own| columns.iter().any(|column| column == own)) => {
            chosen.into_iter().for_each(|image| block.images[image].gnss = None);
        }
        Change::Remove => chosen.into_iter().for_each(|image| block.images[image].gnss = None),
        Change::Shift { columns, by, within } if GNSS.iter().all(|own| columns.iter().any(|column| column == own)) => {
            shift(block, &chosen, *by, within)?;
        }
        change => {
            for image in chosen {
                if let Some(gnss) = &mut block.images[image].gnss {
                    change_position(&mut gnss.position, &origin, GNSS, change)?;
                }
            }
        }
    }
    Some(())
}

/// Each image takes the position of the one so many places before it, in the list of its flight or in that of all; its
/// stated precision stays.
fn shift(block: &mut Block, chosen: &[usize], by: i64, within: &str) -> Option<()> {
    let list_of: Box<dyn Fn(&Image) -> usize> = match within {
        "" => Box::new(|_| 0),
        "flight" => Box::new(|image| image.flight.index()),
        _ => return None,
    };
    let mut lists: Vec<Vec<usize>> = vec![Vec::new(); block.flights.len().max(1)];
    chosen.iter().for_each(|image| lists[list_of(&block.images[*image])].push(*image));
    let before: Vec<Option<Gnss>> = block.images.iter().map(|image| image.gnss).collect();
    for list in lists {
        for (place, image) in list.iter().enumerate() {
            let from = usize::try_from(place as i64 - by).ok().and_then(|place| list.get(place));
            let position = from.and_then(|from| before[*from]).map(|gnss| gnss.position);
            let own = before[*image];
            block.images[*image].gnss = position.map(|position| Gnss {
                position,
                sigma_xy: own.and_then(|own| own.sigma_xy),
                sigma_z: own.and_then(|own| own.sigma_z),
            });
        }
    }
    Some(())
}
