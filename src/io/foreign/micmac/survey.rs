//! Ground control and its marks, of both versions.

use super::super::super::error::Error;
use super::super::HALF_PIXEL;
use super::super::xml::Element;
use super::orientation::unquoted;
use crate::block::{Role, SurveyedPoint};
use nalgebra::Vector3;

/// A mark: image, point, px from the outer corner of the top-left pixel, standard deviation.
pub(super) struct Mark {
    pub image: String,
    pub point: String,
    pub xy: [f64; 2],
    pub sigma: Option<f64>,
}

/// `OneAppuisDAF` of the first version. A negative uncertainty is how users take a point out of the adjustment: a check
/// point.
pub(super) fn point(element: Element<'_>) -> Result<SurveyedPoint, Error> {
    let uncertainty = element.optional("Incertitude").map(|u| u.numbers::<3>()).transpose()?;
    let is_check = uncertainty.is_some_and(|u| u.iter().any(|value| *value < 0.0));
    Ok(SurveyedPoint {
        name: element.child("NamePt")?.name_text()?.to_owned(),
        position: element.child("Pt")?.numbers::<3>()?.into(),
        role: if is_check { Role::Check } else { Role::Control },
        sigma_xy: uncertainty.and_then(|[x, y, _]| above_zero(((x * x + y * y) / 2.0).sqrt())),
        sigma_z: uncertainty.and_then(|[_, _, z]| above_zero(z.abs())),
    })
}

/// An element of `SetGCP` of MMVII; its variances are xx xy xz yy yz zz. Without them the point is not used there.
pub(super) fn second_point(element: Element<'_>) -> Result<SurveyedPoint, Error> {
    let variances = element.optional("__Opt__Sigma2").map(|v| v.numbers::<6>()).transpose()?;
    let position: Vector3<f64> = element.child("Pt")?.numbers::<3>()?.into();
    Ok(SurveyedPoint {
        name: unquoted(element.child("Name")?)?.to_owned(),
        position,
        role: if variances.is_some() { Role::Control } else { Role::Check },
        sigma_xy: variances.and_then(|v| above_zero(((v[0] + v[3]) / 2.0).sqrt())),
        sigma_z: variances.and_then(|v| above_zero(v[5].sqrt())),
    })
}

/// `MesureAppuiFlottant1Im` of the first version.
pub(super) fn marks(element: Element<'_>) -> Result<Vec<Mark>, Error> {
    let image = element.child("NameIm")?.name_text()?;
    let precision = |element: Element<'_>, name| element.optional(name).map(|p| p.number()).transpose();
    let of_all = precision(element, "PrecPointeByIm")?;
    let mark = |mark: Element<'_>| {
        Ok(Mark {
            image: image.to_owned(),
            point: mark.child("NamePt")?.name_text()?.to_owned(),
            xy: mark.child("PtIm")?.numbers::<2>()?.map(|value| value + HALF_PIXEL),
            sigma: precision(mark, "PrecPointe")?.or(of_all).and_then(above_zero),
        })
    };
    element.children("OneMesureAF1I").map(mark).collect()
}

/// `SetMesIm` of MMVII; variances are xx xy yy.
pub(super) fn second_marks(element: Element<'_>) -> Result<Vec<Mark>, Error> {
    let image = unquoted(element.child("NameIm")?)?;
    let mark = |mark: Element<'_>| {
        let variances = mark.optional("Sigma2").map(|v| v.numbers::<3>()).transpose()?;
        Ok(Mark {
            image: image.to_owned(),
            point: unquoted(mark.child("Name")?)?.to_owned(),
            xy: mark.child("Pt")?.numbers::<2>()?.map(|value| value + HALF_PIXEL),
            sigma: variances.and_then(|[xx, _, yy]| above_zero(((xx + yy) / 2.0).sqrt())),
        })
    };
    element.child("Measures")?.children("el").map(mark).collect()
}

fn above_zero(sigma: f64) -> Option<f64> {
    (sigma > 0.0).then_some(sigma)
}
