//! Images whose measurements are shifted. A pose absorbs most of a crop, like a tilt; what it leaves tells the shift.

use super::super::scene::Scene;
use super::cause::Cause;
use super::fitting;
use super::network::{FEWEST_ROWS, FITS, Known, rows};
use super::resect::{Resected, Row, resect};
use super::words::{self, Fitting};
use crate::camera::Camera;
use crate::math::statistics::median;
use crate::mistakes::several_cameras::FEWEST_SHARE;
use crate::mistakes::{BEYOND, Mistake, ln_p, price};
use nalgebra::{Matrix2, Vector2};

/// A shift of the image below this is nothing that a person did, px: lenses and sensors wobble by less.
const LEAST_SHIFT_PX: f64 = 10.0;
/// Median over standard deviation of a distance in two coordinates (Rayleigh's distribution): `sqrt(2 ln 2)`.
const MEDIAN_OF_RAYLEIGH: f64 = 1.177_410_022_515_474_7;

/// Images that fit the network, each with the shift that fits it best.
pub fn shifted<'a>(scene: &'a Scene, known: &Known) -> Vec<Shifted<'a>> {
    let good = (0..scene.views.len()).filter(|view| !known.bad[*view]);
    good.filter_map(|view| Shifted::new(scene, known, view)).collect()
}

/// Cropped images: a shift of one image's measurements that is significant beside how far those of all images spread,
/// where that is more than noise gives, and an order of magnitude beyond the usual shift. A sensor or a focal length
/// that changes from image to image shifts all of them, and a few far more than most.
pub fn cropped(scene: &Scene, shifted: &[Shifted<'_>], alpha: f64) -> Vec<Mistake> {
    let usual = median(&shifted.iter().map(Shifted::normalised).collect::<Vec<_>>());
    let spread = (usual / MEDIAN_OF_RAYLEIGH).max(1.0);
    let usual = median(&shifted.iter().map(Shifted::size).collect::<Vec<_>>());
    let beyond = LEAST_SHIFT_PX.max(BEYOND * usual);
    let is_cropped = |shifted: &&Shifted<'_>| {
        shifted.size() > beyond && shifted.drop / spread.powi(2) > price(alpha, scene.views.len())
    };
    let found: Vec<&Shifted<'_>> = shifted.iter().filter(is_cropped).collect();
    if found.len() as f64 > FEWEST_SHARE * shifted.len() as f64 {
        return Vec::new();
    }
    found.into_iter().map(|shifted| shifted.mistake(scene)).collect()
}

/// How far the measurements of an image are shifted that does not belong to the network.
pub fn shift_of(scene: &Scene, known: &Known, view: usize) -> Option<Mistake> {
    Some(Shifted::new(scene, known, view)?.mistake(scene))
}

/// An image with a shift of its measurements as an unknown.
pub struct Shifted<'a> {
    /// Its number.
    pub view: usize,
    camera: &'a Camera,
    /// Added to measurements, px.
    pub shift: [f64; 2],
    /// Covariance of the shift, px^2.
    pub covariance: Matrix2<f64>,
    /// Fall of the sum of squares.
    pub drop: f64,
    /// Measurements that fit, and all.
    fit: [usize; 2],
}

impl<'a> Shifted<'a> {
    /// `None` where the image has too few measurements, or they do not tell a shift.
    fn new(scene: &'a Scene, known: &Known, view: usize) -> Option<Self> {
        let (camera, rows) = seen(scene, known, view)?;
        let pose = &scene.views[view].pose;
        let without = resect(camera, &rows, pose, false, known.usual)?;
        let with = resect(camera, &rows, pose, true, known.usual)?;
        let drop = cost(camera, &rows, &without, known) - cost(camera, &rows, &with, known);
        let fit = [fitting(camera, &rows, &with, FITS * known.usual), rows.len()];
        let covariance = with.offset_covariance(camera, &rows, known.usual, FITS * known.usual)?;
        Some(Self { view, camera, shift: with.offset, covariance, drop, fit })
    }

