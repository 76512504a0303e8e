//! MicMac's cameras: those of the first version, and of MMVII.
//!
//! ```text
//! (U, V) = PP + F (X / Z, Y / Z)      d = (U, V) - CDist      r2 = |d|^2, px
//! x = U + du (R3 r2 + R5 r2^2 + R7 r2^3 + ...) + P1 (r2 + 2 du^2) + 2 P2 du dv + b1 du + b2 dv
//! y = V + dv (R3 r2 + R5 r2^2 + R7 r2^3 + ...) + P2 (r2 + 2 dv^2) + 2 P1 du dv
//! ```
//!
//! That is the Fraser camera, letter by letter, where `KnownConv` says that the distortion goes from world to image
//! (`eConvApero_DistM2C`); the other way (`eConvApero_DistC2M`) the same formula takes measured points to ideal ones.
//! MMVII divides all lengths by F and has CDist = PP. Pixels count from the centre of the top-left one. Source: MicMac,
//! `phgr_dist.cpp` and `GeoLocalisation.tex`; MMVII, `PerspCamModelization.tex`.

use super::super::super::error::{Error, shown};
use super::super::HALF_PIXEL;
use super::super::fit::{Fit, Formula, fit_fraser};
use super::super::xml::Element;
use crate::camera::Interior;

/// Ways of the distortion.
const TO_IMAGE: &str = "eConvApero_DistM2C";
const FROM_IMAGE: &str = "eConvApero_DistC2M";
/// Elements that change nothing, or that are understood.
const UNDERSTOOD: [&str; 7] = ["KnownConv", "PP", "F", "SzIm", "PixelSzIm", "RayonUtile", "CalibDistortion"];

/// A camera as its file has it, but for the origin of the pixels, which is ours.
#[derive(Debug, Clone)]
pub(super) struct Calibration {
    pub size: [u32; 2],
    pub pixel_um: Option<f64>,
    pub distortion: Distortion,
    is_from_image: bool,
}

/// The numbers of the formula.
#[derive(Debug, Clone)]
pub(super) struct Distortion {
    f: f64,
    pp: [f64; 2],
    centre: [f64; 2],
    radial: Vec<f64>,
    p: [f64; 2],
    b: [f64; 2],
}

impl Calibration {
    /// The image point, px, of the direction `(x, y, 1)`; `None` where the formula goes the other way.
    pub(super) fn project(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let Distortion { f, pp, .. } = self.distortion;
        (!self.is_from_image).then(|| self.distortion.apply([pp[0] + f * x, pp[1] + f * y]))
    }

    /// The nearest Fraser camera; `None` where there is none near.
    pub(super) fn to_fraser(&self) -> Option<Fit<Interior>> {
        let Distortion { f, pp, centre, p, b, .. } = self.distortion;
        let radial = |k: usize| self.distortion.radial.get(k).copied().unwrap_or(0.0);
        let [k1, k2, k3] = [radial(0), radial(1), radial(2)];
        let start = [f, pp[0], pp[1], centre[0], centre[1], k1, k2, k3, p[0], p[1], b[0], b[1]];
        let is_long = self.distortion.radial.iter().skip(3).any(|term| *term != 0.0);
        if !self.is_from_image && !is_long {
            return Some(Fit { parameters: start, rms_px: 0.0, max_px: 0.0 });
        }
        if !self.is_from_image {
            return fit_fraser(&Formula::Forward(&|ray| self.project(ray)), self.size, &start, centre == pp);
        }
        let backward = |xy: [f64; 2]| {
            let [u, v] = self.distortion.apply(xy);
            Some([(u - pp[0]) / f, (v - pp[1]) / f])
        };
        // To first order the way back is the negative one.
        let back = [f, pp[0], pp[1], centre[0], centre[1], -k1, 0.0, 0.0, -p[0], -p[1], -b[0], -b[1]];
        fit_fraser(&Formula::Backward(&backward), self.size, &back, centre == pp)
    }
}

impl Distortion {
    fn apply(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let ([p1, p2], [b1, b2]) = (self.p, self.b);
        let (du, dv) = (u - self.centre[0], v - self.centre[1]);
        let r2 = du * du + dv * dv;
        let radial = self.radial.iter().rev().fold(0.0, |sum, term| r2 * (term + sum));
        [
            u + du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv,
            v + dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv,
        ]
    }
}

