//! What a hand that slipped, or another program, can do to a block that still reads.

use arbitrary::{Result, Unstructured};
use misclosure::block::Block;
use nalgebra::{UnitQuaternion, Vector3};

/// Largest size of a number that readers take, and least.
const DECADES: i32 = 12;

type Fault = fn(&mut Block, &mut Unstructured<'_>) -> Result<()>;

const FAULTS: [Fault; 11] = [
    measurement_elsewhere,
    measurement_twice,
    measurement_gone,
    image_elsewhere,
    image_on_another,
    image_turned,
    image_alone,
    camera_otherwise,
    sigma_otherwise,
    point_elsewhere,
    points_unknown,
];

/// One fault.
pub fn apply(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    u.choose(&FAULTS)?(block, u)
}

/// A number of any size that a file may have.
pub fn number(u: &mut Unstructured<'_>) -> Result<f64> {
    let (digits, decade) = (f64::from(u.int_in_range(-99..=99)?), u.int_in_range(-DECADES..=DECADES - 2)?);
    // An ordinary size more often than an extreme one.
    Ok(digits * 10_f64.powi(if u.ratio(1, 2)? { decade } else { decade % 2 - 1 }))
}

fn vector(u: &mut Unstructured<'_>) -> Result<Vector3<f64>> {
    Ok(Vector3::new(number(u)?, number(u)?, number(u)?))
}

fn position(u: &mut Unstructured<'_>, length: usize) -> Result<Option<usize>> {
    if length == 0 { Ok(None) } else { u.choose_index(length).map(Some) }
}

fn measurement_elsewhere(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let Some(k) = position(u, block.ties.len())? {
        block.ties[k].x += number(u)?;
        block.ties[k].y += number(u)?;
    }
    Ok(())
}

/// Under the name of another point.
fn measurement_twice(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let (Some(from), Some(to)) = (position(u, block.ties.len())?, position(u, block.ties.len())?) {
        let [x, y] = [block.ties[from].x, block.ties[from].y];
        (block.ties[to].x, block.ties[to].y) = (x, y);
    }
    Ok(())
}

fn measurement_gone(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    for _ in 0..u.int_in_range(1..=40)? {
        if let Some(k) = position(u, block.ties.len())? {
            block.ties.remove(k);
        }
    }
    Ok(())
}

fn image_elsewhere(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let Some(k) = position(u, block.images.len())? {
        block.images[k].pose.centre += vector(u)?;
    }
    Ok(())
}

fn image_on_another(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let (Some(from), Some(to)) = (position(u, block.images.len())?, position(u, block.images.len())?) {
        block.images[to].pose = block.images[from].pose;
    }
    Ok(())
}

fn image_turned(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let Some(k) = position(u, block.images.len())? {
        let turn = UnitQuaternion::from_scaled_axis(vector(u)?.map(|angle| angle.clamp(-10.0, 10.0)));
        block.images[k].pose.rotation = turn * block.images[k].pose.rotation;
    }
    Ok(())
}

/// Without most of its measurements.
fn image_alone(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let Some(k) = position(u, block.images.len())? {
        let mut left = u.int_in_range(0..=4)?;
        block.ties.retain(|row| {
            let of_image = row.image.index() == k;
            left -= i32::from(of_image);
            !of_image || left >= 0
        });
    }
    Ok(())
}

fn camera_otherwise(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    let camera = &mut block.cameras[0];
    let k = u.choose_index(camera.interior.len())?;
    let factor = number(u)?;
    // Files with a focal length that is not positive are refused.
    camera.interior[k] *= if k == 0 { factor.abs().max(f64::EPSILON) } else { factor };
    Ok(())
}

fn sigma_otherwise(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    let sigma = &mut block.sigma;
    let all =
        [&mut sigma.tie_px, &mut sigma.mark_px, &mut sigma.control_xy_m, &mut sigma.control_z_m, &mut sigma.gnss_z_m];
    for sigma in all {
        if u.ratio(1, 4)? {
            *sigma *= number(u)?.abs().max(f64::EPSILON);
        }
    }
    Ok(())
}

fn point_elsewhere(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    if let Some(k) = position(u, block.surveyed.len())? {
        block.surveyed[k].position += vector(u)?;
    }
    Ok(())
}

fn points_unknown(block: &mut Block, u: &mut Unstructured<'_>) -> Result<()> {
    let keep = u.ratio(1, 2)?;
    for point in block.tie_points.iter_mut().skip(usize::from(keep)) {
        point.position = None;
    }
    Ok(())
}
