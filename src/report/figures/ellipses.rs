//! Error ellipses in plan, with the standard deviation in height as a stroke.

use super::super::axes::drawable;
use super::super::numbers::significant;
use super::super::sheet::Sheet;
use super::super::style::{BLUE, VERMILLION};
use super::super::svg::Stroke;
use super::plan::{MapFrame, Plan, WIDTH, map_width};
use super::scale_entry;

/// Ellipses more than this are thinned out, with a note: they would hide each other.
const MOST: usize = 250;
/// Half axis on the page that nine of ten points stay below, pixels.
const USUAL: f64 = 12.0;
/// Half axis beyond which an ellipse would hide the others: it is counted in a note, pixels.
const LONGEST: f64 = 30.0;
/// Corners of a drawn ellipse.
const CORNERS: usize = 24;

/// Error ellipses.
#[derive(Debug, Clone, Default)]
pub struct PlanEllipses {
    /// Title.
    pub title: String,
    /// Place X, Y (m), standard deviations in X, Y, Z in `unit`, and the correlation of X and Y.
    pub ellipses: Vec<([f64; 2], [f64; 3], f64)>,
    /// What the coordinates are.
    pub frame: MapFrame,
    /// Unit of the standard deviations.
    pub unit: String,
}

/// Draws error ellipses in plan.
pub fn plan_ellipses(plan: &PlanEllipses) -> String {
    let good: Vec<_> =
        plan.ellipses.iter().filter(|(p, s, r)| p.iter().chain(s).all(|v| drawable(*v)) && r.abs() <= 1.0).collect();
    let width = map_width(good.iter().map(|(p, ..)| *p), WIDTH);
    let mut sheet = Sheet::new(&plan.title, width);
    sheet.left_out(plan.ellipses.len() - good.len(), "not finite");
    let mut sizes: Vec<f64> = good.iter().map(|(_, s, _)| s[0].max(s[1]).max(s[2])).filter(|s| *s > 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    let scale = sizes.get(sizes.len() * 9 / 10).map(|usual| USUAL / usual);
    sheet.legend(&scale.map(|scale| scale_entry(scale, &plan.unit)).into_iter().collect::<Vec<_>>());
    let most = scale.map_or(f64::INFINITY, |scale| LONGEST / scale);
    let all = good.len();
    let good: Vec<_> = good.into_iter().filter(|(_, s, _)| s.iter().all(|s| *s <= most)).collect();
    let Some(map) = Plan::fit(plan.frame, good.iter().map(|(p, ..)| *p), width, sheet.y + 4.0, LONGEST) else {
        return sheet.finish_empty();
    };
    sheet.y = map.draw(&mut sheet.svg);
    let places: Vec<[f64; 2]> = good.iter().map(|(p, ..)| *p).collect();
    let drawn = map.thinned(&places, MOST);
    let scale = scale.unwrap_or(0.0);
    let (mut ellipses, mut heights) = (String::new(), String::new());
    for (at, sigma, r) in drawn.iter().map(|k| good[*k]) {
        let centre = map.px(*at);
        let corners: Vec<[f64; 2]> = outline(*sigma, *r)
            .map(|d| {
                let [x, y] = map.direction(d, scale);
                [centre[0] + x, centre[1] + y]
            })
            .collect();
        for (k, [x, y]) in corners.iter().enumerate() {
            ellipses += &format!("{}{x:.1} {y:.1}", if k == 0 { "M" } else { "L" });
        }
        ellipses += "Z";
        heights += &format!("M{:.1} {:.1}v{:.1}", centre[0], centre[1], -scale * sigma[2]);
    }
    sheet.svg.path(&heights, Stroke::new(VERMILLION, 1.0));
    sheet.svg.path(&ellipses, Stroke::new(BLUE, 1.0));
    if good.len() < all {
        let (larger, most) = (all - good.len(), significant(most, 2));
        sheet.note(format!("Not drawn: {larger} points with a standard deviation above {most} {}.", plan.unit));
    }
    if drawn.len() < good.len() {
        sheet.note(format!(
            "{} of {} points are drawn, evenly spread, so that they stay apart.",
            drawn.len(),
            good.len()
        ));
    }
    sheet.finish()
}

/// Points of the ellipse of 1 sigma: the factor of the covariance times the unit circle.
fn outline([sx, sy, _]: [f64; 3], r: f64) -> impl Iterator<Item = [f64; 2]> {
    let across = sy * (1.0 - r * r).max(0.0).sqrt();
    (0..CORNERS).map(move |k| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / CORNERS as f64).sin_cos();
        [sx * cos, sy * r * cos + across * sin]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_hardly_known_hide_no_others() {
        let mut ellipses: Vec<_> = (0..50).map(|k| ([f64::from(k), f64::from(k % 7)], [2.0, 3.0, 5.0], 0.2)).collect();
        ellipses.push(([3.0, 3.0], [400.0, 2.0, 5.0], 0.0));
        let plan = PlanEllipses { title: "t".into(), ellipses, unit: "mm".into(), ..PlanEllipses::default() };
        let svg = plan_ellipses(&plan);
        assert_eq!(svg.matches('Z').count(), 50, "{svg}");
        assert!(svg.contains("1 points with a standard deviation above"), "{svg}");
    }

    #[test]
    fn an_ellipse_reaches_one_sigma_along_each_axis() {
        let corners: Vec<[f64; 2]> = outline([3.0, 2.0, 9.0], 0.0).collect();
        let reach = |k: usize| corners.iter().map(|c| c[k].abs()).fold(0.0, f64::max);
        assert!((reach(0) - 3.0).abs() < 1e-12 && (reach(1) - 2.0).abs() < 1e-12);
        // Fully correlated: a line.
        assert!(outline([3.0, 2.0, 9.0], 1.0).all(|[x, y]| (2.0 * x - 3.0 * y).abs() < 1e-12));
    }
}
