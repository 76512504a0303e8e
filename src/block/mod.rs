//! What was measured: cameras, images, tie points, surveyed points. A fit reads a [`Block`] and never changes it.
//!
//! Lengths in object space are metres, image coordinates pixels from the outer corner of the top-left pixel (x right, y
//! down), angles radians, times seconds, temperatures degrees Celsius.

mod by_point;
mod change_position;
pub mod edit;
pub mod edited;
pub mod inventory;
pub mod mended;
pub mod neighbours;

pub use by_point::ByPoint;

use crate::camera::Camera;
use nalgebra::{UnitQuaternion, Vector3};

/// Position of a camera in [`Block::cameras`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CameraId(pub u32);
/// Position of a flight in [`Block::flights`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FlightId(pub u32);
/// Position of an image in [`Block::images`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImageId(pub u32);
/// Position of a tie point in [`Block::tie_points`], or of a surveyed point in [`Block::surveyed`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PointId(pub u32);

macro_rules! index {
    ($($id:ident),*) => { $(
        impl $id {
            /// As an index.
            pub fn index(self) -> usize { self.0 as usize }
        }
        impl From<usize> for $id {
            /// # Panics
            /// Beyond `u32::MAX` elements.
            fn from(index: usize) -> Self { Self(u32::try_from(index).expect("fewer than 2^32 elements")) }
        }
    )* };
}
index!(CameraId, FlightId, ImageId, PointId);

/// A-priori standard deviations, used where a row gives none; infinite where the block gives none either, which reading
/// a block allows only for what no row uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sigma {
    /// Tie-point image coordinate, px.
    pub tie_px: f64,
    /// Image coordinate of a surveyed point, px.
    pub mark_px: f64,
    /// Surveyed coordinate, horizontal, m.
    pub control_xy_m: f64,
    /// Surveyed coordinate, height, m.
    pub control_z_m: f64,
    /// GNSS position, horizontal, m.
    pub gnss_xy_m: f64,
    /// GNSS position, height, m.
    pub gnss_z_m: f64,
}

impl Sigma {
    /// A block that gives none.
    pub const NOT_GIVEN: Self = Self {
        tie_px: f64::INFINITY,
        mark_px: f64::INFINITY,
        control_xy_m: f64::INFINITY,
        control_z_m: f64::INFINITY,
        gnss_xy_m: f64::INFINITY,
        gnss_z_m: f64::INFINITY,
    };
}

/// Exterior orientation of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// `R`, world to camera.
    pub rotation: UnitQuaternion<f64>,
    /// Projection centre `C`, m.
    pub centre: Vector3<f64>,
}

impl Pose {
    /// `R (P - C)`: a world point in the camera frame, m.
    pub fn cam_from_world(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * (point - self.centre)
    }
}

/// A measured antenna position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gnss {
    /// Antenna position, m.
    pub position: Vector3<f64>,
    /// Horizontal standard deviation, m; else the block's.
    pub sigma_xy: Option<f64>,
    /// Standard deviation of the height, m; else the block's.
    pub sigma_z: Option<f64>,
}

/// One image: what the camera, the platform and the receiver recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Unique name.
    pub name: String,
    /// Its camera.
    pub camera: CameraId,
    /// Its flight.
    pub flight: FlightId,
    /// Exposure time, s.
    pub time_s: Option<f64>,
    /// Camera temperature, degrees Celsius.
    pub temperature_c: Option<f64>,
    /// Approximate exterior orientation.
    pub pose: Pose,
    /// Antenna position, where measured.
    pub gnss: Option<Gnss>,
    /// Platform velocity at exposure, m/s, world axes.
    pub velocity: Option<Vector3<f64>>,
    /// Angular velocity at exposure, rad/s, camera axes.
    pub angular_velocity: Option<Vector3<f64>>,
    /// Exposure time, s.
    pub exposure_s: Option<f64>,
    /// Focus distance, m.
    pub focus_m: Option<f64>,
}

impl Image {
    /// An image of which nothing is recorded but its pose.
    pub fn new(name: impl Into<String>, camera: CameraId, flight: FlightId, pose: Pose) -> Self {
        Self {
            name: name.into(),
            camera,
            flight,
            time_s: None,
            temperature_c: None,
            pose,
            gnss: None,
            velocity: None,
            angular_velocity: None,
            exposure_s: None,
            focus_m: None,
        }
    }
}

/// A tie point: an object point that is known by its image measurements alone.
#[derive(Debug, Clone, PartialEq)]
pub struct TiePoint {
    /// Unique name.
    pub name: String,
    /// Approximate coordinates, m; absent: intersected from the measurements.
    pub position: Option<Vector3<f64>>,
}

/// Part of a surveyed point in the adjustment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// Takes part in the datum.
    Control,
    /// Never used in any estimation, only compared with.
    Check,
}

