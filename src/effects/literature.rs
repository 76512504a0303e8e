//! Literature on the effects: author, title, where it appeared, year, and the DOI where there is one for certain.

/// A publication.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Author or authors.
    pub authors: &'static str,
    /// Year.
    pub year: u16,
    /// Title.
    pub title: &'static str,
    /// Journal with volume and pages, or publisher.
    pub appeared: &'static str,
    /// Digital object identifier; empty where it has none, or none that is certain.
    pub doi: &'static str,
}

impl std::fmt::Display for Reference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { authors, year, title, appeared, doi } = self;
        write!(f, "{authors} ({year}): {title}. {appeared}.")?;
        if doi.is_empty() { Ok(()) } else { write!(f, " https://doi.org/{doi}") }
    }
}

const fn reference(
    authors: &'static str,
    year: u16,
    title: &'static str,
    appeared: &'static str,
    doi: &'static str,
) -> Reference {
    Reference { authors, year, title, appeared, doi }
}

const ACKERMANN: Reference = reference(
    "Ackermann, F., Schade, H.",
    1993,
    "Application of GPS for aerial triangulation",
    "Photogrammetric Engineering & Remote Sensing 59(11), 1625-1632",
    "",
);
const ACKERMANN_1994: Reference = reference(
    "Ackermann, F.",
    1994,
    "Practical experience with GPS supported aerial triangulation",
    "The Photogrammetric Record 14(84), 861-874",
    "",
);
const BLAZQUEZ: Reference = reference(
    "Blázquez, M.",
    2008,
    "A new approach to spatio-temporal calibration of multi-sensor systems",
    "International Archives of the Photogrammetry, Remote Sensing and Spatial Information Sciences XXXVII-B1",
    "",
);
const BROWN_1966: Reference = reference(
    "Brown, D. C.",
    1966,
    "Decentering distortion of lenses",
    "Photogrammetric Engineering 32(3), 444-462",
    "",
);
const BROWN_1971: Reference =
    reference("Brown, D. C.", 1971, "Close-range camera calibration", "Photogrammetric Engineering 37(8), 855-866", "");
const COLOMINA: Reference = reference(
    "Colomina, I., Molina, P.",
    2014,
    "Unmanned aerial systems for photogrammetry and remote sensing: A review",
    "ISPRS Journal of Photogrammetry and Remote Sensing 92, 79-97",
    "10.1016/j.isprsjprs.2014.02.013",
);
const CRAMER: Reference = reference(
    "Cramer, M., Stallmann, D., Haala, N.",
    2000,
    "Direct georeferencing using GPS/inertial exterior orientations for photogrammetric applications",
    "International Archives of Photogrammetry and Remote Sensing 33, 198-205",
    "",
);
const DAAKIR: Reference = reference(
    "Daakir, M., Zhou, Y., Pierrot Deseilligny, M., Thom, C., Martin, O., Rupnik, E.",
    2019,
    "Improvement of photogrammetric accuracy by modeling and correcting the thermal effect on camera calibration",
    "ISPRS Journal of Photogrammetry and Remote Sensing 148",
    "",
);
const DE_BOOR: Reference = reference("de Boor, C.", 2001, "A Practical Guide to Splines", "Springer", "");
const FOERSTNER: Reference = reference(
    "Förstner, W., Wrobel, B. P.",
    2016,
    "Photogrammetric Computer Vision",
    "Springer",
    "10.1007/978-3-319-11550-4",
);
/// The twelve numbers of the camera model.
pub const FRASER: Reference = reference(
    "Fraser, C. S.",
    1997,
    "Digital camera self-calibration",
    "ISPRS Journal of Photogrammetry and Remote Sensing 52(4), 149-159",
    "10.1016/S0924-2716(97)00005-1",
);
const KRAUS: Reference =
    reference("Kraus, K.", 2007, "Photogrammetry: Geometry from Images and Laser Scans", "de Gruyter, 2nd edition", "");
