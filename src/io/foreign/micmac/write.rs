//! Orientations, calibrations and multiple tie points for MicMac's first version.

use super::super::super::error::Error;
use super::super::super::write_atomically;
use super::super::xml::escaped;
use super::super::{HALF_PIXEL, Note, refuse, verification};
use crate::block::{Block, Image};
use crate::camera::Camera;
use std::collections::BTreeMap;
use std::path::Path;

/// Folder of the orientations.
const ORIENTATIONS: &str = "Ori-Misclosure";
/// Folder of the tie points.
const TIES: &str = "Homol";

/// Writes a block.
pub(super) fn export(block: &Block, dir: &Path) -> Result<Vec<Note>, Error> {
    let orientations = dir.join(ORIENTATIONS);
    for folder in [&orientations, &dir.join(TIES)] {
        std::fs::create_dir(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    }
    let names = block.images.iter().map(|image| &image.name).chain(block.cameras.iter().map(|camera| &camera.id));
    if let Some(name) = names.into_iter().find(|name| name.contains(['/', '\\', '=', '\n'])) {
        return Err(refuse(
            dir,
            format!("{name:?} names a file or stands in a line name=number of MicMac's; rename it"),
        ));
    }
    for camera in &block.cameras {
        write_atomically(
            &orientations.join(format!("{}.xml", calibration_name(camera))),
            calibration(camera).as_bytes(),
        )?;
    }
    for image in &block.images {
        let camera = &block.cameras[image.camera.index()];
        let path = orientations.join(format!("Orientation-{}.xml", image.name));
        write_atomically(&path, orientation(image, camera).as_bytes())?;
    }
    write_atomically(&dir.join(TIES).join("PMul.txt"), multiple(block).as_bytes())?;
    verification::write(block, dir)?;
    let mut notes = Vec::new();
    if !block.surveyed.is_empty() {
        notes.push(Note::loss("surveyed points and their marks are not written"));
    }
    Ok(notes)
}

fn calibration_name(camera: &Camera) -> String {
    format!("AutoCal_{}", camera.id)
}

fn numbers(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
}

fn calibration(camera: &Camera) -> String {
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = camera.interior;
    let pp = numbers(&[ppx - HALF_PIXEL, ppy - HALF_PIXEL]);
    let centre = numbers(&[dcx - HALF_PIXEL, dcy - HALF_PIXEL]);
    let radial: String = [k1, k2, k3].map(|k| format!("                    <CoeffDist>{k:?}</CoeffDist>\n")).concat();
    let rest = [("P1", p1), ("P2", p2), ("b1", b1), ("b2", b2)];
    let rest: String = rest.map(|(name, value)| format!("               <{name}>{value:?}</{name}>\n")).concat();
    format!(
        "<?xml version=\"1.0\" ?>
<ExportAPERO>
     <CalibrationInternConique>
          <KnownConv>eConvApero_DistM2C</KnownConv>
          <PP>{pp}</PP>
          <F>{f:?}</F>
          <SzIm>{} {}</SzIm>
          <CalibDistortion>
               <ModPhgrStd>
                    <RadialePart>
                    <CDist>{centre}</CDist>
{radial}                    <PPaEqPPs>{}</PPaEqPPs>
                    </RadialePart>
{rest}               </ModPhgrStd>
          </CalibDistortion>
     </CalibrationInternConique>
</ExportAPERO>
",
        camera.width_px,
        camera.height_px,
        pp == centre
    )
}

fn orientation(image: &Image, camera: &Camera) -> String {
    let rotation = image.pose.rotation.to_rotation_matrix().into_inner();
    // Rows of the matrix that takes the camera to the world.
    let row = |k: usize| numbers(rotation.column(k).as_slice());
    format!(
        "<?xml version=\"1.0\" ?>
<ExportAPERO>
     <OrientationConique>
          <OrIntImaM2C>
               <I00>0 0</I00>
               <V10>1 0</V10>
               <V01>0 1</V01>
          </OrIntImaM2C>
          <TypeProj>eProjStenope</TypeProj>
          <ZoneUtileInPixel>true</ZoneUtileInPixel>
          <FileInterne>{ORIENTATIONS}/{}.xml</FileInterne>
          <RelativeNameFI>true</RelativeNameFI>
          <Externe>
               <KnownConv>eConvApero_DistM2C</KnownConv>
               <Centre>{}</Centre>
               <ParamRotation>
                    <CodageMatr>
                         <L1>{}</L1>
                         <L2>{}</L2>
                         <L3>{}</L3>
                    </CodageMatr>
               </ParamRotation>
          </Externe>
          <ConvOri>
               <KnownConv>eConvApero_DistM2C</KnownConv>
          </ConvOri>
     </OrientationConique>
</ExportAPERO>
",
        escaped(&calibration_name(camera)),
        numbers(image.pose.centre.as_slice()),
        row(0),
        row(1),
        row(2)
    )
}

/// As text, with all digits: MicMac itself writes three decimals.
fn multiple(block: &Block) -> String {
    let mut seen: Vec<Vec<(u32, [f64; 2])>> = vec![Vec::new(); block.tie_points.len()];
    for tie in &block.ties {
        seen[tie.point.index()].push((tie.image.0, [tie.x - HALF_PIXEL, tie.y - HALF_PIXEL]));
    }
    let mut configurations: BTreeMap<Vec<u32>, Vec<Vec<[f64; 2]>>> = BTreeMap::new();
    for mut point in seen {
        point.sort_by_key(|(image, _)| *image);
        let images = point.iter().map(|(image, _)| *image).collect();
        configurations.entry(images).or_default().push(point.into_iter().map(|(_, xy)| xy).collect());
    }
    let mut text = String::from("BeginHeader-MicMacTiePointFormat\n   Version=0.0.0\nEndHeader\n0\n");
    text += &format!("{}\n", block.images.len());
    for (k, image) in block.images.iter().enumerate() {
        text += &format!("{}={k}\n", image.name);
    }
    text += &format!("{}\n", configurations.len());
    for (images, points) in configurations {
        text += &format!("{} {}\n", points.len(), images.len());
        text += &format!("{}\n", images.iter().map(u32::to_string).collect::<Vec<_>>().join(" "));
        for point in points {
            text += &format!("{}\n", numbers(point.as_flattened()));
        }
    }
    text
}
