//! What is known beside a measurement: constants of the block and of the image, and the place at which the
//! measurement is predicted.

use nalgebra::Vector3;

/// Observed constants of the whole block.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BlockContext {
    /// Mean of the projection centres' start values, m.
    pub centre: Vector3<f64>,
    /// Mean of the surveyed coordinates of the control points in the datum; without any, of the antenna positions in
    /// the datum; m. Check points are never in it: they take part in no estimation.
    pub survey_centre: Vector3<f64>,
    /// Number of images, flights, cameras.
    pub counts: [u32; 3],
    /// Mean temperature over the images that have one, degrees Celsius; NaN when none has.
    pub mean_temperature_c: f64,
    /// `[time_s, temperature_c]` of the images that have both, in order of time.
    pub temperature_history: Vec<[f64; 2]>,
}

/// Observed constants of one image; NaN where not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageContext {
    /// Position of image, flight and camera in their lists.
    pub image: u32,
    /// See `image`.
    pub flight: u32,
    /// See `image`.
    pub camera: u32,
    /// Sensor size, px.
    pub width_px: f64,
    /// Sensor size, px.
    pub height_px: f64,
    /// When it was exposed, s.
    pub time_s: f64,
    /// `(t - mean t) / (max t - min t)` over the block's images.
    pub tau: f64,
    /// The same from the image's place in the table instead of its time.
    pub tau_order: f64,
    /// `t - (first t of the flight)`, s.
    pub flight_time_s: f64,
    /// Length of the flight in time, s.
    pub flight_span_s: f64,
    /// Camera temperature, degrees Celsius.
    pub temperature_c: f64,
    /// Platform velocity, m/s, world axes; derived from times and poses where it is not measured.
    pub velocity: Vector3<f64>,
    /// Standard deviation of a derived velocity in each coordinate, m/s; NaN where it was measured, or where two
    /// positions alone give it.
    pub velocity_sigma: f64,
    /// Angular velocity, rad/s, camera axes; zero where it is not measured.
    pub angular_velocity: Vector3<f64>,
    /// For how long, s.
    pub exposure_s: f64,
    /// Focus distance, m.
    pub focus_m: f64,
}

impl Default for ImageContext {
    fn default() -> Self {
        let unknown = f64::NAN;
        Self {
            image: 0,
            flight: 0,
            camera: 0,
            width_px: unknown,
            height_px: unknown,
            time_s: unknown,
            tau: unknown,
            tau_order: unknown,
            flight_time_s: unknown,
            flight_span_s: unknown,
            temperature_c: unknown,
            velocity: Vector3::repeat(unknown),
            velocity_sigma: unknown,
            angular_velocity: Vector3::zeros(),
            exposure_s: unknown,
            focus_m: unknown,
        }
    }
}

/// Which kind of surveyed coordinate an effect of the frame stage is asked about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum SurveyedKind {
    /// A control or check point.
    Point = 0,
    /// An antenna.
    Antenna = 1,
}

/// What an effect is told of one measurement.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// The block's.
    pub block: &'a BlockContext,
    /// The image's.
    pub image: &'a ImageContext,
    /// Column (x) of the image point as it is *predicted*, at the end of the chain, px; NaN where the stage has none.
    /// The measured one would carry the noise of the residual that an effect is tested on.
    pub column_px: f64,
    /// Row (y) of the image point as it is predicted, px; NaN where the stage has none.
    pub row_px: f64,
    /// What the coordinate at the frame stage belongs to; `None` at the other stages.
    pub surveyed: Option<SurveyedKind>,
}
