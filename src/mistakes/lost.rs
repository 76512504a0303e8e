//! Control points that an adjustment lost: where their marks meet against where they were recorded.
//!
//! The adjustment has the effects of the block in it, so that much smaller mistakes show than beside a free network.

use super::survey::Subject;
use super::{Mistake, ln_p, words};
use crate::math::statistics::chi_square_quantile;
use nalgebra::Vector3;

/// A control point whose marks were set aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Lost {
    /// Name.
    pub name: String,
    /// As recorded, m.
    pub recorded: Vector3<f64>,
    /// Where its marks meet, m.
    pub computed: Vector3<f64>,
    /// Standard deviations of the difference of a right one, m.
    pub deviation: Vector3<f64>,
}

impl Lost {
    fn square(&self, recorded: &Vector3<f64>) -> f64 {
        (recorded - self.computed).component_div(&self.deviation).norm_squared()
    }
}

/// What is wrong with them: exchanged, one coordinate, or all.
pub fn judge(points: &[Lost], alpha: f64) -> Vec<Mistake> {
    let fits = chi_square_quantile(1.0 - alpha / points.len().max(1) as f64, 3.0);
    let mut found = Vec::new();
    let mut named = vec![false; points.len()];
    for (i, one) in points.iter().enumerate() {
        for (j, other) in points.iter().enumerate().skip(i + 1) {
            let crossed = [one.square(&other.recorded), other.square(&one.recorded)];
            if !named[i] && !named[j] && crossed.iter().all(|square| *square <= fits) {
                let drop = one.square(&one.recorded) + other.square(&other.recorded) - crossed[0] - crossed[1];
                let pairs = points.len() * (points.len() - 1) / 2;
                found.push(words::exchanged(Subject::Control, [&one.name, &other.name], drop, ln_p(drop, pairs)));
                (named[i], named[j]) = (true, true);
            }
        }
    }
    for (point, _) in
        points.iter().zip(&named).filter(|(point, named)| !**named && point.square(&point.recorded) > fits)
    {
        found.push(alone(point, fits));
    }
    found
}

fn alone(point: &Lost, fits: f64) -> Mistake {
    let misfit = point.recorded - point.computed;
    let in_deviations = misfit.component_div(&point.deviation);
    let axis = in_deviations.iamax();
    let mut others = in_deviations;
    others[axis] = 0.0;
    let drop = in_deviations.norm_squared();
    let ln_p = ln_p(drop, 1);
    match others.norm_squared() <= fits {
        true => {
            let (value, sigma) = (misfit[axis], point.deviation[axis]);
            words::wrong_coordinate(Subject::Control, &point.name, axis, value, sigma, drop, ln_p)
        }
        false => words::wrong_position(Subject::Control, &point.name, &misfit, drop, ln_p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(name: &str, recorded: [f64; 3], computed: [f64; 3]) -> Lost {
        let deviation = Vector3::new(0.01, 0.01, 0.02);
        Lost { name: name.into(), recorded: recorded.into(), computed: computed.into(), deviation }
    }

    #[test]
    fn one_coordinate_all_or_exchanged() {
        let points = [
            lost("a", [10.0, 20.0, 5.0], [40.0, 20.01, 6.0]),
            lost("b", [40.0, 20.0, 6.0], [10.0, 20.0, 5.01]),
            lost("c", [1.0, 2.0, 3.3], [1.0, 2.0, 3.0]),
            lost("d", [1.0, 2.0, 3.0], [1.5, 2.4, 2.0]),
        ];
        let found = judge(&points, 1e-3);
        let kinds: Vec<&str> = found.iter().map(|mistake| mistake.kind.as_str()).collect();
        assert_eq!(kinds, ["exchanged", "wrong-coordinate", "wrong-position"]);
        assert!((found[1].value.expect("a size") - 0.3).abs() < 1e-9);
        assert!(judge(&[lost("e", [0.0, 0.0, 0.02], [0.0; 3])], 1e-3).is_empty());
    }
}
