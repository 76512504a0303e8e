//! What the residuals would be with an effect in the model.

use super::columns::Columns;
use crate::run::folder::{CheckRow, GnssRow};

/// What a node would be with an effect.
pub struct Predicted {
    /// Its measurements.
    pub columns: Columns,
    /// Its surveyed points.
    pub checks: Vec<CheckRow>,
    /// Its GNSS positions.
    pub gnss: Vec<GnssRow>,
    /// Per coordinate, px.
    pub tie_rms_px: f64,
    /// 3D RMS of the GNSS positions, m; `None` without any.
    pub gnss_rms_m: Option<f64>,
    /// 3D RMS at check points, m; `None` without any.
    pub check_rms_m: Option<f64>,
}
