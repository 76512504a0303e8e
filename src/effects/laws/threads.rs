//! Purity under threads: what an effect gives to one caller does not depend on others.

use super::sample::evaluate;
use super::{Sample, Violation, samples, violation};
use crate::effects::Effect;

/// Callers at the same time.
const THREADS: usize = 4;
/// Times that each of them goes through all places.
const ROUNDS: usize = 5;

/// Purity under threads: several callers at once get, bit for bit, what one gets alone.
pub fn threads(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let places = samples(effect, seed);
    let alone: Vec<_> = places.iter().map(|place| bits(effect, place)).collect();
    let differs = |first: usize| {
        // Each begins elsewhere, so that different places are asked for at the same time.
        let order = (0..ROUNDS * places.len()).map(|k| (k + first * places.len() / THREADS) % places.len());
        order.into_iter().find(|k| bits(effect, &places[*k]) != alone[*k])
    };
    let found = std::thread::scope(|scope| {
        let callers: Vec<_> = (0..THREADS).map(|first| scope.spawn(move || differs(first))).collect();
        // A caller that panicked met an effect that panics: the other laws say so.
        callers.into_iter().find_map(|caller| caller.join().ok().flatten())
    });
    match found {
        Some(k) => {
            let detail = format!("several callers at once get something else than one alone, at {}", places[k]);
            Err(violation(effect, "threads", detail))
        }
        None => Ok(()),
    }
}

/// Output and derivatives as bits; `None` outside the domain.
fn bits(effect: &dyn Effect, place: &Sample) -> Option<Vec<u64>> {
    let found = evaluate(effect, place).ok()?;
    let all = found.out.iter().chain(&found.d_input).chain(&found.d_theta);
    Some(all.map(|value| value.to_bits()).collect())
}
