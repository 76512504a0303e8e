//! What a transfer between two programs has to say.

use std::fmt;

/// What a note is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Nothing in the files said so.
    Guess,
    /// It was in the files, and is not in what was made of them.
    Loss,
    /// What whoever goes on should know.
    Fact,
    /// For those who ask for everything (`--verbose`).
    Detail,
}

/// One line on a guess, a loss or a fact.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// What it is about.
    pub kind: Kind,
    /// In words.
    pub text: String,
}

impl Note {
    /// A guess.
    pub fn guess(text: impl Into<String>) -> Self {
        Self { kind: Kind::Guess, text: text.into() }
    }

    /// A loss.
    pub fn loss(text: impl Into<String>) -> Self {
        Self { kind: Kind::Loss, text: text.into() }
    }

    /// A fact.
    pub fn fact(text: impl Into<String>) -> Self {
        Self { kind: Kind::Fact, text: text.into() }
    }

    /// A detail.
    pub fn detail(text: impl Into<String>) -> Self {
        Self { kind: Kind::Detail, text: text.into() }
    }
}

impl Kind {
    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Guess => "guess",
            Kind::Loss => "loss",
            Kind::Fact => "fact",
            Kind::Detail => "detail",
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind.name(), self.text)
    }
}
