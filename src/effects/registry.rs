//! The ordered registry of built-in effects: catalogue, help and screening follow its order.

use super::*;

static CATALOGUE: &[&dyn Effect] = &[
    &focal_time::FocalTime,
    &focal_temperature::FocalTemperature,
    &focal_flight::FocalFlight,
    &focal_image::FocalImage,
    &pp_time::PpTime,
    &pp_flight::PpFlight,
    &pp_image::PpImage,
    &gravity_sag::GravitySag,
    &local_flaw::LocalFlaw,
    &unflatness::Unflatness,
    &radial_high::RadialHigh,
    &decentring_high::DecentringHigh,
    &rolling_shutter::RollingShutter,
    &forward_motion::ForwardMotion,
    &refraction::Refraction,
    &flat_port::FlatPort,
    &earth_curvature::EarthCurvature,
    &map_scale::MapScale,
    &gnss_lever_arm::GnssLeverArm,
    &gnss_delay::GnssDelay,
    &gnss_shift::GnssShift,
    &gnss_drift::GnssDrift,
    &image_grid::ImageGrid,
    &image_fourier::ImageFourier,
    &focal_spline::FocalSpline,
];

/// Every built-in effect, in catalogue order.
pub fn catalogue() -> &'static [&'static dyn Effect] {
    CATALOGUE
}

/// The built-in effect of an id.
pub fn find(id: &str) -> Option<&'static dyn Effect> {
    catalogue().iter().copied().find(|effect| effect.descriptor().id == id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_keeps_the_laws() {
        let found: Vec<_> = catalogue().iter().flat_map(|effect| laws::check(*effect, 7)).collect();
        assert!(found.is_empty(), "{}", found.iter().map(|v| v.to_string() + "\n").collect::<String>());
    }

    #[test]
    fn every_size_of_a_cause_has_a_plausible_range() {
        for descriptor in catalogue().iter().map(|effect| effect.descriptor()) {
            for parameter in &descriptor.parameters {
                let size = matches!(parameter.role, Role::Estimated | Role::Random(_));
                let expected = size && descriptor.kind == Kind::Physical;
                // That the range is sound is a law of its own.
                assert_eq!(parameter.plausible.is_some(), expected, "{} {}", descriptor.id, parameter.name);
            }
        }
    }

    #[test]
    fn ids_are_unique_and_found() {
        laws::unique_ids(catalogue()).unwrap();
        for effect in catalogue() {
            assert_eq!(find(&effect.descriptor().id).unwrap().descriptor(), effect.descriptor());
        }
        assert!(find("no-such-effect").is_none());
    }
}
