//! A block as one file.

use super::super::super::error::Error;
use super::super::fit::nearest_with;
use super::super::positions::Positioned;
use super::super::{CAMERA_ADVICE, ExportOptions, HALF_PIXEL, Note, refuse, verification, write_file};
use super::ROOT;
use crate::block::{Block, Measurement, Role};
use crate::camera::{Camera, F, Interior, K1, K2, K3, P1, P2, PPX, PPY};
use quick_xml::escape::escape;
use std::io::{self, Write};
use std::path::Path;

/// The file.
const FILE: &str = "blocks.xml";
/// Numbers of a camera that the format holds: one focal length, and distortion about the principal point.
pub(super) const NUMBERS: [usize; 8] = [F, PPX, PPY, K1, K2, K3, P1, P2];
/// The one coordinate system.
const SYSTEM: u32 = 0;

pub(super) fn write(block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error> {
    let mut notes = Vec::new();
    let gnss = block.images.iter().filter(|image| image.gnss.is_some()).count();
    if gnss > 0 {
        notes.push(Note::loss(format!("{gnss} GNSS positions are not written")));
    }
    let Positioned { mut block, .. } = Positioned::of(block, &mut notes);
    for camera in &mut block.cameras {
        camera.interior = held(camera, dir, options, &mut notes)?;
    }
    write_file(&dir.join(FILE), |file| contents(&block, file))?;
    verification::write(&block, dir)?;
    Ok(notes)
}

/// The camera as the format holds it.
fn held(camera: &Camera, dir: &Path, options: &ExportOptions, notes: &mut Vec<Note>) -> Result<Interior, Error> {
    let Some(fit) = nearest_with(camera, &NUMBERS) else {
        let problem = format!("camera {}: no camera of this format comes near it over the whole sensor", camera.id);
        return Err(refuse(dir, problem));
    };
    if fit.max_px == 0.0 {
        return Ok(fit.parameters);
    }
    let name = format!("{} ({CAMERA_ADVICE})", camera.id);
    fit.judge("blocks-exchange", &name, options.approximate, notes)
}

fn contents(block: &Block, file: &mut dyn Write) -> io::Result<()> {
    writeln!(file, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<{ROOT} version=\"2.1\">")?;
    let crs = escape(block.crs.as_str());
    writeln!(
        file,
        "<SpatialReferenceSystems><SRS><Id>{SYSTEM}</Id><Name>{crs}</Name><Definition>{crs}</Definition></SRS>\
         </SpatialReferenceSystems>"
    )?;
    let name = escape(block.name.as_str());
    writeln!(file, "<Block><Name>{name}</Name><Type>Aerial</Type><SRSId>{SYSTEM}</SRSId>\n<Photogroups>")?;
    for (number, camera) in block.cameras.iter().enumerate() {
        photogroup(block, number, camera, file)?;
    }
    writeln!(file, "</Photogroups>\n<TiePoints>")?;
    let mut by_point: Vec<Vec<&Measurement>> = vec![Vec::new(); block.tie_points.len()];
    block.ties.iter().for_each(|tie| by_point[tie.point.index()].push(tie));
    for (point, ties) in block.tie_points.iter().zip(&by_point) {
        write!(file, "<TiePoint>")?;
        // Points without coordinates were left out.
        position(point.position.unwrap_or_default().into(), file)?;
        sights(ties, file)?;
        writeln!(file, "</TiePoint>")?;
    }
    writeln!(file, "</TiePoints>\n<ControlPoints>")?;
    let mut by_point: Vec<Vec<&Measurement>> = vec![Vec::new(); block.surveyed.len()];
    block.marks.iter().for_each(|mark| by_point[mark.point.index()].push(mark));
    for (point, marks) in block.surveyed.iter().zip(&by_point) {
        write!(file, "<ControlPoint><SRSId>{SYSTEM}</SRSId><Name>{}</Name>", escape(point.name.as_str()))?;
        position(point.position.into(), file)?;
        if point.role == Role::Check {
            write!(file, "<CheckPoint>true</CheckPoint>")?;
        }
        let sigmas = [
            ("Horizontal", point.sigma_xy.unwrap_or(block.sigma.control_xy_m)),
            ("Vertical", point.sigma_z.unwrap_or(block.sigma.control_z_m)),
        ];
        for (which, sigma) in sigmas.iter().filter(|(_, sigma)| sigma.is_finite()) {
            write!(file, "<{which}Accuracy>{sigma:?}</{which}Accuracy>")?;
        }
        sights(marks, file)?;
        writeln!(file, "</ControlPoint>")?;
    }
    writeln!(file, "</ControlPoints>\n</Block>\n</{ROOT}>")
}

fn photogroup(block: &Block, number: usize, camera: &Camera, file: &mut dyn Write) -> io::Result<()> {
    let i = &camera.interior;
    let f = i[F];
    writeln!(file, "<Photogroup><Name>{}</Name>", escape(camera.id.as_str()))?;
    let (width, height) = (camera.width_px, camera.height_px);
    writeln!(file, "<ImageDimensions><Width>{width}</Width><Height>{height}</Height></ImageDimensions>")?;
    writeln!(file, "<CameraModelType>Perspective</CameraModelType><CameraOrientation>XRightYDown</CameraOrientation>")?;
    writeln!(file, "<FocalLengthPixels>{f:?}</FocalLengthPixels>")?;
    let [x, y] = [i[PPX] - HALF_PIXEL, i[PPY] - HALF_PIXEL];
    writeln!(file, "<PrincipalPoint><x>{x:?}</x><y>{y:?}</y></PrincipalPoint>")?;
    let coefficients = [
        ("K1", i[K1] * f.powi(2)),
        ("K2", i[K2] * f.powi(4)),
        ("K3", i[K3] * f.powi(6)),
        ("P1", i[P1] * f),
        ("P2", i[P2] * f),
    ];
    write!(file, "<Distortion>")?;
    coefficients.iter().try_for_each(|(name, value)| write!(file, "<{name}>{value:?}</{name}>"))?;
    writeln!(file, "</Distortion>")?;
    for (id, image) in block.images.iter().enumerate().filter(|(_, image)| image.camera.index() == number) {
        write!(file, "<Photo><Id>{id}</Id><ImagePath>{}</ImagePath><Pose><Rotation>", escape(image.name.as_str()))?;
        let rotation = image.pose.rotation.to_rotation_matrix();
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            write!(file, "<M_{row}{column}>{:?}</M_{row}{column}>", rotation[(row, column)])?;
        }
        let centre = image.pose.centre;
        write!(
            file,
            "</Rotation><Center><x>{:?}</x><y>{:?}</y><z>{:?}</z></Center></Pose>",
            centre.x, centre.y, centre.z
        )?;
        writeln!(file, "</Photo>")?;
    }
    writeln!(file, "</Photogroup>")
}

fn position([x, y, z]: [f64; 3], file: &mut dyn Write) -> io::Result<()> {
    write!(file, "<Position><x>{x:?}</x><y>{y:?}</y><z>{z:?}</z></Position>")
}

fn sights(measurements: &[&Measurement], file: &mut dyn Write) -> io::Result<()> {
    measurements.iter().try_for_each(|seen| {
        let [x, y] = [seen.x - HALF_PIXEL, seen.y - HALF_PIXEL];
        write!(file, "<Measurement><PhotoId>{}</PhotoId><x>{x:?}</x><y>{y:?}</y></Measurement>", seen.image.0)
    })
}
