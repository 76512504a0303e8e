//! What a block of columns must keep, as one of files: names once, positions that are there, measurements on the sensor.
//! What serves nothing is left out and counted.

use misclosure::block::{Block, CameraId, Measurement, PointId, Role};
use misclosure::io::block::{Loaded, SetAside};
use std::collections::HashMap;
use std::fmt;

/// As the reader of a block's files: a measurement may lie outside the sensor by this part of its longer side.
const OUTSIDE_MARGIN: f64 = 0.1;

/// What is wrong in an argument; rows count from 0, as Python counts.
#[derive(Debug)]
pub struct Wrong {
    pub argument: &'static str,
    pub row: Option<usize>,
    pub column: String,
    pub problem: String,
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { argument, row, column, problem } = self;
        f.write_str(argument)?;
        row.iter().try_for_each(|row| write!(f, ", row {row}"))?;
        if !column.is_empty() {
            write!(f, ", column {column}")?;
        }
        write!(f, ": {problem}")
    }
}

fn wrong(argument: &'static str, row: usize, column: &str, problem: String) -> Wrong {
    Wrong { argument, row: Some(row), column: column.to_owned(), problem }
}

/// The block without what serves nothing.
pub fn checked(mut block: Block) -> Result<Loaded, Wrong> {
    let whole =
        |argument, problem: &str| Wrong { argument, row: None, column: String::new(), problem: problem.to_owned() };
    if block.cameras.is_empty() {
        return Err(whole("cameras", "expected one at least"));
    }
    names("cameras", "camera", block.cameras.iter().map(|camera| camera.id.as_str()))?;
    for (row, camera) in block.cameras.iter().enumerate() {
        if camera.width_px == 0 || camera.height_px == 0 {
            return Err(wrong("cameras", row, "width_px, height_px", "expected numbers above zero".into()));
        }
        let [f, ..] = camera.interior;
        if f <= 0.0 {
            return Err(wrong("cameras", row, "f", format!("expected a number above zero, found {f}")));
        }
    }
    names("images", "image", block.images.iter().map(|image| image.name.as_str()))?;
    for (row, image) in block.images.iter().enumerate() {
        if image.camera.index() >= block.cameras.len() {
            return Err(wrong("images", row, "camera", unknown(image.camera.0, "cameras", block.cameras.len())));
        }
        let sigma = image.gnss.map_or(0.0, |gnss| {
            let xy = gnss.sigma_xy.unwrap_or(block.sigma.gnss_xy_m);
            xy.max(gnss.sigma_z.unwrap_or(block.sigma.gnss_z_m))
        });
        if sigma.is_infinite() {
            let problem = "no standard deviation; give these columns, or gnss_xy_m and gnss_z_m in sigma";
            return Err(wrong("images", row, "gnss_sigma_xy, gnss_sigma_z", problem.into()));
        }
    }
    names("points", "point", block.tie_points.iter().map(|point| point.name.as_str()))?;
    names("control", "point", block.surveyed.iter().map(|point| point.name.as_str()))?;
    measurements("ties", &block, &block.ties, ("points", block.tie_points.len()), block.sigma.tie_px)?;
    measurements("marks", &block, &block.marks, ("control", block.surveyed.len()), block.sigma.mark_px)?;
    let mut set_aside = SetAside::default();
    let rays = rays("ties", &block, &block.ties, block.tie_points.len())?;
    set_aside.one_ray_points = rays.iter().filter(|rays| **rays == 1).count();
    set_aside.unmeasured_points = rays.iter().filter(|rays| **rays == 0).count();
    keep(&mut block.tie_points, &mut block.ties, |k, _| rays[k] >= 2);
    let rays = self::rays("marks", &block, &block.marks, block.surveyed.len())?;
    for (row, point) in block.surveyed.iter().enumerate().filter(|(_, point)| point.role == Role::Control) {
        if rays[row] == 0 {
            let problem = "a control point without a mark; measure it in marks, or leave it out";
            return Err(wrong("control", row, "point", problem.into()));
        }
        let sigma =
            [point.sigma_xy.unwrap_or(block.sigma.control_xy_m), point.sigma_z.unwrap_or(block.sigma.control_z_m)];
        if sigma.iter().any(|sigma| sigma.is_infinite()) {
            let problem = "no standard deviation; give these columns, or control_xy_m and control_z_m in sigma";
            return Err(wrong("control", row, "sigma_xy, sigma_z", problem.into()));
        }
    }
    set_aside.unmarked_checks = rays.iter().filter(|rays| **rays == 0).count();
    keep(&mut block.surveyed, &mut block.marks, |k, _| rays[k] > 0);
    if block.ties.is_empty() && block.marks.is_empty() {
        return Err(whole("ties", "no tie point is measured in two images, and there are no marks"));
    }
    set_aside.unused_cameras = leave_out_unused_cameras(&mut block);
    Ok(Loaded { block, set_aside })
}