const LUHMANN: Reference = reference(
    "Luhmann, T., Robson, S., Kyle, S., Boehm, J.",
    2014,
    "Close-Range Photogrammetry and 3D Imaging",
    "de Gruyter, 2nd edition",
    "",
);
const MONIWA: Reference = reference(
    "Moniwa, H.",
    1980,
    "The concept of \"photo-variant\" self-calibration and its application in block adjustment with bundles",
    "XIV Congress of the International Society for Photogrammetry, Hamburg, Commission V",
    "",
);
const MUNJY: Reference = reference(
    "Munjy, R. A. H.",
    1986,
    "Self-calibration using the finite element approach",
    "Photogrammetric Engineering & Remote Sensing 52(3), 411-418",
    "",
);
const RESSL: Reference = reference(
    "Ressl, C.",
    2002,
    "The impact of conformal map projections on direct georeferencing",
    "International Archives of Photogrammetry and Remote Sensing XXXIV-3A",
    "",
);
const SAASTAMOINEN: Reference = reference("Saastamoinen, J.", 1972, "Refraction", "Photogrammetric Engineering 38", "");
const SMITH: Reference = reference(
    "Smith, M. J., Cope, E.",
    2010,
    "The effects of temperature variation on single-lens-reflex digital camera calibration parameters",
    "International Archives of the Photogrammetry, Remote Sensing and Spatial Information Sciences XXXVIII-5",
    "",
);
const TANG: Reference = reference(
    "Tang, R., Fritsch, D., Cramer, M.",
    2012,
    "New rigorous and flexible Fourier self-calibration models for airborne camera calibration",
    "ISPRS Journal of Photogrammetry and Remote Sensing 71",
    "",
);
const VAUTHERIN: Reference = reference(
    "Vautherin, J., Rutishauser, S., Schneider-Zapp, K., Choi, H. F., Chovancova, V., Glass, A., Strecha, C.",
    2016,
    "Photogrammetric accuracy and modeling of rolling shutter cameras",
    "ISPRS Annals of the Photogrammetry, Remote Sensing and Spatial Information Sciences III-3, 139-146",
    "10.5194/isprsannals-III-3-139-2016",
);

/// The study that `misclosure reproduce calibration-error` repeats.
pub const STUDY: Reference = reference(
    "Zhou, Y., Rupnik, E., Meynard, C., Thom, C., Pierrot-Deseilligny, M.",
    2019,
    "Simulation and analysis of photogrammetric UAV image blocks: influence of camera calibration error",
    "ISPRS Annals of the Photogrammetry, Remote Sensing and Spatial Information Sciences IV-2/W5",
    "",
);

/// Literature on an effect of the catalogue; nothing of one that comes from practice, and of plug-ins.
pub fn of(effect: &str) -> &'static [Reference] {
    match effect {
        "decentring-high" => &[BROWN_1966],
        "earth-curvature" => &[KRAUS],
        "flat-port" => &[LUHMANN],
        "focal-image" => &[FOERSTNER, MONIWA],
        "focal-spline" => &[DE_BOOR],
        "focal-temperature" => &[DAAKIR],
        "focal-time" | "local-flaw" => &[STUDY],
        "gnss-delay" => &[BLAZQUEZ, CRAMER],
        "gnss-drift" | "gnss-shift" => &[ACKERMANN, ACKERMANN_1994],
        "gnss-lever-arm" => &[COLOMINA, CRAMER],
        "image-fourier" => &[TANG],
        "image-grid" => &[DE_BOOR, MUNJY],
        "map-scale" => &[RESSL],
        "pp-image" => &[MONIWA],
        "pp-time" => &[DAAKIR, SMITH],
        "radial-high" => &[BROWN_1971],
        "refraction" => &[SAASTAMOINEN],
        "rolling-shutter" => &[VAUTHERIN],
        "unflatness" => &[FRASER],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::catalogue;

    #[test]
    fn every_published_source_has_its_reference() {
        let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cpp/effects");
        for effect in catalogue() {
            let id = effect.descriptor().id.to_string();
            let header = std::fs::read_to_string(dir.join(format!("{id}.h"))).expect("a header");
            let source = header.split("* source =").nth(1).and_then(|rest| rest.split(";\n").next()).expect("a source");
            let source = format!("{source} {}", effect.descriptor().source);
            for reference in of(&id) {
                let author = reference.authors.split(',').next().expect("an author");
                let plain = author.replace('ö', "oe").replace('á', "a");
                assert!(source.contains(&plain), "{id}: {source} does not name {plain}");
            }
            let has_year = |word: &str| {
                word.len() == 4 && (word.starts_with("19") || word.starts_with("20")) && word.parse::<u16>().is_ok()
            };
            let names_a_year = source.split(|c: char| !c.is_ascii_alphanumeric()).any(has_year);
            assert!(!of(&id).is_empty() || !names_a_year, "{id}: {source}");
        }
    }

    #[test]
    fn a_reference_is_one_line_with_its_doi() {
        let line = FRASER.to_string();
        assert!(line.starts_with("Fraser, C. S. (1997): Digital camera self-calibration. ISPRS Journal"), "{line}");
        assert!(line.ends_with("https://doi.org/10.1016/S0924-2716(97)00005-1"), "{line}");
    }
}
