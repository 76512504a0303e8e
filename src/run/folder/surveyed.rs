//! Rows of surveyed points: computed minus surveyed, with standard deviations.

use super::rows::{CheckRow, ModelCheckRow};
use super::solved::Solved;
use crate::block::{Block, Role};
use crate::evaluate::intersection::Intersection;
use crate::evaluate::{Comparison, checks};
use nalgebra::Vector3;

impl Solved<'_> {
    pub(super) fn checks(&self) -> impl Iterator<Item = CheckRow> {
        let comparison = self.run.comparison.iter();
        let rows = comparison.flat_map(|comparison| comparison.rows.iter().zip(&comparison.intersections.points));
        rows.map(|(row, seen)| {
            let Surveyed { point, role, d, at } = Surveyed::of(self.block, row);
            // A survey without a stated precision has an infinite one.
            let sigma = self.sigma0.map(|sigma0| self.check_sigma(row, seen, sigma0));
            let sigma = |k: usize| sigma.map(|sigma| sigma[k]).filter(|sigma| sigma.is_finite());
            let [easting, northing, height] = self.in_survey(&at);
            let squares: f64 = seen.residuals.iter().map(|residual| residual.norm_squared()).sum();
            CheckRow {
                point,
                role,
                dx: d.x,
                dy: d.y,
                dz: d.z,
                x: at.x,
                y: at.y,
                z: at.z,
                sigma_dx: sigma(0),
                sigma_dy: sigma(1),
                sigma_dz: sigma(2),
                images: Some(seen.residuals.len()),
                rms_px: Some((squares / (2.0 * seen.residuals.len() as f64)).sqrt()).filter(|rms| rms.is_finite()),
                easting,
                northing,
                height,
            }
        })
    }

    /// Standard deviations of computed minus surveyed: of the point's own marks, as precise as the adjustment found
    /// them, and of its survey. Errors that cameras and poses have in common are no part of it.
    fn check_sigma(&self, row: &checks::CheckRow, seen: &Intersection, sigma0: f64) -> Vector3<f64> {
        let (block, factors) = (self.block, &self.model.sigma_factors);
        let of_flight = |mark: &usize| {
            let flight = &block.flights[block.images[block.marks[*mark].image.index()].flight.index()];
            self.model.flight_factors.get(flight).map_or(1.0, |factors| factors.image).powi(2)
        };
        let of_flights = seen.measurements.iter().map(of_flight).sum::<f64>() / seen.measurements.len() as f64;
        let marks = row.covariance.diagonal() * ((sigma0 * factors.image * factors.mark).powi(2) * of_flights);
        let own = &block.surveyed[row.point.index()];
        let xy = factors.control * own.sigma_xy.unwrap_or(block.sigma.control_xy_m);
        let z = factors.control_z * own.sigma_z.unwrap_or(block.sigma.control_z_m);
        (marks + Vector3::new(xy, xy, z).map(|sigma| sigma * sigma)).map(|variance| variance.max(0.0).sqrt())
    }
}

/// The columns that every table of surveyed points has.
struct Surveyed {
    point: String,
    role: String,
    d: Vector3<f64>,
    at: Vector3<f64>,
}

impl Surveyed {
    fn of(block: &Block, row: &checks::CheckRow) -> Self {
        let role = match row.role {
            Role::Control => "control",
            Role::Check => "check",
        };
        let point = block.surveyed[row.point.index()].name.clone();
        Self { point, role: role.into(), d: row.d, at: row.position + block.origin }
    }
}

/// Surveyed points against the block at one stage of a diagnosis.
pub fn checks_by_model(block: &Block, comparison: &Comparison, stage: &str) -> Vec<ModelCheckRow> {
    let row = |row: &checks::CheckRow| {
        let Surveyed { point, role, d, at } = Surveyed::of(block, row);
        ModelCheckRow { stage: stage.into(), point, role, dx: d.x, dy: d.y, dz: d.z, x: at.x, y: at.y, z: at.z }
    };
    comparison.rows.iter().map(row).collect()
}
