//! The camera: twelve numbers of interior orientation ([`Interior`]), the sensor they belong to ([`Camera`]), and the
//! Fraser projection ([`fraser`]) with its inverse ([`undistort`]).

pub mod fraser;
pub mod undistort;

/// Number of parameters of the interior orientation.
pub const PARAMETER_COUNT: usize = 12;

/// Position of the focal length among the parameters, as of all below.
pub const F: usize = 0;
/// Principal point, x.
pub const PPX: usize = 1;
/// Principal point, y.
pub const PPY: usize = 2;
/// Centre of distortion, x.
pub const DCX: usize = 3;
/// Centre of distortion, y.
pub const DCY: usize = 4;
/// First radial coefficient.
pub const K1: usize = 5;
/// Second radial coefficient.
pub const K2: usize = 6;
/// Third radial coefficient.
pub const K3: usize = 7;
/// First decentring coefficient.
pub const P1: usize = 8;
/// Second decentring coefficient.
pub const P2: usize = 9;
/// Affinity.
pub const B1: usize = 10;
/// Shear.
pub const B2: usize = 11;

/// Names of the interior parameters, in the order of every array of them in this program.
pub const PARAMETERS: [&str; PARAMETER_COUNT] =
    ["f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2"];

/// Units of [`PARAMETERS`].
pub const UNITS: [&str; PARAMETER_COUNT] =
    ["px", "px", "px", "px", "px", "px^-2", "px^-4", "px^-6", "px^-1", "px^-1", "1", "1"];

/// Groups of interior parameters that are freed or held together: name and indices into [`PARAMETERS`].
pub const GROUPS: [(&str, &[usize]); 6] = [
    ("f", &[F]),
    ("pp", &[PPX, PPY]),
    ("dc", &[DCX, DCY]),
    ("radial", &[K1, K2, K3]),
    ("decentring", &[P1, P2]),
    ("affinity", &[B1, B2]),
];

/// Indices into [`PARAMETERS`] that a name of `--free` or `--fix` stands for: a parameter, a group, `all` or `none`.
pub fn parameter_indices(name: &str) -> Option<Vec<usize>> {
    match name {
        "all" => return Some((0..PARAMETER_COUNT).collect()),
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
pub type Interior = [f64; PARAMETER_COUNT];

/// Puts the centre of distortion at the principal point, where the two are tied.
pub fn tie_centre(interior: &mut Interior) {
    (interior[DCX], interior[DCY]) = (interior[PPX], interior[PPY]);
}

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

    /// Largest plausible range of each interior parameter: the focal length itself for f, the sensor for pp and dc, and
    /// for each coefficient the value that moves a point at half the diagonal by half the diagonal. What is known to no
    /// better is not determined.
    pub fn domains(&self) -> Interior {
        let h = self.half_diagonal_px();
        let (width, height) = (f64::from(self.width_px), f64::from(self.height_px));
        let mut domains = self.scales().map(|scale| scale * h);
        domains[..K1].copy_from_slice(&[self.interior[F], width, height, width, height]);
        domains
    }

    /// Size of one unit of each interior parameter inside the solvers (raw = scale x scaled): 1 px for f, pp and dc,
    /// and for each coefficient the value that moves a point at half the diagonal by one pixel.
    pub fn scales(&self) -> Interior {
        let h = self.half_diagonal_px();
        let k = |order: i32| h.powi(-2 * order - 1);
        [1.0, 1.0, 1.0, 1.0, 1.0, k(1), k(2), k(3), h.powi(-2), h.powi(-2), h.recip(), h.recip()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_those_of_the_names() {
        let positions = [F, PPX, PPY, DCX, DCY, K1, K2, K3, P1, P2, B1, B2];
        let names = ["f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2"];
        assert_eq!(positions.map(|k| PARAMETERS[k]), names);
    }
}
