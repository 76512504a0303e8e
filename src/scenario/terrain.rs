//! The terrain as a surface to draw points from.

use super::description::Terrain;
use super::random::{Table, stream};
use nalgebra::Vector3;
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// Plane waves that make the relief.
const WAVES: usize = 6;

/// One plane wave of the relief.
struct Wave {
    /// Wave vector, rad/m.
    k: [f64; 2],
    phase: f64,
}

/// The terrain with its relief.
pub(super) struct Ground<'a> {
    terrain: &'a Terrain,
    waves: Vec<Wave>,
    /// Of each wave, m.
    amplitude: f64,
}

/// A place on the ground.
#[derive(Clone, Copy)]
pub(super) struct GroundPlace {
    /// m.
    pub position: Vector3<f64>,
    /// Unit normal of the surface, upwards.
    pub normal: Vector3<f64>,
}

impl<'a> Ground<'a> {
    pub(super) fn new(terrain: &'a Terrain, seed: u64) -> Self {
        let (relief, wavelength) = match *terrain {
            Terrain::Dike { relief_m, wavelength_m, .. } | Terrain::Plain { relief_m, wavelength_m, .. } => {
                (relief_m, wavelength_m)
            }
            Terrain::Targets { .. } => (0.0, 1.0),
        };
        let mut rng = stream(seed, Table::Terrain, 0);
        let waves = (0..WAVES)
            .map(|_| {
                let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
                let number = TAU / (wavelength * rng.random_range(0.6..1.8));
                Wave { k: [number * cos, number * sin], phase: rng.random_range(0.0..TAU) }
            })
            .collect();
        // The mean square of a sum of waves is the sum of half the squared amplitudes.
        Ground { terrain, waves, amplitude: relief * (2.0 / WAVES as f64).sqrt() }
    }

    /// Bounds of every height that [`Ground::draw`] can give, m.
    pub(super) fn height_range(&self) -> [f64; 2] {
        let relief = self.amplitude * WAVES as f64;
        match *self.terrain {
            Terrain::Dike { crest_height_m, roughness_m, .. } => {
                [-relief - roughness_m, relief + roughness_m + crest_height_m]
            }
            Terrain::Plain { roughness_m, .. } => [-relief - roughness_m, relief + roughness_m],
            Terrain::Targets { height_m, .. } => [0.0, height_m],
        }
    }

    /// A random place of uniform density, also in the margin if asked for.
    pub(super) fn draw(&self, rng: &mut impl Rng, with_margin: bool) -> GroundPlace {
        let [length, width, margin] = self.terrain.extent();
        let margin = if with_margin { margin } else { 0.0 };
        let x = (rng.random::<f64>() - 0.5) * (width + 2.0 * margin);
        let y = (rng.random::<f64>() - 0.5) * (length + 2.0 * margin);
        let spread: f64 = rng.random();
        let rough = |roughness: f64| roughness * (2.0 * spread - 1.0);
        match *self.terrain {
            Terrain::Targets { height_m, .. } => {
                GroundPlace { position: Vector3::new(x, y, height_m * spread), normal: Vector3::z() }
            }
            Terrain::Dike { roughness_m, .. } | Terrain::Plain { roughness_m, .. } => {
                let [z, dz_dx, dz_dy] = self.surface(x, y);
                GroundPlace {
                    position: Vector3::new(x, y, z + rough(roughness_m)),
                    normal: Vector3::new(-dz_dx, -dz_dy, 1.0).normalize(),
                }
            }
        }
    }

    /// Height of the surface (m) and its two slopes.
    fn surface(&self, x: f64, y: f64) -> [f64; 3] {
        let mut surface = [0.0; 3];
        for wave in &self.waves {
            let (sin, cos) = (wave.k[0] * x + wave.k[1] * y + wave.phase).sin_cos();
            surface[0] += self.amplitude * sin;
            surface[1] += self.amplitude * wave.k[0] * cos;
            surface[2] += self.amplitude * wave.k[1] * cos;
        }
        if let Terrain::Dike { crest_width_m, crest_height_m, slope_run, .. } = *self.terrain {
            let down = (x.abs() - 0.5 * crest_width_m) / slope_run;
            surface[0] += (crest_height_m - down.max(0.0)).max(0.0);
            if down > 0.0 && down < crest_height_m {
                surface[1] -= x.signum() / slope_run;
            }
        }
        surface
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dike() -> Terrain {
        Terrain::Dike {
            length_m: 200.0,
            width_m: 40.0,
            margin_m: 20.0,
            crest_width_m: 4.0,
            crest_height_m: 5.0,
            slope_run: 2.0,
            relief_m: 0.5,
            wavelength_m: 30.0,
            roughness_m: 0.1,
        }
    }

    #[test]
    fn slopes_are_the_derivative_of_the_height() {
        let terrain = dike();
        let ground = Ground::new(&terrain, 3);
        let step = 1e-5;
        for (x, y) in [(0.5, 3.0), (5.0, -40.0), (-7.0, 88.0), (25.0, 1.0)] {
            let [_, dx, dy] = ground.surface(x, y);
            let height = |x, y| ground.surface(x, y)[0];
            assert!((dx - (height(x + step, y) - height(x - step, y)) / (2.0 * step)).abs() < 1e-6);
            assert!((dy - (height(x, y + step) - height(x, y - step)) / (2.0 * step)).abs() < 1e-6);
        }
    }

    #[test]
    fn crest_stands_above_the_plain_and_relief_has_its_size() {
        let terrain = dike();
        let ground = Ground::new(&terrain, 3);
        let mut rng = stream(1, Table::Tie, 0);
        let [low, high] = ground.height_range();
        let (mut crest, mut plain) = (Vec::new(), Vec::new());
        for _ in 0..20_000 {
            let place = ground.draw(&mut rng, true);
            let [x, y, z] = place.position.into();
            assert!(x.abs() <= 40.0 && y.abs() <= 120.0 && z >= low && z <= high);
            if x.abs() < 2.0 {
                crest.push(z);
            } else if x.abs() > 12.0 {
                plain.push(z);
            }
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        assert!((mean(&crest) - mean(&plain) - 5.0).abs() < 0.3);
        let rms = mean(&plain.iter().map(|z| z * z).collect::<Vec<_>>()).sqrt();
        assert!((rms - 0.5).abs() < 0.15, "{rms}");
    }
}
