//! `ties.csv` and `marks.csv`: image measurements, by the million.

use super::super::csv_table::Table;
use super::super::error::shown;
use super::super::table::TableWriter;
use super::block_toml::ReferenceFrame;
use super::images::Images;
use super::{BLOCK, Error, IMAGES};
use crate::block::{ImageId, Measurement, PointId};
use std::path::Path;

/// A measurement may lie outside the sensor by this fraction of the sensor's longer side. The size in `block.toml` may
/// be that of the full or of the cropped picture, which differ by a few per cent; a measurement of another camera, of
/// the turned picture, in other units or about another origin lies further out.
pub(in super::super) const OUTSIDE_MARGIN: f64 = 0.1;

/// Rows after which the number of rows still to come is estimated from the length of the file.
const ROWS_BEFORE_ESTIMATE: usize = 1000;

/// Standard deviation in `[sigma]` for rows that give none, infinite when absent, and its key.
#[derive(Clone, Copy)]
pub(super) struct BlockSigma {
    pub value: f64,
    pub key: &'static str,
}

/// Reads the rows; `point` gives the number of the point that a cell of the column names.
pub(super) fn read(
    table: &mut Table,
    frame: &ReferenceFrame,
    images: &Images,
    block_sigma: BlockSigma,
    mut point: impl FnMut(&Table, usize) -> Result<u32, Error>,
) -> Result<Vec<Measurement>, Error> {
    let [image_column, point_column, x_column, y_column] = table.columns(["image", "point", "x", "y"])?;
    let sigma_column = table.optional_column("sigma");
    let limits: Vec<[f64; 3]> = frame
        .cameras
        .iter()
        .map(|camera| {
            let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
            [width, height, OUTSIDE_MARGIN * width.max(height)]
        })
        .collect();
    let mut measurements: Vec<Measurement> = Vec::new();
    // Rows of an image mostly stand together, or those of a point do: the image of the row before is tried first.
    let mut last = 0u32;
    while table.next()? {
        let name = table.cell(image_column);
        if images.names.get(last as usize) != name {
            last = images
                .names
                .find(name)
                .ok_or_else(|| table.refuse(image_column, format!("{} is not an image of {IMAGES}", shown(name))))?;
        }
        let measurement = Measurement {
            image: ImageId(last),
            point: PointId(point(table, point_column)?),
            x: table.number(x_column)?,
            y: table.number(y_column)?,
            sigma: table.optional_positive(sigma_column)?,
        };
        if measurement.sigma.is_none() && block_sigma.value.is_infinite() {
            let problem = format!("no standard deviation; give sigma here or {} in {BLOCK}, [sigma]", block_sigma.key);
            return Err(table.refuse_row(problem));
        }
        let [width, height, margin] = limits[images.images[last as usize].camera.index()];
        for (column, value, side) in [(x_column, measurement.x, width), (y_column, measurement.y, height)] {
            if value < -margin || value > side + margin {
                let problem = format!("{value} is outside the sensor, 0 to {side} px, by more than {margin} px");
                return Err(table.refuse(column, problem));
            }
        }
        measurements.push(measurement);
        if measurements.len() == ROWS_BEFORE_ESTIMATE {
            // One allocation of about the right size, instead of doublings that hold the table one and a half times.
            measurements.reserve(table.expected_rows() + table.expected_rows() / 16);
        }
    }
    measurements.shrink_to_fit();
    Ok(measurements)
}

/// Number of rays of each point. Refuses a point that is measured twice in the same image, at the first such row.
pub(super) fn rays_per_point<'a>(
    table: &Table,
    measurements: &[Measurement],
    points: usize,
    point_name: impl Fn(usize) -> &'a [u8],
    images: &Images,
) -> Result<Vec<u32>, Error> {
    let mut rays = vec![0u32; points];
    for measurement in measurements {
        rays[measurement.point.index()] += 1;
    }
    // Rows by point, by counting: the end of each point's rows moves back to their start as they are filled in from
    // behind.
    let mut start: Vec<usize> = rays
        .iter()
        .scan(0, |end, count| {
            *end += *count as usize;
            Some(*end)
        })
        .collect();
    // With its image: what is compared stands together and is not looked up far away.
    let mut rows = vec![(ImageId(0), 0u32); measurements.len()];
    for (row, measurement) in measurements.iter().enumerate().rev() {
        let slot = &mut start[measurement.point.index()];
        *slot -= 1;
        rows[*slot] = (measurement.image, row as u32);
    }
    let mut repeated: Option<(u32, u32)> = None;
    for (start, count) in start.iter().zip(&rays) {
        let own = &mut rows[*start..start + *count as usize];
        own.sort_unstable();
        for pair in own.windows(2) {
            let [(image, first), (other, row)] = [pair[0], pair[1]];
            if image == other && repeated.is_none_or(|(_, earliest)| row < earliest) {
                repeated = Some((first, row));
            }
        }
    }
    match repeated {
        None => Ok(rays),
        Some((first, row)) => {
            let measurement = measurements[row as usize];
            let (point, image) = (point_name(measurement.point.index()), images.names.get(measurement.image.index()));
            let line = table.line(first as usize);
            let problem = format!(
                "point {} is measured twice in image {}, first in line {line}; keep one",
                shown(point),
                shown(image)
            );
            Err(table.refuse_row_at(row as usize, problem))
        }
    }
}

pub(super) fn write<'a>(
    measurements: &[Measurement],
    image_name: impl Fn(usize) -> &'a str,
    point_name: impl Fn(usize) -> &'a str,
    path: &Path,
) -> Result<(), Error> {
    let has_sigma = measurements.iter().any(|measurement| measurement.sigma.is_some());
    let header = ["image", "point", "x", "y", "sigma"];
    let mut table = TableWriter::create(path, &header[..if has_sigma { 5 } else { 4 }])?;
    for measurement in measurements {
        table.text(image_name(measurement.image.index())).text(point_name(measurement.point.index()));
        table.number(measurement.x).number(measurement.y);
        if has_sigma {
            table.optional(measurement.sigma);
        }
        table.end_row()?;
    }
    table.finish()
}
