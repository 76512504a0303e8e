//! What a campaign says: how often the diagnosis is right, whether its p-values are, and which factor matters.

mod anova;
mod calibration;
mod confusion;
mod curves;
mod page;
mod power;

pub use anova::{Anova, Source, anova};
pub use calibration::{Calibration, FalseAlarms, QUANTILES, calibration, false_alarms};
pub use confusion::{Confusion, confusion};
pub use curves::{Curve, Reached, curves};
pub use page::{page, tables};
pub use power::{Power, power};

use super::gather::Row;
use super::outcome::Outcome;
use crate::math::statistics::normal_quantile;

/// Factor of repetitions, over which shares are taken.
pub const REPEATED: &str = "seed";

/// Level of an interval of a share.
const COVERED: f64 = 0.95;

/// Finished cases.
fn finished(rows: &[Row]) -> impl Iterator<Item = (&Row, &Outcome)> {
    rows.iter().filter_map(|row| Some((row, row.outcome.as_ref()?)))
}

/// A share of cases with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Cases that count.
    pub hits: usize,
    /// All.
    pub of: usize,
}

impl Share {
    /// Hits among all.
    pub fn value(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// The interval of Wilson (1927), which holds for shares near zero and one, too.
    pub fn interval(self) -> [f64; 2] {
        let (n, p) = (self.of as f64, self.value());
        let z = normal_quantile(0.5 + 0.5 * COVERED);
        let middle = p + z * z / (2.0 * n);
        let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [middle - half, middle + half].map(|end| (end / (1.0 + z * z / n)).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Candidate;
    use super::super::folder::State;
    use super::*;
    use std::collections::BTreeMap;

    /// A finished case of a level: what is there, what was named, the figure `rms`, and a p-value of `gnss-shift`.
    fn row(level: &str, seed: usize, [expected, named]: [&[&str]; 2], rms: f64, p_value: f64) -> Row {
        let owned = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
        let outcome = Outcome {
            verdict: if named.is_empty() { "adequate" } else { "missing" }.into(),
            named: owned(named),
            mistakes: Vec::new(),
            right: expected == named,
            figures: [("rms".to_owned(), rms)].into(),
            candidates: vec![Candidate { effect: "gnss-shift".into(), p_value }],
            estimates: Vec::new(),
        };
        let factors: BTreeMap<String, String> =
            [("level".to_owned(), level.to_owned()), (REPEATED.to_owned(), seed.to_string())].into();
        let expected = owned(expected);
        Row { id: format!("{level}{seed}"), factors, expected, state: State::Done, outcome: Some(outcome) }
    }

    /// Three groups of six: between them 84, within them 68, so that F = 42 / (68 / 15).
    #[test]
    fn an_analysis_of_variance_by_hand() {
        let groups = [("a", [6, 8, 4, 5, 3, 4]), ("b", [8, 12, 9, 11, 6, 8]), ("c", [13, 9, 11, 8, 7, 12])];
        let of_group = |(level, values): &(&str, [i32; 6])| {
            let case = |(seed, value): (usize, &i32)| row(level, seed, [&[], &[]], f64::from(*value), 0.5);
            values.iter().enumerate().map(case).collect::<Vec<_>>()
        };
        let rows: Vec<Row> = groups.iter().flat_map(of_group).collect();
        let found = anova(&rows, "rms").expect("a factor with three levels");
        assert_eq!((found.sources.len(), found.sources[0].dof, found.residual.1), (1, 2, 15), "{found:?}");
        let source = &found.sources[0];
        let numbers = [source.squares, found.residual.0, source.f, found.explained];
        for (own, known) in numbers.into_iter().zip([84.0, 68.0, 42.0 * 15.0 / 68.0, 84.0 / 152.0]) {
            assert!((own - known).abs() < 1e-9, "{found:?}");
        }
        assert!((source.p_value - 0.00240).abs() < 5e-6, "{}", source.p_value);
        assert!((source.means[1].1 - 9.0).abs() < 1e-12, "{:?}", source.means);
        assert!(anova(&rows, "none").is_none());
    }

    #[test]
    fn what_is_named_is_counted_by_level() {
        let there: &[&str] = &["gnss-shift"];
        let rows = [
            row("low", 1, [there, &[]], 0.0, 0.5),
            row("low", 2, [there, &["gnss-drift"]], 0.0, 0.5),
            row("high", 1, [there, there], 0.0, 0.5),
            row("high", 2, [there, &["gnss-drift", "gnss-shift"]], 0.0, 0.5),
            row("none", 1, [&[], &[]], 0.0, 0.5),
        ];
        let found = power(&rows);
        let counts: Vec<[usize; 4]> =
            found.iter().map(|own| [own.seen.of, own.seen.hits, own.named.hits, own.right.hits]).collect();
        assert_eq!(counts, [[2, 1, 0, 0], [2, 2, 2, 1]], "in the order of the plan, without repetitions");
        let said: Vec<(String, usize)> = confusion(&rows).into_iter().map(|own| (own.said, own.count)).collect();
        let of = |name: &str| said.iter().filter(|(own, _)| own == name).map(|(_, count)| count).sum::<usize>();
        assert_eq!([of("nothing"), of("gnss-shift"), of("gnss-drift + gnss-shift")], [2, 1, 1]);
    }

    #[test]
    fn p_values_and_false_alarms_are_those_of_blocks_with_nothing_to_find() {
        let quiet = |k: usize| row("none", k, [&[], &[]], 0.0, (k as f64 + 0.5) / 100.0);
        let mut rows: Vec<Row> = (0..100).map(quiet).collect();
        rows[7] = row("none", 7, [&[], &["gnss-shift"]], 0.0, 0.075);
        rows.push(row("there", 1, [&["gnss-shift"], &["gnss-shift"]], 0.0, 1e-9));
        let found = calibration(&rows);
        assert_eq!(found.len(), 2, "the effect, and one of each block");
        assert_eq!((found[0].count, found[0].below[4]), (100, 0.5));
        assert!((found[0].kolmogorov_smirnov.0 - 0.005).abs() < 1e-12, "{:?}", found[0].kolmogorov_smirnov);
        let alarms = false_alarms(&rows).expect("blocks with nothing to find");
        assert_eq!([alarms.named, alarms.not_adequate].map(|own| (own.hits, own.of)), [(1, 100); 2]);
    }
    /// Newcombe (1998), Statistics in Medicine 17, table I: 81 of 263, and 0 of 20.
    #[test]
    fn an_interval_as_published() {
        let near = |share: Share, expected: [f64; 2]| {
            let found = share.interval();
            assert!(found.iter().zip(expected).all(|(own, known)| (own - known).abs() < 5e-5), "{found:?}");
        };
        near(Share { hits: 81, of: 263 }, [0.2553, 0.3662]);
        near(Share { hits: 0, of: 20 }, [0.0, 0.1611]);
    }
}