/// A surveyed point.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyedPoint {
    /// Unique name.
    pub name: String,
    /// Surveyed coordinates, m.
    pub position: Vector3<f64>,
    /// Control or check.
    pub role: Role,
    /// Horizontal standard deviation, m; else the block's.
    pub sigma_xy: Option<f64>,
    /// Standard deviation of the height, m; else the block's.
    pub sigma_z: Option<f64>,
}

/// One image measurement of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Image it was made in.
    pub image: ImageId,
    /// Tie point (in [`Block::ties`]) or surveyed point (in [`Block::marks`]).
    pub point: PointId,
    /// px.
    pub x: f64,
    /// px.
    pub y: f64,
    /// Standard deviation of each coordinate, px; else the block's.
    pub sigma: Option<f64>,
}

/// What was measured. Order of every list is the order of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Name.
    pub name: String,
    /// Coordinate system, free text or `EPSG:n`.
    pub crs: String,
    /// The system in which the survey came, where that is another one; empty otherwise. Results are handed on in it,
    /// too.
    pub survey_crs: String,
    /// Where the zero of all object coordinates of this block lies in that system, m: zero unless
    /// [`Block::about_its_centre`] moved it.
    pub origin: Vector3<f64>,
    /// A-priori precision.
    pub sigma: Sigma,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Names of the flights, in order of first appearance.
    pub flights: Vec<String>,
    /// Images.
    pub images: Vec<Image>,
    /// Tie points.
    pub tie_points: Vec<TiePoint>,
    /// Tie-point measurements.
    pub ties: Vec<Measurement>,
    /// Control and check points.
    pub surveyed: Vec<SurveyedPoint>,
    /// Image measurements of surveyed points.
    pub marks: Vec<Measurement>,
    /// Unknown columns of `images.csv`, kept for writing: name and one cell per image.
    pub extra_image_columns: Vec<(String, Vec<String>)>,
}

impl Block {
    /// The same block with other image measurements.
    pub fn with_measurements(&self, ties: Vec<Measurement>, marks: Vec<Measurement>) -> Self {
        let (tie_points, surveyed) = (self.tie_points.clone(), self.surveyed.clone());
        Self { ties, marks, tie_points, surveyed, ..self.images_alone() }
    }

    /// The same cameras, flights and images without any point or measurement: what a table of images needs of a block
    /// of millions.
    pub fn images_alone(&self) -> Self {
        Self {
            name: self.name.clone(),
            crs: self.crs.clone(),
            survey_crs: self.survey_crs.clone(),
            origin: self.origin,
            sigma: self.sigma,
            cameras: self.cameras.clone(),
            flights: self.flights.clone(),
            images: self.images.clone(),
            tie_points: Vec::new(),
            ties: Vec::new(),
            surveyed: Vec::new(),
            marks: Vec::new(),
            extra_image_columns: self.extra_image_columns.clone(),
        }
    }

    /// Camera of an image.
    pub fn camera_of(&self, image: ImageId) -> &Camera {
        &self.cameras[self.images[image.index()].camera.index()]
    }

    /// The same block with coordinates that are small: an adjustment loses digits where they are not (a northing of 5
    /// 000 km leaves a nanometre to the tenth of a micrometre of a close range, and derivatives by a rotation grow with
    /// it). The origin is the centre of the projection centres, rounded to a power of ten that is at least the size of
    /// the block: a block that has its zero within stays as it is.
    pub fn about_its_centre(self) -> Self {
        let centres = || self.images.iter().map(|image| &image.pose.centre);
        let known = self.tie_points.iter().filter_map(|point| point.position.as_ref());
        let all = centres().chain(known).chain(self.surveyed.iter().map(|point| &point.position));
        let (low, high) = all
            .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
                (low.inf(p), high.sup(p))
            });
        let size = (high - low).max();
        if !(size > 0.0 && size.is_finite()) {
            return self;
        }
        let unit = 10f64.powf(size.log10().ceil());
        let mean = centres().sum::<Vector3<f64>>() / self.images.len() as f64;
        let origin = self.origin + mean.map(|coordinate| (coordinate / unit).round() * unit);
        self.about(origin)
    }

    /// The same block with its zero at `origin` of its coordinate system, m.
    pub fn about(mut self, origin: Vector3<f64>) -> Self {
        let move_by = self.origin - origin;
        self.origin = origin;
        if move_by == Vector3::zeros() {
            return self;
        }
        for image in &mut self.images {
            image.pose.centre += move_by;
            if let Some(gnss) = &mut image.gnss {
                gnss.position += move_by;
            }
        }
        self.tie_points.iter_mut().filter_map(|point| point.position.as_mut()).for_each(|p| *p += move_by);
        self.surveyed.iter_mut().for_each(|point| point.position += move_by);
        self
    }

    /// Number of surveyed points of a role.
    pub fn count(&self, role: Role) -> usize {
        self.surveyed.iter().filter(|point| point.role == role).count()
    }
}
