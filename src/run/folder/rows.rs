//! The tables of a run folder: each is declared once, and the declaration is what writes and what reads it.

use crate::block::Pose;
use crate::io::table::TableWriter;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

/// A row of a table of the folder.
pub(super) trait Row {
    /// Name of the file.
    const FILE: &'static str;
    /// Names of the columns.
    const COLUMNS: &'static [&'static str];
    /// Those without which a table is refused: a folder of before the others were written is read all the same.
    const REQUIRED: &'static [&'static str];
    /// Adds the cells to a row of the file.
    fn put(&self, table: &mut TableWriter);
}

/// A value of a table.
trait Cell {
    fn put(&self, table: &mut TableWriter);
}

impl Cell for String {
    fn put(&self, table: &mut TableWriter) {
        table.text(self);
    }
}

impl Cell for f64 {
    fn put(&self, table: &mut TableWriter) {
        table.number(*self);
    }
}

impl Cell for Option<f64> {
    fn put(&self, table: &mut TableWriter) {
        table.optional(*self);
    }
}

impl Cell for Option<usize> {
    fn put(&self, table: &mut TableWriter) {
        table.text(&self.map_or_else(String::new, |count| count.to_string()));
    }
}

impl Cell for usize {
    fn put(&self, table: &mut TableWriter) {
        table.text(&self.to_string());
    }
}