/// `CalibrationInternConique` of the first version.
pub(super) fn first_version(calibration: Element<'_>) -> Result<Calibration, Error> {
    if let Some(strange) = calibration.elements().find(|element| !UNDERSTOOD.contains(&element.name())) {
        return Err(strange.refuse(format!("<{}> is not understood; this camera would be another", strange.name())));
    }
    let convention = calibration.optional("KnownConv").ok_or_else(|| {
        calibration.refuse(format!(
            "<KnownConv> is missing, and MicMac itself is of two minds without it; write {TO_IMAGE} (Tapas, Campari) \
             or {FROM_IMAGE}"
        ))
    })?;
    let is_from_image = match convention.text() {
        TO_IMAGE => false,
        FROM_IMAGE => true,
        other => {
            let found = shown(other.as_bytes());
            return Err(convention.refuse(format!("expected {TO_IMAGE} or {FROM_IMAGE}, found {found}")));
        }
    };
    let pp = calibration.child("PP")?.numbers::<2>()?.map(|value| value + HALF_PIXEL);
    let mut distortion =
        Distortion { f: focal(calibration.child("F")?)?, pp, centre: pp, radial: Vec::new(), p: [0.0; 2], b: [0.0; 2] };
    let models: Vec<Element<'_>> = calibration.children("CalibDistortion").collect();
    if let [_, second, ..] = models[..] {
        return Err(second.refuse("a second <CalibDistortion>: a chain of distortions is no Fraser camera"));
    }
    if let Some(model) = models.first().and_then(|model| model.elements().next()) {
        take_model(&mut distortion, model)?;
    }
    let pixel_mm = calibration.optional("PixelSzIm").map(|size| size.numbers::<2>()).transpose()?;
    Ok(Calibration {
        size: sides(calibration.child("SzIm")?)?,
        pixel_um: pixel_mm.map(|[x, _]| x * 1000.0).filter(|um| *um > 0.0),
        distortion,
        is_from_image,
    })
}

fn take_model(distortion: &mut Distortion, model: Element<'_>) -> Result<(), Error> {
    let (radial, rest) = match model.name() {
        "ModNoDist" => return Ok(()),
        "ModRad" => (model, None),
        "ModPhgrStd" => (model.child("RadialePart")?, Some(model)),
        other => {
            return Err(
                model.refuse(format!("<{other}> is no Fraser camera; expected ModPhgrStd, ModRad or ModNoDist"))
            );
        }
    };
    distortion.centre = radial.child("CDist")?.numbers::<2>()?.map(|value| value + HALF_PIXEL);
    distortion.radial = radial.children("CoeffDist").map(|term| term.number()).collect::<Result<_, _>>()?;
    if let Some(rest) = rest {
        distortion.p = [rest.number_or_zero("P1")?, rest.number_or_zero("P2")?];
        distortion.b = [rest.number_or_zero("b1")?, rest.number_or_zero("b2")?];
    }
    Ok(())
}

/// `InternalCalibration` of MMVII.
pub(super) fn second_version(calibration: Element<'_>) -> Result<Calibration, Error> {
    let projection = calibration.child("Projection")?;
    if projection.text() != "\"Stenope\"" {
        let found = shown(projection.text().as_bytes());
        return Err(projection.refuse(format!("expected \"Stenope\", a perspective camera, found {found}")));
    }
    let perfect = calibration.child("PerfectProj")?;
    let f = focal(perfect.child("F")?)?;
    let pp = perfect.child("PP")?.numbers::<2>()?.map(|value| value + HALF_PIXEL);
    let mut distortion = Distortion { f, pp, centre: pp, radial: Vec::new(), p: [0.0; 2], b: [0.0; 2] };
    let parts = calibration.optional("Distorsion").into_iter().flat_map(Element::elements);
    for term in parts.flat_map(Element::elements) {
        let value = term.number()?;
        let order = |prefix| term.name().strip_prefix(prefix).and_then(|order| order.parse::<usize>().ok());
        match (term.name(), order("K")) {
            ("p1", _) => distortion.p[0] = value / f,
            ("p2", _) => distortion.p[1] = value / f,
            ("b1", _) => distortion.b[0] = value,
            ("b2", _) => distortion.b[1] = value,
            (_, Some(order @ 1..=9)) => {
                distortion.radial.resize(distortion.radial.len().max(order), 0.0);
                distortion.radial[order - 1] = value / f.powi(2 * order as i32);
            }
            _ if value == 0.0 => {}
            (name, _) => return Err(term.refuse(format!("<{name}> is not zero, and no term of the Fraser camera"))),
        }
    }
    let size = sides(calibration.child("PixelFrame")?.child("NbPix")?)?;
    Ok(Calibration { size, pixel_um: None, distortion, is_from_image: false })
}

fn focal(element: Element<'_>) -> Result<f64, Error> {
    match element.number()? {
        f if f > 0.0 => Ok(f),
        f => Err(element.refuse(format!("expected a focal length above zero, found {f}"))),
    }
}

fn sides(element: Element<'_>) -> Result<[u32; 2], Error> {
    let sides = element.numbers::<2>()?;
    let is_side = |side: f64| side >= 1.0 && side <= f64::from(u32::MAX) && side.fract() == 0.0;
    match sides.into_iter().all(is_side) {
        true => Ok(sides.map(|side| side as u32)),
        false => Err(element.refuse(format!("expected two whole numbers above zero, found {:?}", element.text()))),
    }
}
