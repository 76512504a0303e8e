//! How well a calibration is known: standard deviation of the image point of a viewing ray over the sensor, and the
//! correlations of its parameters.

use super::figures::{Axis, Colours, CorrelationMatrix, HeatMap, correlation_matrix, heat_map};
use super::html::Page;
use super::numbers::significant;
use super::pictures::RunFolder;
use crate::camera::undistort::undistort;
use crate::camera::{DCX, F, Interior, PARAMETER_COUNT, PARAMETERS, PPX, PPY, fraser};
use crate::evaluate::distortion_field::Grid;
use crate::math::rotation::skew;
use crate::run::folder::CovarianceRow;
use nalgebra::{DMatrix, Matrix2x3, Matrix3, Vector3};

/// Cells over the sensor.
const GRID: Grid = Grid { columns: 32, rows: 24 };
/// Correlations from which on a pair is framed.
const STRONG: f64 = 0.9;
/// Parameters of a legible matrix.
const MOST_NAMES: usize = 40;

type Covariance = nalgebra::SMatrix<f64, PARAMETER_COUNT, PARAMETER_COUNT>;

/// Adds both to the section of the cameras.
pub(super) fn section(page: &mut Page, run: &RunFolder) {
    for (number, (camera, _)) in run.summary.cameras.0.iter().enumerate() {
        let size = run.sensor.iter().find(|row| row.camera == *camera).map(|row| [row.width_px, row.height_px]);
        let (Some(size), Some(interior)) = (size, interior(run, camera)) else { continue };
        let Some(covariance) = covariance(run, camera) else { continue };
        let Some(sigmas) = over_the_sensor(&interior, &covariance, size) else { continue };
        let finite = || sigmas.iter().copied().filter(|sigma| sigma.is_finite());
        let (n, largest) = (finite().count().max(1) as f64, finite().fold(0.0, f64::max));
        let rms = (finite().map(|sigma| sigma * sigma).sum::<f64>() / n).sqrt();
        let map = HeatMap {
            title: format!("Uncertainty of the calibration over the sensor, camera {camera}"),
            x: Axis::new("x", "px").range(0.0, size[0]),
            y: Axis::new("y", "px").range(0.0, size[1]),
            y_down: true,
            columns: GRID.columns as usize,
            values: sigmas.clone(),
            value: Axis::new("1 sigma", "px"),
            colours: Colours::Magnitude,
            ..HeatMap::default()
        };
        let caption = format!(
            "Standard deviation of the image point of a viewing ray, 1 sigma, both coordinates together: RMS {} px, at \
             most {} px. The rotation that the orientations of the images absorb is taken out.",
            significant(rms, 2),
            significant(largest, 2)
        );
        page.figure(&format!("camera-uncertainty-{}", number + 1), heat_map(&map), &caption);
    }
    correlations(page, &run.covariance);
}

fn interior(run: &RunFolder, camera: &str) -> Option<Interior> {
    let (_, named) = run.summary.cameras.0.iter().find(|(name, _)| name == camera)?;
    let mut interior = [f64::NAN; PARAMETER_COUNT];
    for (value, wanted) in interior.iter_mut().zip(PARAMETERS) {
        *value = named.0.iter().find(|(name, _)| name == wanted)?.1.value;
    }
    Some(interior)
}

/// Covariance of the twelve parameters; `None` where none of them was estimated.
fn covariance(run: &RunFolder, camera: &str) -> Option<Covariance> {
    let mut covariance = Covariance::zeros();
    let place = |parameter: &str| PARAMETERS.iter().position(|name| *name == parameter);
    let own = |row: &&CovarianceRow| row.camera == camera && row.with_camera == camera;
    let mut estimated = false;
    for row in run.covariance.iter().filter(own) {
        let (i, j) = (place(&row.parameter)?, place(&row.with_parameter)?);
        (covariance[(i, j)], covariance[(j, i)]) = (row.covariance, row.covariance);
        estimated = true;
    }
    Some(covariance).filter(|_| estimated)
}

