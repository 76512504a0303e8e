//! What was set aside speaks: a point or an image of which little is left, or a large share of everything, is a
//! finding with a name.

pub use super::survey::Count;
use super::{Mistake, words};

impl Count {
    /// Is more set aside than is left?
    fn mostly(&self) -> bool {
        2 * self.aside > self.all
    }

    /// Bound on the probability (its logarithm) that outliers of a share `p` fall on so many of these measurements
    /// (Chernoff 1952).
    fn ln_chance(&self, p: f64) -> f64 {
        let share = self.aside as f64 / self.all as f64;
        let term = |share: f64, p: f64| if share > 0.0 { share * (share / p).ln() } else { 0.0 };
        -(self.all as f64) * (term(share, p) + term(1.0 - share, 1.0 - p))
    }
}

/// Share of all measurements beyond which the rest is a choice: matching by machine leaves one or two false in a
/// hundred, five in a bad one.
pub const SHARE: f64 = 0.1;

/// Measurements of an image below which nothing is said of it: twice what orients it. Of fewer, those that are left fit
/// anything, and the others have no independent witness.
const FEWEST_OF_IMAGE: usize = 6;

/// What was set aside of a block.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SetAside {
    /// Of control points: marks.
    pub control: Vec<Count>,
    /// Of images: measurements of tie points.
    pub images: Vec<Count>,
    /// Of everything.
    pub all: Count,
}

/// Names what was set aside as a whole. `named`: names that a mistake explains already. An image of few measurements
/// may lose most of them to false matches; a control point that is lost is missing whatever the reason.
pub fn judge(counts: &SetAside, named: &[String], alpha: f64) -> Vec<Mistake> {
    let lost = |list: &[Count]| -> Vec<Count> {
        list.iter().filter(|count| count.mostly() && !named.contains(&count.name)).cloned().collect()
    };
    let mut found = Vec::new();
    let (points, mut images) = (lost(&counts.control), lost(&counts.images));
    let usual = (counts.all.aside as f64 + 1.0) / (counts.all.all as f64 + 2.0);
    let level = (alpha / counts.images.len().max(1) as f64).ln();
    images.retain(|image| image.all >= FEWEST_OF_IMAGE && image.ln_chance(usual) < level);
    if !points.is_empty() {
        found.push(words::points_set_aside(&points, counts.control.len()));
    }
    if !images.is_empty() {
        found.push(words::images_set_aside(&images));
    }
    if counts.all.aside as f64 > SHARE * counts.all.all as f64 {
        found.push(words::share_set_aside(&counts.all));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(name: &str, aside: usize, all: usize) -> Count {
        Count { name: name.into(), aside, all }
    }

    #[test]
    fn a_point_of_which_little_is_left_is_named_and_a_few_outliers_are_not() {
        let counts = SetAside {
            control: vec![count("a", 8, 9), count("b", 1, 9), count("c", 7, 7)],
            images: vec![count("i", 3, 80), count("few", 2, 3)],
            all: count("", 20, 1000),
        };
        let found = judge(&counts, &["c".to_string()], 1e-3);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].kind.as_str(), found[0].names.as_slice()), ("set-aside", &["a".to_string()][..]));
        assert!(judge(&SetAside { all: count("", 101, 1000), ..SetAside::default() }, &[], 1e-3).len() == 1);
        assert!(judge(&SetAside::default(), &[], 1e-3).is_empty());
        let thin = |aside, all| SetAside {
            images: vec![count("thin", aside, all)],
            all: count("", aside, 100_000),
            ..SetAside::default()
        };
        assert_eq!(judge(&thin(2, 3), &[], 1e-3), [], "three rays orient an image, whatever they are");
        assert_eq!(judge(&thin(5, 6), &[], 1e-3).len(), 1);
    }
}