fn unknown(found: u32, argument: &str, count: usize) -> String {
    format!("{found} is no row of {argument}, which has {count}")
}

/// Every name once, and such that a file can hold it.
fn names<'a>(argument: &'static str, column: &str, all: impl Iterator<Item = &'a str>) -> Result<(), Wrong> {
    let mut rows = HashMap::new();
    for (row, name) in all.enumerate() {
        if name.is_empty() || name.trim() != name || name.contains(char::is_control) {
            let problem = format!("expected a name without blanks at its ends or control characters, found {name:?}");
            return Err(wrong(argument, row, column, problem));
        }
        if let Some(first) = rows.insert(name, row) {
            return Err(wrong(argument, row, column, format!("{name:?} stands twice, first in row {first}")));
        }
    }
    Ok(())
}

fn measurements(
    argument: &'static str,
    block: &Block,
    rows: &[Measurement],
    (points, count): (&str, usize),
    sigma: f64,
) -> Result<(), Wrong> {
    for (row, own) in rows.iter().enumerate() {
        if own.image.index() >= block.images.len() {
            return Err(wrong(argument, row, "image", unknown(own.image.0, "images", block.images.len())));
        }
        if own.point.index() >= count {
            return Err(wrong(argument, row, "point", unknown(own.point.0, points, count)));
        }
        if own.sigma.is_none() && sigma.is_infinite() {
            let key = if argument == "ties" { "tie_px" } else { "mark_px" };
            let problem = format!("no standard deviation; give this column, or {key} in sigma");
            return Err(wrong(argument, row, "sigma", problem));
        }
        let camera = block.camera_of(own.image);
        let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
        let margin = OUTSIDE_MARGIN * width.max(height);
        for (column, value, side) in [("x", own.x, width), ("y", own.y, height)] {
            if value < -margin || value > side + margin {
                let problem = format!("{value} is outside the sensor, 0 to {side} px, by more than {margin} px");
                return Err(wrong(argument, row, column, problem));
            }
        }
    }
    Ok(())
}

/// Number of rays of each point; refuses a point that is measured twice in one image.
fn rays(argument: &'static str, block: &Block, rows: &[Measurement], points: usize) -> Result<Vec<u32>, Wrong> {
    let mut rays = vec![0u32; points];
    rows.iter().for_each(|own| rays[own.point.index()] += 1);
    let mut order: Vec<u32> = (0..rows.len() as u32).collect();
    let key = |row: u32| (rows[row as usize].point, rows[row as usize].image, row);
    order.sort_unstable_by_key(|row| key(*row));
    let same = |pair: &[u32]| key(pair[0]).0 == key(pair[1]).0 && key(pair[0]).1 == key(pair[1]).1;
    let repeated = order.windows(2).filter(|pair| same(pair)).map(|pair| (pair[1], pair[0])).min();
    match repeated {
        None => Ok(rays),
        Some((row, first)) => {
            let image = &block.images[rows[row as usize].image.index()].name;
            let problem = format!("its point is measured twice in image {image:?}, first in row {first}; keep one");
            Err(wrong(argument, row as usize, "image, point", problem))
        }
    }
}

/// Leaves out points, and measurements of points that are left out; numbers the others anew.
fn keep<P>(points: &mut Vec<P>, measurements: &mut Vec<Measurement>, is_kept: impl Fn(usize, &P) -> bool) {
    let mut kept = 0;
    let numbers: Vec<Option<PointId>> = points
        .iter()
        .enumerate()
        .map(|(k, point)| {
            is_kept(k, point).then(|| {
                kept += 1;
                PointId::from(kept - 1)
            })
        })
        .collect();
    if kept == points.len() {
        return;
    }
    measurements.retain_mut(|own| numbers[own.point.index()].map(|number| own.point = number).is_some());
    let mut number = numbers.iter();
    points.retain(|_| number.next().is_some_and(Option::is_some));
}

/// Gives the number of cameras that no image was taken with.
fn leave_out_unused_cameras(block: &mut Block) -> usize {
    let mut used = vec![false; block.cameras.len()];
    block.images.iter().for_each(|image| used[image.camera.index()] = true);
    let mut kept = 0;
    let numbers: Vec<CameraId> = used
        .iter()
        .map(|used| {
            kept += usize::from(*used);
            CameraId::from(kept - usize::from(kept > 0))
        })
        .collect();
    block.images.iter_mut().for_each(|image| image.camera = numbers[image.camera.index()]);
    let mut is_used = used.iter();
    block.cameras.retain(|_| is_used.next().copied().unwrap_or(true));
    used.len() - kept
}
