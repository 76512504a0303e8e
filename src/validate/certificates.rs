//! The certificates that come with the program, by the names of their problems.

macro_rules! certificates {
    ($($name:literal)*) => {
        /// Name and text of each.
        const ALL: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../data/validation/certificates/", $name, ".json")))),*];
    };
}

certificates! {
    "pair" "strip" "area-calibrated" "pinhole-f" "pinhole-f-pp" "radial-f-k1" "radial-f-k1-k2" "radial-f-pp-k1-k2"
    "wide-ten" "targets-ten" "targets-twelve" "targets-control" "area-free" "area-control" "area-gnss" "area-all"
    "area-far-start" "dike" "two-cameras" "six-cameras" "crowd" "camera-priors" "multi-weights" "pairs-weights"
    "rolling-shutter" "rolling-shutter-turning" "forward-motion" "refraction" "flat-port" "focal-time" "focal-flight"
    "focal-image" "pp-time" "gravity-sag" "radial-high" "decentring-high" "lever-arm-delay" "gnss-drift"
    "map-scale-curvature" "three-stages" "huber" "cauchy-radial" "gross-errors" "near-singular" "no-distortion"
    "shift-of-everything" "corridor-1000" "corridor-4000"
}

/// The text of a problem's certificate.
pub(super) fn text_of(problem: &str) -> Option<&'static str> {
    ALL.iter().find(|(name, _)| *name == problem).map(|(_, text)| *text)
}
