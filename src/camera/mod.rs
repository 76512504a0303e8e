//! The camera: twelve numbers of interior orientation ([`Interior`]), the sensor they belong to ([`Camera`]), and the
//! Fraser projection ([`fraser`]) with its inverse ([`undistort`]).

pub mod fraser;
pub mod undistort;

/// Names of the twelve interior parameters, in the order of every array of twelve in this program.
pub const PARAMETERS: [&str; 12] = ["f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2"];

/// Units of [`PARAMETERS`].
pub const UNITS: [&str; 12] = ["px", "px", "px", "px", "px", "px^-2", "px^-4", "px^-6", "px^-1", "px^-1", "1", "1"];

/// Groups of interior parameters that are freed or held together: name and indices into [`PARAMETERS`].
pub const GROUPS: [(&str, &[usize]); 6] = [
    ("f", &[0]),
    ("pp", &[1, 2]),
    ("dc", &[3, 4]),
    ("radial", &[5, 6, 7]),
    ("decentring", &[8, 9]),
    ("affinity", &[10, 11]),
];

/// Indices into [`PARAMETERS`] that a name of `--free` or `--fix` stands for: a parameter, a group, `all` or `none`.
pub fn parameter_indices(name: &str) -> Option<Vec<usize>> {
    match name {
        "all" => return Some((0..12).collect()),
        "none" => return Some(Vec::new()),
        _ => {}
    }
    if let Some((_, indices)) = GROUPS.iter().find(|(group, _)| *group == name) {
        return Some(indices.to_vec());
    }
    PARAMETERS.iter().position(|parameter| *parameter == name).map(|index| vec![index])
}

/// Interior orientation of the Fraser camera: `[f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2]`, in pixels
/// ([`UNITS`]); the formula stands in [`fraser`].
pub type Interior = [f64; 12];

/// A camera of the block.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Unique id.
    pub id: String,
    /// Sensor width, px.
    pub width_px: u32,
    /// Sensor height, px.
    pub height_px: u32,
    /// Pixel size, micrometres.
    pub pixel_um: Option<f64>,
    /// Approximate interior orientation.
    pub interior: Interior,
}

impl Camera {
    /// Half the sensor's diagonal, px: the length by which distortion coefficients are scaled.
    pub fn half_diagonal_px(&self) -> f64 {
        0.5 * f64::from(self.width_px).hypot(f64::from(self.height_px))
    }

    /// Largest plausible range of each interior parameter: the focal length itself for f, the sensor for pp and dc, and for each coefficient
    /// the value that moves a point at half the diagonal by half the diagonal. What is known to no better is not determined.
    pub fn domains(&self) -> Interior {
        let h = self.half_diagonal_px();
        let (width, height) = (f64::from(self.width_px), f64::from(self.height_px));
        let mut domains = self.scales().map(|scale| scale * h);
        domains[..5].copy_from_slice(&[self.interior[0], width, height, width, height]);
        domains
    }

    /// Size of one unit of each interior parameter inside the solvers (raw = scale x scaled): 1 px for f, pp and dc, and for
    /// each coefficient the value that moves a point at half the diagonal by one pixel.
    pub fn scales(&self) -> Interior {
        let h = self.half_diagonal_px();
        let k = |order: i32| h.powi(-2 * order - 1);
        [1.0, 1.0, 1.0, 1.0, 1.0, k(1), k(2), k(3), h.powi(-2), h.powi(-2), h.recip(), h.recip()]
    }
}
