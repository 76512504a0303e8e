//! Approximate orientations in the convention of another program.

use super::*;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];
const POSITION: [&str; 3] = ["x", "y", "z"];

pub(super) static KINDS: [Kind; 5] = [
    Kind {
        id: "inverse-rotation",
        subjects: &["images"],
        summary: "rotations camera to world",
        parameters: &[],
        act: |files, _| rotations(files, |[w, x, y, z]| [w, -x, -y, -z]),
    },
    Kind {
        id: "quaternion-order",
        subjects: &["images"],
        summary: "components of the quaternion in another order",
        parameters: &[parameter(
            "order",
            "",
            DefaultValue::Choice("real-last", &["real-last", "real-first"]),
            "real-last: x, y, z, w in the columns qw, qx, qy, qz; real-first: z, w, x, y, for a reader of the former",
        )],
        act: |files, values| {
            let real_last = values.word("order") == "real-last";
            rotations(files, |[w, x, y, z]| if real_last { [x, y, z, w] } else { [z, w, x, y] })
        },
    },
    Kind {
        id: "camera-axes",
        subjects: &["images"],
        summary: "rotations for other camera axes",
        parameters: &[parameter(
            "axes",
            "",
            DefaultValue::Choice("y-up", &["y-up", "quarter", "half", "three-quarters"]),
            "y-up: y up and z backwards; the others: turned so far about the viewing axis",
        )],
        act: |files, values| {
            let (axis, quarters) = match values.word("axes") {
                "y-up" => (Vector3::x(), 2.0),
                "quarter" => (Vector3::z(), 1.0),
                "half" => (Vector3::z(), 2.0),
                _ => (Vector3::z(), 3.0),
            };
            let turn = UnitQuaternion::from_scaled_axis(axis * (quarters * FRAC_PI_2));
            rotations(files, |own| components(turn * unit(own)))
        },
    },
    Kind {
        id: "position-frame",
        subjects: &["images"],
        summary: "translations t = -R C in place of projection centres",
        parameters: &[],
        act: |files, _| {
            poses(files, |rotation, position| {
                let translation = -(unit(rotation) * Vector3::from(position));
                (rotation, translation.into())
            })
        },
    },
    Kind {
        id: "position-axes",
        subjects: &["images"],
        summary: "two coordinates of the projection centres exchanged, or one with the wrong sign",
        parameters: &[parameter(
            "change",
            "",
            DefaultValue::Choice("xy", &["xy", "x-reversed", "y-reversed", "z-reversed"]),
            "xy: exchanged",
        )],
        act: |files, values| {
            let change = values.word("change").to_owned();
            poses(files, move |rotation, [x, y, z]| {
                let position = match change.as_str() {
                    "xy" => [y, x, z],
                    "x-reversed" => [-x, y, z],
                    "y-reversed" => [x, -y, z],
                    _ => [x, y, -z],
                };
                (rotation, position)
            })
        },
    },
];

fn unit([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

fn components(rotation: UnitQuaternion<f64>) -> [f64; 4] {
    [rotation.w, rotation.i, rotation.j, rotation.k]
}

/// Rewrites the rotation and the position of each image.
fn poses(files: &mut Files, new: impl Fn([f64; 4], [f64; 3]) -> ([f64; 4], [f64; 3])) -> Result<Notes> {
    let table = files.table("images.csv")?;
    let (rotation, position) = (table.columns(QUATERNION)?, table.columns(POSITION)?);
    for row in 0..table.len() {
        let old = table.numbers(row, rotation)?.zip(table.numbers(row, position)?);
        let (old_rotation, old_position) = old.with_context(|| format!("image {} has no pose", row + 1))?;
        let (new_rotation, new_position) = new(old_rotation, old_position);
        table.put(row, rotation, new_rotation)?;
        table.put(row, position, new_position)?;
    }
    Ok(Vec::new())
}

fn rotations(files: &mut Files, new: impl Fn([f64; 4]) -> [f64; 4]) -> Result<Notes> {
    poses(files, |rotation, position| (new(rotation), position))
}