    /// Length of the shift, px.
    fn size(&self) -> f64 {
        self.shift[0].hypot(self.shift[1])
    }

    /// Standard deviation of that length, px.
    fn sigma(&self) -> f64 {
        let along = Vector2::from(self.shift).try_normalize(0.0).unwrap_or_else(Vector2::x);
        (along.dot(&(self.covariance * along))).sqrt()
    }

    /// Standard deviation of the shift where it is known least, px.
    pub fn worst_sigma(&self) -> f64 {
        self.covariance.symmetric_eigenvalues().max().sqrt()
    }

    /// The length in standard deviations.
    fn normalised(&self) -> f64 {
        self.size() / self.sigma()
    }

    fn mistake(&self, scene: &Scene) -> Mistake {
        let Self { camera, shift, fit, .. } = *self;
        let found =
            words::altered(&Fitting { image: &scene.views[self.view].name, camera, cause: Cause::Cropped, shift, fit });
        let ln_p = ln_p(self.drop, scene.views.len());
        found.sized(self.size(), Some(self.sigma()), "px").tested(self.drop, ln_p)
    }
}

/// Measurements of an image of points that others know, where they are enough.
pub fn seen<'a>(scene: &'a Scene, known: &Known, view: usize) -> Option<(&'a Camera, Vec<Row>)> {
    let rows = rows(scene, known, view, &[]);
    (rows.len() >= FEWEST_ROWS).then(|| (&scene.cameras[scene.views[view].camera], rows))
}

/// Sum of squared residuals in units of the usual error, each capped where a false match begins.
pub fn cost(camera: &Camera, rows: &[Row], resected: &Resected, known: &Known) -> f64 {
    let sigma = known.usual / MEDIAN_OF_RAYLEIGH;
    rows.iter().map(|row| (resected.error(camera, row).min(FITS * known.usual) / sigma).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::made_wrong::with;
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const ALPHA: f64 = 0.001;

    #[test]
    fn a_cropped_image_is_found_with_its_shift() {
        let (scene, known) = with(|[x, y]| [x - 40.0, y - 30.0], 0.0);
        let found = cropped(&scene, &shifted(&scene, &known), ALPHA);
        let [one] = &found[..] else { panic!("{found:?}") };
        assert_eq!((one.kind.as_str(), &one.names[..]), ("offset", &["i7".to_string()][..]));
        let size = one.value.expect("a size");
        assert!((size - 50.0).abs() < 5.0, "{size}");
        assert!(one.sigma.is_some_and(|sigma| sigma < 0.1 * size) && one.ln_p.is_finite(), "{one:?}");

        let (scene, known) = with(|xy| xy, 0.0);
        assert_eq!(cropped(&scene, &shifted(&scene, &known), ALPHA), []);
    }
    #[test]
    fn a_sensor_that_moves_is_no_cropped_image() {
        let (scene, _) = with(|xy| xy, 0.0);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut normal = |sigma: f64| sigma * random.sample::<f64, _>(StandardNormal);
        // Images differ in how well their measurements tell a shift.
        let mut all: Vec<Shifted<'_>> = (0..scene.views.len())
            .map(|view| {
                let sigma = if view % 2 == 0 { 0.2 } else { 4.0 };
                let [x, y] = [0, 1].map(|_| normal(10.0) + normal(sigma));
                let drop = (x * x + y * y) / (sigma * sigma);
                let covariance = Matrix2::identity() * sigma * sigma;
                Shifted { view, camera: &scene.cameras[0], shift: [x, y], covariance, drop, fit: [30, 30] }
            })
            .collect();
        assert_eq!(cropped(&scene, &all, ALPHA), []);

        all[2].shift = [300.0, 0.0];
        all[2].drop = (300.0_f64 / 0.2).powi(2);
        let found = cropped(&scene, &all, ALPHA);
        assert_eq!(found.iter().map(|one| one.names[0].as_str()).collect::<Vec<_>>(), ["i2"]);
    }
}
