//! The cheapest additions that reach a goal: greedy, then by exchange.

use std::collections::BTreeMap;

/// Some additions, by number in ascending order.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The additions.
    pub chosen: Vec<usize>,
    /// What they cost together.
    pub cost: f64,
    /// What is left to the goals; zero where all are reached.
    pub shortfall: f64,
}

/// Choices from nothing to the goal, each with an addition more, and last the cheapest that was found where the goal is
/// reached.
///
/// In each step the addition joins that brings most for its cost. Then additions leave, and one or two take the place
/// of one or two, as long as the goal stays reached for less.
///
/// # Errors
/// What `shortfall` returns; `choose` calls it once for each set.
pub fn choose<E>(
    costs: &[f64],
    exclude: impl Fn(usize, usize) -> bool,
    mut shortfall: impl FnMut(&[usize]) -> Result<f64, E>,
) -> Result<Vec<Choice>, E> {
    let mut known: BTreeMap<Vec<usize>, f64> = BTreeMap::new();
    let mut choice = |mut chosen: Vec<usize>| -> Result<Choice, E> {
        chosen.sort_unstable();
        let left = match known.get(&chosen) {
            Some(left) => *left,
            None => shortfall(&chosen)?,
        };
        known.insert(chosen.clone(), left);
        // From zero: a sum of nothing would be -0.
        let cost = chosen.iter().fold(0.0, |sum, own| sum + costs[*own]);
        Ok(Choice { cost, shortfall: left, chosen })
    };
    let allowed = |set: &[usize]| {
        let mut pairs = set.iter().enumerate().flat_map(|(k, a)| set[k + 1..].iter().map(move |b| (*a, *b)));
        pairs.all(|(a, b)| !exclude(a, b))
    };
    let mut steps = vec![choice(Vec::new())?];
    while let Some(now) = steps.last().filter(|now| now.shortfall > 0.0).cloned() {
        let mut best: Option<(f64, Choice)> = None;
        for own in (0..costs.len()).filter(|own| !now.chosen.contains(own)) {
            let set = with(&now.chosen, &[], &[own]);
            if !allowed(&set) {
                continue;
            }
            let next = choice(set)?;
            let worth = (now.shortfall - next.shortfall) / costs[own];
            if worth > 0.0 && best.as_ref().is_none_or(|(most, _)| worth > *most) {
                best = Some((worth, next));
            }
        }
        match best {
            Some((_, next)) => steps.push(next),
            None => return Ok(steps),
        }
    }
    let Some(mut best) = steps.last().cloned() else { return Ok(steps) };
    while let Some(cheaper) = exchanged(&best, costs, &allowed, &mut choice)? {
        best = cheaper;
    }
    if steps.last() != Some(&best) {
        steps.push(best);
    }
    Ok(steps)
}

/// The cheapest set that still reaches the goal when at most two additions leave and at most two join.
fn exchanged<E>(
    best: &Choice,
    costs: &[f64],
    allowed: &impl Fn(&[usize]) -> bool,
    choice: &mut impl FnMut(Vec<usize>) -> Result<Choice, E>,
) -> Result<Option<Choice>, E> {
    let joining: Vec<usize> = (0..costs.len()).filter(|own| !best.chosen.contains(own)).collect();
    let mut sets = Vec::new();
    for leave in up_to_two(&best.chosen).into_iter().filter(|leave| !leave.is_empty()) {
        for join in up_to_two(&joining) {
            let set = with(&best.chosen, &leave, &join);
            let cost: f64 = set.iter().map(|own| costs[*own]).sum();
            if cost < best.cost && allowed(&set) {
                sets.push((cost, set));
            }
        }
    }
    // The cheapest first: the first that reaches the goal is the best of all.
    sets.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    for (_, set) in sets {
        let next = choice(set)?;
        if next.shortfall <= 0.0 && next.cost < best.cost {
            return Ok(Some(next));
        }
    }
    Ok(None)
}

fn with(set: &[usize], leave: &[usize], join: &[usize]) -> Vec<usize> {
    set.iter().filter(|own| !leave.contains(own)).chain(join).copied().collect()
}

/// Nothing, every one, and every two.
fn up_to_two(of: &[usize]) -> Vec<Vec<usize>> {
    let pairs = of.iter().enumerate().flat_map(|(k, a)| of[k + 1..].iter().map(|b| vec![*a, *b]));
    std::iter::once(Vec::new()).chain(of.iter().map(|own| vec![*own])).chain(pairs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Additions that each bring information about a size: standard deviations fall with its root.
    struct Cases {
        costs: Vec<f64>,
        information: Vec<f64>,
        wanted: f64,
    }

    impl Cases {
        fn draw(seed: u64) -> Self {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut draw = |from: f64, to: f64| -> f64 { random.random_range(from..to) };
            let costs = (0..7).map(|_| draw(1.0, 20.0)).collect();
            Self { costs, information: (0..7).map(|_| draw(0.2, 4.0)).collect(), wanted: draw(2.0, 8.0) }
        }

        fn shortfall(&self, set: &[usize]) -> f64 {
            let information = 1.0 + set.iter().map(|own| self.information[*own]).sum::<f64>();
            (0.5 * (self.wanted / information).ln()).max(0.0)
        }

        /// The first two stand for each other.
        fn exclude(a: usize, b: usize) -> bool {
            a.max(b) == 1
        }

        fn exhaustive(&self) -> Option<f64> {
            let sets = (0..1usize << self.costs.len())
                .map(|bits| (0..self.costs.len()).filter(|k| bits >> k & 1 == 1).collect());
            let allowed = |set: &Vec<usize>| !(set.contains(&0) && set.contains(&1));
            let reaches = |set: &Vec<usize>| self.shortfall(set) <= 0.0;
            let cost = |set: Vec<usize>| set.iter().map(|own| self.costs[*own]).sum::<f64>();
            sets.filter(allowed).filter(reaches).map(cost).reduce(f64::min)
        }
    }

    #[test]
    fn the_choice_is_that_of_an_exhaustive_search() {
        let (mut same, mut reached) = (0, 0);
        for seed in 0..200 {
            let cases = Cases::draw(seed);
            let steps = choose(&cases.costs, Cases::exclude, |set| Ok::<_, ()>(cases.shortfall(set))).unwrap();
            let last = steps.last().unwrap();
            assert!(!(last.chosen.contains(&0) && last.chosen.contains(&1)), "seed {seed}: {last:?}");
            let Some(least) = cases.exhaustive() else {
                assert!(last.shortfall > 0.0, "seed {seed}");
                continue;
            };
            // A local search may end in a neighbour of the best set: rarely, and hardly dearer.
            assert!(last.shortfall <= 0.0 && last.cost < 1.2 * least + 1e-9, "seed {seed}: {last:?}, {least}");
            (reached, same) = (reached + 1, same + usize::from(last.cost < least + 1e-9));
        }
        assert!(reached > 150 && same as f64 >= 0.95 * f64::from(reached), "{same} of {reached}");
    }
}