/// Declares a table: its file, and its columns as the fields of a row, in their order. Columns that were added `later`
/// are optional in every sense.
macro_rules! table {
    (
        $file:literal, $(#[$about:meta])* $row:ident { $($(#[$what:meta])* $column:ident: $kind:ty,)* }
        $(later { $($(#[$which:meta])* $added:ident: $of:ty,)* })?
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, Deserialize)]
        pub struct $row {
            $($(#[$what])* pub $column: $kind,)*
            $($($(#[$which])* #[serde(default)] pub $added: $of,)*)?
        }

        impl Row for $row {
            const FILE: &'static str = $file;
            const COLUMNS: &'static [&'static str] = &[$(stringify!($column),)* $($(stringify!($added),)*)?];
            const REQUIRED: &'static [&'static str] = &[$(stringify!($column),)*];
            fn put(&self, table: &mut TableWriter) {
                $(self.$column.put(table);)*
                $($(self.$added.put(table);)*)?
            }
        }
    };
}

/// What a page needs of a row of `images.csv`, which has the columns of the block format and more.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ImageRow {
    /// Name.
    pub image: String,
    /// Flight.
    pub flight: String,
    /// Projection centre, m.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// See `x`.
    pub z: f64,
    /// Rotation, world to camera, as a quaternion.
    pub qw: f64,
    /// See `qw`.
    pub qx: f64,
    /// See `qw`.
    pub qy: f64,
    /// See `qw`.
    pub qz: f64,
    /// A-posteriori standard deviation of the projection centre, m; `None` where it was not computed.
    #[serde(default)]
    pub sigma_cx: Option<f64>,
    /// See `sigma_cx`.
    #[serde(default)]
    pub sigma_cy: Option<f64>,
    /// See `sigma_cx`.
    #[serde(default)]
    pub sigma_cz: Option<f64>,
}

impl ImageRow {
    /// Name of the file.
    pub(super) const FILE: &'static str = "images.csv";
    /// Columns that are read.
    pub(super) const COLUMNS: &'static [&'static str] = &["image", "flight", "x", "y", "z", "qw", "qx", "qy", "qz"];

    /// The adjusted exterior orientation.
    pub fn pose(&self) -> Pose {
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(self.qw, self.qx, self.qy, self.qz));
        Pose { rotation, centre: Vector3::new(self.x, self.y, self.z) }
    }
}

table! { "points.csv",
    /// An adjusted tie point.
    PointRow {
        /// Name.
        point: String,
        /// Position, m.
        x: f64,
        /// See `x`.
        y: f64,
        /// See `x`.
        z: f64,
        /// A-posteriori standard deviation, m; `None` where it was not computed.
        sigma_x: Option<f64>,
        /// See `sigma_x`.
        sigma_y: Option<f64>,
        /// See `sigma_x`.
        sigma_z: Option<f64>,
    }
    later {
        /// Images in which it is measured.
        images: Option<usize>,
        /// Ground sampling distance: its depth over the focal length, mean of its images, m per px.
        gsd_m: Option<f64>,
        /// Correlation of x and y; `None` where no covariance was computed.
        correlation_xy: Option<f64>,
        /// Easting in the system of the survey (`survey_crs` of the block), m; `None` where that is the block's own.
        easting: Option<f64>,
        /// Northing, likewise.
        northing: Option<f64>,
        /// Height, likewise.
        height: Option<f64>,
    }
}

table! { "residuals.csv",
    /// A residual of an image measurement.
    ResidualLine {
        /// Image.
        image: String,
        /// Point.
        point: String,
        /// `tie` or `mark`.
        kind: String,
        /// Observed, px.
        x: f64,
        /// See `x`.
        y: f64,
        /// Observed minus computed, px.
        rx: f64,
        /// See `rx`.
        ry: f64,
        /// A-priori standard deviation of each coordinate, px.
        sigma: f64,
    }
}

/// A row of `residuals.csv` as it lies in the file, for tables of which millions of rows are read.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct ResidualRef<'a> {
    /// See [`ResidualLine`].
    pub image: &'a str,
    /// See [`ResidualLine`].
    pub point: &'a str,
    /// See [`ResidualLine`].
    pub kind: &'a str,
    /// See [`ResidualLine`].
    pub x: f64,
    /// See [`ResidualLine`].
    pub y: f64,
    /// See [`ResidualLine`].
    pub rx: f64,
    /// See [`ResidualLine`].
    pub ry: f64,
    /// See [`ResidualLine`].
    pub sigma: f64,
}

table! { "outliers.csv",
    /// An image measurement that was set aside.
    OutlierRow {
        /// Image.
        image: String,
        /// Point.
        point: String,
        /// `tie` or `mark`.
        kind: String,
        /// Why.
        reason: String,
    }
}

/// Declares a table of surveyed points: its own columns `first`, those of a point, and those that were added `later`.
macro_rules! surveyed_table {
    (
        $file:literal, $(#[$about:meta])* $row:ident
        first { $($(#[$what:meta])* $column:ident: $kind:ty,)* }
        later { $($(#[$which:meta])* $added:ident: $of:ty,)* }
    ) => {
        table! { $file, $(#[$about])* $row {
            $($(#[$what])* $column: $kind,)*
            /// Name.
            point: String,
            /// `control` or `check`.
            role: String,
            /// Computed minus surveyed, m.
            dx: f64,
            /// See `dx`.
            dy: f64,
            /// See `dx`.
            dz: f64,
            /// Position, m.
            x: f64,
            /// See `x`.
            y: f64,
            /// See `x`.
            z: f64,
        } later { $($(#[$which])* $added: $of,)* } }
    };
}

surveyed_table! { "checks.csv",
    /// A surveyed point against the adjusted block.
    CheckRow
    first {}
    later {
        /// Standard deviation of `dx` from the marks of the point and its survey, m; `None` where it was not computed.
        sigma_dx: Option<f64>,
        /// See `sigma_dx`.
        sigma_dy: Option<f64>,
        /// See `sigma_dx`.
        sigma_dz: Option<f64>,
        /// Images in which it was marked.
        images: Option<usize>,
        /// RMS of the residuals of its marks per coordinate, px.
        rms_px: Option<f64>,
        /// Surveyed easting in the system of the survey (`survey_crs` of the block), m; `None` where that is the
        /// block's.
        easting: Option<f64>,
        /// Northing, likewise.
        northing: Option<f64>,
        /// Height, likewise.
        height: Option<f64>,
    }
}

surveyed_table! { "checks_by_model.csv",
    /// A surveyed point against the block, before effects were added and with them.
    ModelCheckRow
    first {
        /// `base` or `final`.
        stage: String,
    }
    later {}
}

table! { "parameter_covariance.csv",
    /// A pair of parameters of cameras and effects.
    CovarianceRow {
        /// Camera; empty for a parameter of an effect.
        camera: String,
        /// Parameter; of an effect with its name.
        parameter: String,
        /// See `camera`.
        with_camera: String,
        /// See `parameter`.
        with_parameter: String,
        /// A-posteriori covariance, in the units of the two.
        covariance: f64,
        /// Correlation; `None` where one of the two is held by the others.
        correlation: Option<f64>,
    }
}

table! { "gnss.csv",
    /// A GNSS position against the adjusted block.
    GnssRow {
        /// Image.
        image: String,
        /// Computed minus measured, m.
        dx: f64,
        /// See `dx`.
        dy: f64,
        /// See `dx`.
        dz: f64,
        /// Measured, m.
        x: f64,
        /// See `x`.
        y: f64,
        /// See `x`.
        z: f64,
        /// Time of exposure, s.
        time_s: Option<f64>,
        /// Heading of the platform from north to east, degrees from 0 to 360.
        heading_deg: Option<f64>,
    }
}

table! { "sensor.csv",
    /// The mean residual of a cell of the sensor.
    SensorRow {
        /// `base` or `final`.
        stage: String,
        /// Camera.
        camera: String,
        /// Size of the sensor, px.
        width_px: f64,
        /// See `width_px`.
        height_px: f64,
        /// Middle of the cell, px.
        x: f64,
        /// See `x`.
        y: f64,
        /// Number of measurements.
        n: usize,
        /// Mean residual, px.
        dx: f64,
        /// See `dx`.
        dy: f64,
        /// Of this cell alone; `None` where it was not tested.
        p_value: Option<f64>,
    }
}

table! { "image_scale.csv",
    /// The scale that an image's residuals show.
    ImageScaleRow {
        /// `base` or `final`.
        stage: String,
        /// Image.
        image: String,
        /// Flight.
        flight: String,
        /// Scale residual of the image: displacement at half the diagonal, px; `None` where the model absorbs it.
        scale_px: Option<f64>,
        /// Its standard deviation, px.
        sigma_px: Option<f64>,
    }
}

table! { "profiles.csv",
    /// The mean residual of a bin of what was recorded.
    ProfileRow {
        /// `base` or `final`.
        stage: String,
        /// Quantity.
        against: String,
        /// Component of the residual.
        component: String,
        /// Unit of `x`.
        unit: String,
        /// Middle of the bin.
        x: f64,
        /// Number of measurements.
        n: usize,
        /// Mean residual, px.
        mean_px: f64,
        /// Its standard deviation, px.
        sigma_px: Option<f64>,
    }
}

table! { "found.csv",
    /// A mark of the picture that shows an effect: residuals of the base model, and with everything as in the final
    /// model, without the effect and with it.
    FoundRow {
        /// Effect.
        effect: String,
        /// `base`, `without` or `with`.
        stage: String,
        /// What `x` is, its unit in brackets.
        against: String,
        /// Component of the residual, observed minus computed.
        component: String,
        /// Unit of the mean.
        unit: String,
        /// Camera, of marks on a sensor; empty otherwise.
        camera: String,
        /// Place.
        x: f64,
        /// Second coordinate of the place, on the sensor.
        y: Option<f64>,
        /// Number of residuals.
        n: usize,
        /// Their mean.
        mean: f64,
        /// Its standard deviation.
        sigma: Option<f64>,
    }
}
