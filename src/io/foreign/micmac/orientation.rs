//! Exterior orientations of both versions.

use super::super::super::error::{Error, shown};
use super::super::pose;
use super::super::xml::Element;
use crate::block::Pose;
use nalgebra::{Matrix3, Vector3};

/// An image's orientation.
pub(super) struct Orientation {
    pub pose: Pose,
    /// Its camera: the name of a calibration file, without folder and extension.
    pub calibration: String,
    /// A point of the world and where the image sees it, in pixels as the file has them.
    pub verification: Vec<(Vector3<f64>, [f64; 2])>,
}

/// `OrientationConique` of the first version.
pub(super) fn first_version(orientation: Element<'_>) -> Result<Orientation, Error> {
    if let Some(kind) = orientation.optional("TypeProj").filter(|kind| kind.text() != "eProjStenope") {
        let found = shown(kind.text().as_bytes());
        return Err(kind.refuse(format!("expected eProjStenope, a perspective camera, found {found}")));
    }
    if let Some(affine) = orientation.optional("OrIntImaM2C") {
        for (name, expected) in [("I00", [0.0, 0.0]), ("V10", [1.0, 0.0]), ("V01", [0.0, 1.0])] {
            let part = affine.child(name)?;
            if part.numbers::<2>()? != expected {
                return Err(part.refuse("expected the identity: a scanned or rotated image is not understood"));
            }
        }
    }
    let calibration = orientation.child("FileInterne")?;
    let exterior = orientation.child("Externe")?;
    let rotation = exterior.child("ParamRotation")?;
    let matrix = rotation.optional("CodageMatr").ok_or_else(|| {
        rotation.refuse("expected <CodageMatr>; rotations as angles are not understood, convert them with MicMac")
    })?;
    let row = |name| matrix.child(name).and_then(|row| row.numbers::<3>());
    let [l1, l2, l3] = [row("L1")?, row("L2")?, row("L3")?];
    // Its columns are the camera's axes in the world: as rows they take the world to the camera.
    let cam_from_world = Matrix3::from_columns(&[l1.into(), l2.into(), l3.into()]);
    let mut verification = Vec::new();
    for point in orientation.optional("Verif").into_iter().flat_map(|verif| verif.children("Appuis")) {
        verification.push((point.child("Ter")?.numbers::<3>()?.into(), point.child("Im")?.numbers::<2>()?));
    }
    Ok(Orientation {
        pose: posed(matrix, &cam_from_world, exterior.child("Centre")?)?,
        calibration: stem(calibration.name_text()?).to_owned(),
        verification,
    })
}

/// `CameraPose` of MMVII, with the image's name.
pub(super) fn second_version(orientation: Element<'_>) -> Result<(String, Orientation), Error> {
    let rotation = orientation.child("RotMatrix")?;
    let axis = |name| rotation.child(name).and_then(|axis| axis.numbers::<3>());
    let [i, j, k]: [Vector3<f64>; 3] = [axis("AxeI")?.into(), axis("AxeJ")?.into(), axis("AxeK")?.into()];
    let cam_from_world = Matrix3::from_rows(&[i.transpose(), j.transpose(), k.transpose()]);
    let pose = posed(rotation, &cam_from_world, orientation.child("Center")?)?;
    let calibration = unquoted(orientation.child("NameInternalCalib")?)?.to_owned();
    let name = unquoted(orientation.child("NameImage")?)?.to_owned();
    Ok((name, Orientation { pose, calibration, verification: Vec::new() }))
}

fn posed(place: Element<'_>, cam_from_world: &Matrix3<f64>, centre: Element<'_>) -> Result<Pose, Error> {
    let rotation = pose::from_matrix(cam_from_world)
        .ok_or_else(|| place.refuse("expected the matrix of a rotation; this one mirrors or stretches"))?;
    Ok(Pose { rotation, centre: centre.numbers::<3>()?.into() })
}

/// A text of MMVII, which stands in quotes.
pub(super) fn unquoted<'a>(element: Element<'a>) -> Result<&'a str, Error> {
    let text = element.name_text()?.trim_matches('"');
    if text.is_empty() { Err(element.refuse(format!("<{}>: expected a name", element.name()))) } else { Ok(text) }
}

/// A file's name without folder and extension.
pub(super) fn stem(path: &str) -> &str {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    name.strip_suffix(".xml").unwrap_or(name)
}
