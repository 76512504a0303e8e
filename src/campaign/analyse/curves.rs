//! Power against size: a curve for each combination of the other factors, and the size from which most are named.

use super::{Power, Share};

/// How often something is named against its size.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What a diagnosis should name.
    pub expected: String,
    /// Names of the levels of the other factors, in the order of their names.
    pub levels: Vec<String>,
    /// Sizes in rising order, each with the share that is named.
    pub points: Vec<(f64, Share)>,
}

/// Curves against the first factor whose levels are numbers, and its name; `None` where no factor is one.
pub fn curves(all: &[Power]) -> Option<(String, Vec<Curve>)> {
    let number = |own: &Power, factor: &str| own.levels.get(factor).and_then(|level| level.parse::<f64>().ok());
    let is_size = |factor: &&String| {
        let levels: Vec<f64> = all.iter().filter_map(|own| number(own, factor)).collect();
        levels.len() == all.len() && levels.iter().any(|level| *level != levels[0])
    };
    let size = all.first()?.levels.keys().find(is_size)?.clone();
    let mut curves: Vec<Curve> = Vec::new();
    for own in all {
        let others = own.levels.iter().filter(|(factor, _)| **factor != size);
        let levels: Vec<String> = others.map(|(_, level)| level.clone()).collect();
        let expected = own.expected.join(" + ");
        let point = (number(own, &size)?, own.named);
        match curves.iter_mut().find(|curve| curve.levels == levels && curve.expected == expected) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { expected, levels, points: vec![point] }),
        }
    }
    curves.iter_mut().for_each(|curve| curve.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    Some((size, curves))
}

/// From which size on a share is reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reached {
    /// The smallest size that was tried reaches it.
    BelowAll,
    /// Between two sizes, by the logarithm of the size.
    At(f64),
    /// The largest size does not reach it.
    BeyondAll,
}

impl Curve {
    /// The size from which `share` is named. Power cannot fall with the size: shares that fall are pooled (isotonic
    /// regression).
    pub fn reaches(&self, share: f64) -> Reached {
        let rising = self.rising();
        let Some(first) = rising.iter().position(|(_, own)| *own >= share) else { return Reached::BeyondAll };
        let Some(before) = first.checked_sub(1) else { return Reached::BelowAll };
        let [(low, below), (high, above)] = [rising[before], rising[first]];
        let part = (share - below) / (above - below);
        match low > 0.0 {
            true => Reached::At((low.ln() + part * (high.ln() - low.ln())).exp()),
            false => Reached::At(low + part * (high - low)),
        }
    }

    /// Sizes and shares, each at least the one before: pools of adjacent violators.
    fn rising(&self) -> Vec<(f64, f64)> {
        let mut pools: Vec<(usize, Share)> = Vec::new();
        for (_, share) in &self.points {
            let mut pool = (1, *share);
            while let Some((sizes, before)) = pools.pop_if(|(_, before)| before.value() > pool.1.value()) {
                pool = (sizes + pool.0, Share { hits: before.hits + pool.1.hits, of: before.of + pool.1.of });
            }
            pools.push(pool);
        }
        let shares = pools.iter().flat_map(|(sizes, share)| std::iter::repeat_n(share.value(), *sizes));
        self.points.iter().map(|(size, _)| *size).zip(shares).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::power::POWER;

    fn curve(shares: &[(f64, usize)]) -> Curve {
        let points = shares.iter().map(|(size, hits)| (*size, Share { hits: *hits, of: 10 })).collect();
        Curve { expected: "gnss-shift".into(), levels: Vec::new(), points }
    }

    #[test]
    fn a_size_between_two_that_were_tried() {
        let Reached::At(size) = curve(&[(1.0, 0), (10.0, 6), (100.0, 10)]).reaches(POWER) else { panic!("between") };
        assert!((size - 10.0 * 10f64.sqrt()).abs() < 1e-9, "half of the way, by the logarithm: {size}");
        assert_eq!(curve(&[(0.0, 0), (2.0, 10)]).reaches(POWER), Reached::At(1.6), "zero has no logarithm");
    }

    #[test]
    fn sizes_that_were_too_small_or_too_large() {
        assert_eq!(curve(&[(1.0, 0), (2.0, 7)]).reaches(POWER), Reached::BeyondAll);
        assert_eq!(curve(&[(1.0, 8), (2.0, 9)]).reaches(POWER), Reached::BelowAll);
    }

    #[test]
    fn shares_that_fall_are_pooled() {
        let fallen = curve(&[(1.0, 0), (2.0, 10), (4.0, 4), (8.0, 10)]);
        assert_eq!(fallen.rising(), [(1.0, 0.0), (2.0, 0.7), (4.0, 0.7), (8.0, 1.0)]);
        let Reached::At(size) = fallen.reaches(POWER) else { panic!("between") };
        assert!((size - 4.0 * 2f64.powf(1.0 / 3.0)).abs() < 1e-9, "{size}");
    }
}
