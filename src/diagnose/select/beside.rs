//! The system beside what is in. Of hundreds of columns it is dear, and asked for again and again: what may be asked
//! for once more is kept.

use super::Situation;
use crate::score::pivoted::Pivoted;
use crate::score::{Penalised, System};
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The system beside what is in.
#[derive(Debug, Clone)]
pub struct Beside {
    /// Beside the chance values that are in, where there are any.
    pub(super) chance: Option<Arc<System>>,
    /// The laws that are in, beside these.
    pub(super) laws: Arc<Pivoted>,
    all: System,
}

impl Beside {
    /// The system itself.
    pub fn into_system(self) -> System {
        self.all
    }
}

impl Deref for Beside {
    type Target = System;

    fn deref(&self) -> &System {
        &self.all
    }
}

/// Columns of the laws that are in, and chance values that are.
type In = (Vec<Vec<usize>>, Vec<Penalised>);

/// What is known of one system.
#[derive(Debug, Default)]
pub struct Known {
    /// Beside chance values: beside each of them, different laws are asked for.
    chance: Mutex<Vec<(Vec<Penalised>, Arc<System>)>>,
    /// What was asked for last.
    last: Mutex<Option<(In, Beside)>>,
}

impl Situation<'_> {
    /// The system beside everything that is in.
    pub fn beside(&self) -> Beside {
        let parts = self.parts_in();
        if let Some((of, beside)) = &*locked(&self.known.last)
            && *of == parts
        {
            return beside.clone();
        }
        let (fixed, random) = &parts;
        let chance = (!random.is_empty()).then(|| self.beside_chance(random));
        let within = chance.as_deref().unwrap_or(self.system);
        let laws = within.pivoted_in_turn(fixed);
        let all = within.clone().beside_laws(fixed, &laws);
        let beside = Beside { chance, laws: Arc::new(laws), all };
        *locked(&self.known.last) = Some((parts, beside.clone()));
        beside
    }

    fn beside_chance(&self, values: &[Penalised]) -> Arc<System> {
        let find = |known: &[(Vec<Penalised>, Arc<System>)]| {
            known.iter().find(|(of, _)| of == values).map(|(_, system)| system.clone())
        };
        if let Some(system) = find(&locked(&self.known.chance)) {
            return system;
        }
        // Not while others wait: whoever computes in a pool may be given another question meanwhile.
        let system = Arc::new(self.system.beside::<Vec<usize>>(&[], values));
        let mut known = locked(&self.known.chance);
        find(&known).unwrap_or_else(|| {
            known.push((values.to_vec(), system.clone()));
            system
        })
    }
}

/// Whoever panicked within left at most one entry fewer.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
