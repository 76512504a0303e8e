//! What a rule asks for.

/// What a rule asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Take a set in.
    Added {
        /// Position of the set.
        set: usize,
    },
    /// Refit the laws that a law of a size that physics does not allow could stand for: it only looks like itself.
    Resembled {
        /// Position of its set.
        set: usize,
    },
    /// Take an effect out.
    Removed {
        /// Its id.
        id: String,
        /// Why, in words.
        why: String,
    },
}
