//! Height errors of the check points, plane and dome, as tests of structure. Descriptive: check points decide nothing.

use super::StructureTest;
use super::check_points::{Heights, PatternTest};
use super::found::Found;

pub(super) fn describe(heights: &Result<Heights, &'static str>, found: &mut Found) {
    let heights = match heights {
        Ok(heights) => heights,
        Err(why) => return ["check-plane", "check-dome"].iter().for_each(|name| found.skip(name, why)),
    };
    let Heights { n, reach_m, plane, dome, .. } = heights;
    let [mean, east, north, height] = heights.coefficients_m.map(|metres| 1e3 * metres);
    let [of_mean, of_east, of_north, of_height] = heights.sigmas_m.map(|metres| 1e3 * metres);
    let of_plane = format!(
        "height errors of {n} check points: mean {mean:.1} mm (sigma under the model {of_mean:.1}). Tilt: \
         {east:.1} mm to the east ({of_east:.1}), {north:.1} mm to the north ({of_north:.1}) over {reach_m:.0} m"
    );
    let of_dome = format!(
        "height errors of {n} check points: dome of {height:.1} mm (sigma under the model {of_height:.1}) \
         from the middle to {reach_m:.0} m"
    );
    let mut push = |against: &'static str, tested: &PatternTest, description: String| {
        let PatternTest { statistic, dof, p_value, ln_p_value } = *tested;
        let family_p_value = p_value;
        found.tests.push(StructureTest {
            against,
            statistic,
            dof,
            p_value,
            ln_p_value,
            family_p_value,
            decides: false,
            description,
        });
    };
    push("check-plane", plane, of_plane);
    push("check-dome", dome, of_dome);
}
