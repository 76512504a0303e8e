//! Glossary of a report, for a reader who does not have the documentation.

use super::html::Page;
use super::pictures::RunFolder;
use crate::effects::literature::{FRASER, of};

const TERMS: [(&str, &str); 18] = [
    ("effect", "a physical cause that moves image points or surveyed coordinates and that the camera model lacks"),
    ("check point", "a surveyed point that takes part in no estimation; it judges the result from outside"),
    ("control point", "a surveyed point whose coordinates and marks take part in the adjustment"),
    ("dX, dY, dZ", "computed minus surveyed; the computed point is intersected from its own marks"),
    ("3D RMS", "root mean square of the lengths of the differences in space; horizontal: of their lengths in plan"),
    (
        "sX, sY, sZ",
        "standard deviation (1 sigma) of dX, dY, dZ from the marks and the survey of the point. It contains no errors \
         that cameras and image orientations have in common",
    ),
    (
        "wX, wY, wZ",
        "standardised value: difference divided by its standard deviation. Beyond 3 or so a point deserves a look; \
         where most are large, errors are common to many points",
    ),
    (
        "typical point",
        "median over the tie points of the standard deviation in space: the root of the summed variances in X, Y and Z \
         (1 sigma, 3D)",
    ),
    ("residual", "observed minus computed image coordinate"),
    ("held-out RMS", "error of predictions of image measurements that were left out of the fit"),
    ("sigma0", "standard deviation of unit weight; 1 where the stated standard deviations fit the residuals"),
    (
        "weighted sum of squares",
        "sum of the squared residuals, each divided by its standard deviation; its drop is what an effect gains",
    ),
    ("statistic", "F of the effect's parameters; z of a random effect: the sum of its squared scores, standardised"),
    ("dof", "degrees of freedom: number of parameters that the test is about"),
    ("p, Sidak", "probability that any of the tests of the catalogue gives a p at least this small by chance"),
    (
        "p",
        "probability that chance alone gives a statistic at least this large; \"< 1e-300\" stands for all smaller ones",
    ),
    (
        "significant",
        "unlikely to be chance among all tests of the catalogue together (family-wise), not in this test alone",
    ),
    ("objective", "-2 ln of the likelihood plus the prices of what was added; zero at the base, lower is better"),
];

/// Literature on the camera model and on the effects that a run has.
pub(super) fn literature(page: &mut Page, run: &RunFolder) {
    let mut references = vec![FRASER];
    let found = run.diagnosis.iter().flat_map(|diagnosis| diagnosis.found.iter().map(|found| found.effect.as_str()));
    for effect in found.chain(run.summary.effects.0.iter().map(|(effect, _)| effect.as_str())) {
        for new in of(effect) {
            if !references.contains(new) {
                references.push(*new);
            }
        }
    }
    references.sort_by_key(|reference| (reference.authors, reference.year));
    page.section("References").list(references.iter().map(ToString::to_string));
}

/// The last section.
pub(super) fn section(page: &mut Page) {
    page.section("Glossary").terms(TERMS);
}
