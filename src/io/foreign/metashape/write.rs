//! `cameras.xml`, as Metashape's *Import Cameras* (Agisoft XML) reads it.

use super::super::super::error::{Error, Place};
use super::super::xml::escaped;
use super::super::{ExportOptions, Exporter, Note, verification};
use super::Metashape;
use super::document::Calibration;
use crate::block::{Block, Pose};
use crate::camera::Camera;
use nalgebra::Matrix3;
use std::fmt::Write;
use std::path::Path;

const FILE: &str = "cameras.xml";

impl Exporter for Metashape {
    fn export(&self, block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error> {
        let path = dir.join(FILE);
        let file = path.display().to_string();
        let mut notes = Vec::new();
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"1.5.0\">\n");
        text += &format!("  <chunk label=\"{}\" enabled=\"true\">\n", escaped(&block.name));
        text += &format!("    <sensors next_id=\"{}\">\n", block.cameras.len());
        for (number, camera) in block.cameras.iter().enumerate() {
            let fit = Calibration::of_fraser(camera).ok_or_else(|| {
                let problem = format!("camera {}: no camera of Metashape comes near it", camera.id);
                Error::content(&file, Place::File, problem)
            })?;
            let calibration = fit.judge(&file, &camera.id, options.approximate, &mut notes)?;
            text += &sensor(number, camera, &calibration);
        }
        text += &format!("    </sensors>\n    <cameras next_id=\"{}\" next_group_id=\"0\">\n", block.images.len());
        for (number, image) in block.images.iter().enumerate() {
            let attributes =
                format!("id=\"{number}\" sensor_id=\"{}\" label=\"{}\"", image.camera.0, escaped(&image.name));
            let transform = numbers(&transform(&image.pose));
            text += &format!("      <camera {attributes} enabled=\"true\">\n");
            text += &format!("        <transform>{transform}</transform>\n      </camera>\n");
        }
        text += "    </cameras>\n    <transform>\n";
        text += &format!("      <rotation>{}</rotation>\n", numbers(Matrix3::<f64>::identity().as_slice()));
        text += "      <translation>0 0 0</translation>\n      <scale>1</scale>\n    </transform>\n  \
                 </chunk>\n</document>\n";
        super::super::super::write_atomically(&path, text.as_bytes())?;
        verification::write(block, dir)?;
        if !block.ties.is_empty() || !block.surveyed.is_empty() {
            notes
                .push(Note::loss("cameras.xml holds cameras and poses alone, no tie points, marks or surveyed points"));
        }
        Ok(notes)
    }
}

fn sensor(number: usize, camera: &Camera, calibration: &Calibration) -> String {
    let Calibration { f, pp, b, k, p } = *calibration;
    let size = format!("<resolution width=\"{}\" height=\"{}\"/>", camera.width_px, camera.height_px);
    let mut text = format!("      <sensor id=\"{number}\" label=\"{}\" type=\"frame\">\n", escaped(&camera.id));
    text += &format!("        {size}\n");
    if let Some(pixel_um) = camera.pixel_um {
        for property in ["pixel_width", "pixel_height"] {
            let value = pixel_um / 1000.0;
            text += &format!("        <property name=\"{property}\" value=\"{value:?}\"/>\n");
        }
    }
    text += &format!("        <calibration type=\"frame\" class=\"adjusted\">\n          {size}\n");
    let [width, height] = [camera.width_px, camera.height_px].map(f64::from);
    let values = [
        ("f", f),
        ("cx", pp[0] - 0.5 * width),
        ("cy", pp[1] - 0.5 * height),
        ("b1", b[0]),
        ("b2", b[1]),
        ("k1", k[0]),
        ("k2", k[1]),
        ("k3", k[2]),
        ("k4", k[3]),
        ("p1", p[0]),
        ("p2", p[1]),
    ];
    for (name, value) in values {
        // Writing into a String does not fail.
        let _ = writeln!(text, "          <{name}>{value:?}</{name}>");
    }
    text + "        </calibration>\n      </sensor>\n"
}

/// Camera to world, row by row.
fn transform(pose: &Pose) -> [f64; 16] {
    let rotation = pose.rotation.inverse().to_rotation_matrix().into_inner();
    let mut rows = [0.0; 16];
    for i in 0..3 {
        for j in 0..3 {
            rows[4 * i + j] = rotation[(i, j)];
        }
        rows[4 * i + 3] = pose.centre[i];
    }
    rows[15] = 1.0;
    rows
}

fn numbers(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
}
