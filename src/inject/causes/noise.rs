//! Random errors of the measurements, normally distributed and independent.

use super::*;
use crate::block::Measurement;
use crate::inject::Loss;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "noise",
    summary: "independent normal errors of the image measurements, on request of GNSS and survey too; always the last",
    parameters: &[
        parameter(
            "px",
            "px",
            DefaultValue::Optional("each measurement's own sigma"),
            "standard deviation of each coordinate of ties and marks",
        ),
        parameter("marks_px", "px", DefaultValue::Optional("as px"), "of the marks"),
        parameter("gnss", "", DefaultValue::Flag(false), "1: GNSS positions too, by their sigmas"),
        parameter("control", "", DefaultValue::Flag(false), "1: surveyed coordinates too, by their sigmas"),
    ],
    prepare,
};

struct Noise {
    ties: Option<f64>,
    marks: Option<f64>,
    gnss: bool,
    control: bool,
    random: Random,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    for name in ["px", "marks_px"] {
        if values.optional(name).is_some() {
            values.size(name)?;
        }
    }
    let ties = values.optional("px");
    let marks = values.optional("marks_px").or(ties);
    let (gnss, control) = (values.flag("gnss"), values.flag("control"));
    let random = setting.random.clone();
    let nothing = ties == Some(0.0) && marks == Some(0.0) && !gnss && !control;
    unless(nothing, Noise { ties, marks, gnss, control, random })
}

impl Noise {
    /// Draws for lost measurements too, so that one that is lost does not change the noise of the others.
    fn disturb(
        &mut self,
        measurements: &[Measurement],
        seen: &mut [Result<[f64; 2], Loss>],
        px: Option<f64>,
        default: f64,
    ) {
        for (measurement, seen) in measurements.iter().zip(seen) {
            let sigma = px.unwrap_or(measurement.sigma.unwrap_or(default));
            let (dx, dy) = (sigma * self.random.normal(), sigma * self.random.normal());
            if let Ok(xy) = seen {
                xy[0] += dx;
                xy[1] += dy;
            }
        }
    }

    fn vector(&mut self, xy: f64, z: f64) -> Vector3<f64> {
        self.random.normal3().component_mul(&Vector3::new(xy, xy, z))
    }
}

impl Action for Noise {
    fn measured(&mut self, world: &World, observations: &mut Observations) {
        let sigma = world.sigma;
        self.disturb(&world.ties, &mut observations.ties, self.ties, sigma.tie_px);
        self.disturb(&world.marks, &mut observations.marks, self.marks, sigma.mark_px);
        if self.gnss {
            for (antenna, image) in observations.antennas.iter_mut().zip(&world.images) {
                if let (Some(antenna), Some(gnss)) = (antenna, image.gnss) {
                    let xy = gnss.sigma_xy.unwrap_or(sigma.gnss_xy_m);
                    *antenna += self.vector(xy, gnss.sigma_z.unwrap_or(sigma.gnss_z_m));
                }
            }
        }
        if self.control {
            for (position, point) in observations.surveyed.iter_mut().zip(&world.surveyed) {
                let xy = point.sigma_xy.unwrap_or(sigma.control_xy_m);
                *position += self.vector(xy, point.sigma_z.unwrap_or(sigma.control_z_m));
            }
        }
    }
}
