//! What the built-in effects share: short constructors of parameters, and small steps of filling Jacobians. No physics
//! here.

use super::{Context, Domain, OutsideDomain, Parameter, Plausible, Role, Scope, Stage, SurveyedKind};
use crate::camera::{DCX, PPX};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// Columns of the derivatives of an image effect by its input.
pub(super) const IMAGE_COLUMNS: usize = Stage::Image.inputs();

/// An estimated parameter that is zero at the identity.
pub(super) fn estimated(
    name: impl Into<Cow<'static, str>>,
    unit: &'static str,
    scope: Scope,
    typical: f64,
) -> Parameter {
    let role = Role::Estimated;
    Parameter { name: name.into(), unit: unit.into(), scope, nominal: 0.0, typical, role, plausible: None }
}

/// A parameter that a score test scans; `default` is its value where nobody says anything.
pub(super) fn searched(
    name: &'static str,
    unit: &'static str,
    default: f64,
    typical: f64,
    domain: Domain,
) -> Parameter {
    let role = Role::Searched(domain);
    let scope = Scope::Global;
    Parameter { name: name.into(), unit: unit.into(), scope, nominal: default, typical, role, plausible: None }
}

/// A choice of the user with its default; `values` are the names that some values have.
pub(super) fn given(
    name: &'static str,
    unit: &'static str,
    default: f64,
    values: &'static [(&'static str, f64)],
) -> Parameter {
    let role = Role::Given(Cow::Borrowed(values));
    let (scope, typical) = (Scope::Global, 1.0);
    Parameter { name: name.into(), unit: unit.into(), scope, nominal: default, typical, role, plausible: None }
}

impl Parameter {
    /// The same with its range of possible values, in its own unit.
    pub(super) fn within(self, min: f64, max: f64, source: &'static str) -> Self {
        Self { plausible: Some(Plausible { min, max, source: source.into() }), ..self }
    }

    /// The same, possible up to `size` on both sides of zero.
    pub(super) fn up_to(self, size: f64, source: &'static str) -> Self {
        self.within(-size, size, source)
    }
}

/// Values of the given parameter [`acting_in`].
const BOTH: f64 = 0.0;
const CONTROL: f64 = 1.0;
const GNSS: f64 = 2.0;

/// Which surveyed coordinates an effect of the frame stage acts on. A block whose `crs` names a map (`EPSG:...`) or
/// nothing that is known has all of them in one system: both is the default.
pub(super) fn acting_in() -> Parameter {
    given("in", "1", BOTH, &[("both", BOTH), ("control", CONTROL), ("gnss", GNSS)])
}

/// Does a frame effect with this value of [`acting_in`] act on the coordinate that it is asked about?
pub(super) fn acts(context: &Context<'_>, value: f64) -> Result<bool, OutsideDomain> {
    let kind = context.surveyed.ok_or(OutsideDomain)?;
    match value {
        BOTH => Ok(true),
        CONTROL => Ok(kind == SurveyedKind::Point),
        GNSS => Ok(kind == SurveyedKind::Antenna),
        _ => Err(OutsideDomain),
    }
}

/// The value, or outside the domain where it is not known.
pub(super) fn known(value: f64) -> Result<f64, OutsideDomain> {
    if value.is_finite() { Ok(value) } else { Err(OutsideDomain) }
}

/// Writes the identity of `stage` to `out`.
pub(super) fn hand_on(stage: Stage, input: &[f64], out: &mut [f64]) {
    let offset = stage.identity_offset();
    out.copy_from_slice(&input[offset..offset + stage.outputs()]);
}

/// The three numbers from `offset` as a vector.
pub(super) fn vector(values: &[f64], offset: usize) -> Vector3<f64> {
    Vector3::new(values[offset], values[offset + 1], values[offset + 2])
}

/// Adds `block` to a row-major matrix of `columns` columns, its corner at (`row`, `column`).
pub(super) fn add_block(matrix: &mut [f64], columns: usize, row: usize, column: usize, block: &Matrix3<f64>) {
    for i in 0..3 {
        for j in 0..3 {
            matrix[(row + i) * columns + column + j] += block[(i, j)];
        }
    }
}

/// Adds `values` to a column of a row-major matrix of `columns` columns, from `row` down.
pub(super) fn add_column(matrix: &mut [f64], columns: usize, row: usize, column: usize, values: &Vector3<f64>) {
    for i in 0..3 {
        matrix[(row + i) * columns + column] += values[i];
    }
}

/// The error of an image's velocity in one coordinate.
pub(super) fn velocity_error(name: &'static str, typical: f64) -> Parameter {
    let role = Role::VelocityError;
    let scope = Scope::Image;
    Parameter { name: name.into(), unit: "m/s".into(), scope, nominal: 0.0, typical, role, plausible: None }
}

/// One value per image, normally distributed with the standard deviation `sigma`.
pub(super) fn random(name: &'static str, unit: &'static str, typical: f64, sigma: &'static str) -> Parameter {
    let role = Role::Random(sigma);
    let scope = Scope::Image;
    Parameter { name: name.into(), unit: unit.into(), scope, nominal: 0.0, typical, role, plausible: None }
}

/// The vector, or outside the domain where it is not known.
pub(super) fn known_vector(vector: &Vector3<f64>) -> Result<Vector3<f64>, OutsideDomain> {
    if vector.iter().all(|value| value.is_finite()) { Ok(*vector) } else { Err(OutsideDomain) }
}

/// Moves principal point and centre of distortion of an interior orientation by `shift` (px).
pub(super) fn shift_centres(interior: &mut [f64], shift: [f64; 2]) {
    for axis in 0..2 {
        interior[PPX + axis] += shift[axis];
        interior[DCX + axis] += shift[axis];
    }
}

/// Derivative of [`shift_centres`] by a quantity that moves `axis` with `slope`, added to a column of a matrix of
/// `columns` columns.
pub(super) fn shift_centres_column(matrix: &mut [f64], columns: usize, axis: usize, column: usize, slope: f64) {
    matrix[(PPX + axis) * columns + column] += slope;
    matrix[(DCX + axis) * columns + column] += slope;
}

/// What the survey says of a coordinate under a frame effect, for tests with worked numbers.
#[cfg(test)]
pub(super) fn surveyed_coordinate(
    effect: &dyn super::Effect,
    centre: [f64; 3],
    kind: SurveyedKind,
    coordinate: [f64; 3],
    theta: &[f64],
) -> Result<[f64; 3], OutsideDomain> {
    let block = super::BlockContext { survey_centre: centre.into(), ..Default::default() };
    let image = super::ImageContext::default();
    let context = Context { block: &block, image: &image, column_px: f64::NAN, row_px: f64::NAN, surveyed: Some(kind) };
    let mut out = [0.0; 3];
    effect.eval(&context, &coordinate, theta, &mut out, None, None).map(|()| out)
}
