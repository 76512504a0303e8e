//! Glossary of a report, for a reader who does not have the documentation.

use super::html::Page;

const TERMS: [(&str, &str); 17] = [
    ("effect", "a physical cause that moves image points or surveyed coordinates and that the camera model lacks"),
    ("check point", "a surveyed point that takes part in no estimation; it judges the result from outside"),
    ("control point", "a surveyed point whose coordinates and marks take part in the adjustment"),
    ("dX, dY, dZ", "computed minus surveyed; the computed point is intersected from its own marks"),
    ("3D RMS", "root mean square of the lengths of the differences in space; horizontal: of their lengths in plan"),
    (
        "sX, sY, sZ",
        "standard deviation (1 sigma) of dX, dY, dZ from the marks and the survey of the point; errors that cameras \
         and image orientations have in common are not in it",
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
    (
        "statistic",
        "F of the effect's parameters; of effects with a value per image the standardised sum of squared scores",
    ),
    ("dof", "degrees of freedom: number of parameters that the test is about"),
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

/// The last section.
pub(super) fn section(page: &mut Page) {
    page.section("Glossary").terms(TERMS);
}
