//! Numbers that the pictures of the report show.

/// A cell of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Column and row of the cell.
    pub place: [usize; 2],
    /// Middle, px.
    pub centre: [f64; 2],
    /// Number of measurements.
    pub n: usize,
    /// Mean residual, px.
    pub mean: [f64; 2],
    /// Displacement (px) that would explain the residuals of this cell alone: larger than the mean, of which the points
    /// take a share. NaN where the base model absorbs it.
    pub displacement: [f64; 2],
    /// p-value of this cell alone; NaN where it was not tested.
    pub p_value: f64,
}

/// Cells of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorGrid {
    /// Position of the camera.
    pub camera: usize,
    /// Number of columns and rows.
    pub shape: [usize; 2],
    /// Cells with measurements, row by row.
    pub cells: Vec<Cell>,
}

/// A value per image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageValue {
    /// Position of the image.
    pub image: usize,
    /// Its flight.
    pub flight: usize,
    /// Exposure time, s; NaN where not known.
    pub time_s: f64,
    /// Number of measurements.
    pub n: usize,
    /// Mean residual, px.
    pub mean: [f64; 2],
    /// Scale residual: displacement (px) at half the diagonal, away from the middle, if it were this image's alone. NaN
    /// where the base model absorbs it.
    pub scale: f64,
    /// Its standard deviation, px.
    pub scale_sigma: f64,
    /// Mean rotation of the residuals: displacement (px) at half the diagonal, clockwise in the image. The pose absorbs
    /// nearly all of it.
    pub rotation: f64,
}

/// A bin of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileBin {
    /// Middle of the bin, in the unit of the profile.
    pub x: f64,
    /// Number of measurements.
    pub n: usize,
    /// Mean of the component, px.
    pub mean: f64,
    /// Its standard deviation if the measurements were independent, px.
    pub sigma: f64,
}

/// Mean residuals against a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Test that it belongs to.
    pub against: &'static str,
    /// Component of the residual: `x`, `y`, `radial`, `tangential`, `outward`.
    pub component: &'static str,
    /// Unit of `x`.
    pub unit: &'static str,
    /// Bins with measurements.
    pub bins: Vec<ProfileBin>,
}

/// A periodic pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Position of the camera.
    pub camera: usize,
    /// Wavelength, px.
    pub wavelength: f64,
    /// Direction in which it repeats, degrees from the x axis towards the y axis (-90 to 90).
    pub direction_deg: f64,
    /// Amplitude in x and y, px.
    pub amplitude: [f64; 2],
    /// p-value among all frequencies.
    pub p_value: f64,
}

/// Power over the frequencies of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectrumGrid {
    /// Position of the camera.
    pub camera: usize,
    /// Number of frequencies along x (non-negative) and along y (from the most negative).
    pub shape: [usize; 2],
    /// Step of frequency along x and y, 1/px.
    pub step: [f64; 2],
    /// Power relative to noise (mean 1 where nothing is), rows of equal y frequency; NaN outside the band that is
    /// searched.
    pub power: Vec<f64>,
}

/// All of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pictures {
    /// Per camera.
    pub sensor: Vec<SensorGrid>,
    /// Per camera.
    pub spectrum: Vec<SpectrumGrid>,
    /// Periodic patterns, most significant first; tested ones, significant or not.
    pub peaks: Vec<Peak>,
    /// Per image with measurements, in the order of the block.
    pub images: Vec<ImageValue>,
    /// Profiles.
    pub profiles: Vec<Profile>,
}