/// Standard deviation (px) of the image point of the ray through the middle of each cell; NaN where there is no ray.
///
/// The best rotation is taken out of the derivatives by each parameter: with it a shift of the principal point costs
/// nothing. A centre of distortion that is tied to the principal point moves with it.
fn over_the_sensor(interior: &Interior, covariance: &Covariance, size: [f64; 2]) -> Option<Vec<f64>> {
    let tied = covariance[(PPX, PPX)] > 0.0 && covariance[(DCX, DCX)] == 0.0 && interior[PPX] == interior[DCX];
    let points: Vec<[f64; 2]> = GRID.points(size).collect();
    let mut by_parameter = DMatrix::zeros(2 * points.len(), PARAMETER_COUNT);
    let mut by_rotation = DMatrix::zeros(2 * points.len(), 3);
    let mut defined = vec![false; points.len()];
    for (p, at) in points.iter().enumerate() {
        let Some([u, v]) = undistort(interior, *at) else { continue };
        let ray = Vector3::new((u - interior[PPX]) / interior[F], (v - interior[PPY]) / interior[F], 1.0);
        let Some(projection) = fraser::project_with_derivatives(interior, ray.into()) else { continue };
        defined[p] = true;
        let turned: Matrix3<f64> = skew(&ray);
        let by_point = Matrix2x3::from_fn(|i, j| projection.d_camera_point[i][j]) * -turned;
        for i in 0..2 {
            for k in 0..PARAMETER_COUNT {
                let moved_with = if tied && (k == PPX || k == PPY) { projection.d_interior[i][k + 2] } else { 0.0 };
                by_parameter[(2 * p + i, k)] = projection.d_interior[i][k] + moved_with;
            }
            for k in 0..3 {
                by_rotation[(2 * p + i, k)] = by_point[(i, k)];
            }
        }
    }
    let normal = by_rotation.transpose() * &by_rotation;
    let absorbed = normal.cholesky()?.solve(&(by_rotation.transpose() * &by_parameter));
    let left = by_parameter - by_rotation * absorbed;
    let variance = |p: usize| -> f64 {
        let rows = left.rows(2 * p, 2);
        (rows * covariance * rows.transpose()).trace()
    };
    let sigma = |p: usize| if defined[p] { variance(p).max(0.0).sqrt() } else { f64::NAN };
    Some((0..points.len()).map(sigma).collect())
}

fn correlations(page: &mut Page, rows: &[CovarianceRow]) {
    let name = |camera: &str, parameter: &str| match camera {
        "" => parameter.to_string(),
        camera => format!("{camera} {parameter}"),
    };
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        let one = name(&row.camera, &row.parameter);
        if !names.contains(&one) {
            names.push(one);
        }
    }
    if names.len() < 2 || names.len() > MOST_NAMES {
        return;
    }
    let mut values = vec![f64::NAN; names.len() * names.len()];
    for row in rows {
        let place = |wanted: String| names.iter().position(|name| *name == wanted);
        let pair = (place(name(&row.camera, &row.parameter)), place(name(&row.with_camera, &row.with_parameter)));
        if let (Some(i), Some(j)) = pair {
            let value = row.correlation.unwrap_or(f64::NAN);
            (values[i * names.len() + j], values[j * names.len() + i]) = (value, value);
        }
    }
    let matrix =
        CorrelationMatrix { title: "Correlations of cameras and effects".into(), names, values, threshold: STRONG };
    page.details("Correlations of the parameters of cameras and effects", |page| {
        let caption = "Parameters of a framed pair are hardly known apart: one can be exchanged for the other.";
        page.figure("correlations", correlation_matrix(&matrix), caption);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [f64; 2] = [6000.0, 4000.0];

    fn camera() -> Interior {
        let mut camera = [0.0; PARAMETER_COUNT];
        (camera[F], camera[PPX], camera[PPY], camera[DCX], camera[DCX + 1]) = (6000.0, 3000.0, 2000.0, 3000.0, 2000.0);
        camera
    }

    #[test]
    fn an_uncertain_f_grows_from_the_middle_and_a_rotation_absorbs_the_principal_point() {
        let mut covariance = Covariance::zeros();
        covariance[(F, F)] = 1.0;
        let sigmas = over_the_sensor(&camera(), &covariance, SIZE).expect("a map");
        let corner = (3000.0_f64 * (1.0 - 1.0 / 32.0)).hypot(2000.0 * (1.0 - 1.0 / 24.0)) / 6000.0;
        assert!((sigmas[0] - corner).abs() < 1e-9, "{} {corner}", sigmas[0]);
        let middle = sigmas[12 * 32 + 16];
        assert!(middle < 0.05 * corner, "{middle}");

        let mut covariance = Covariance::zeros();
        (covariance[(PPX, PPX)], covariance[(PPY, PPY)]) = (1.0, 1.0);
        let sigmas = over_the_sensor(&camera(), &covariance, SIZE).expect("a map");
        // Of 1.4 px a small part is left, at the edges: a rotation is no shift there.
        assert!(sigmas.iter().all(|sigma| *sigma < 0.4), "{sigmas:?}");
    }
}
