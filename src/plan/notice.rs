//! Which mistakes of people a planned block would notice, and from which size on.
//!
//! The block is measured once, with errors as it states them. Each mistake is then made in a copy of its files
//! ([`crate::inject::mistakes`]), and the copy is examined as `check` and `diagnose` examine any block. So one random
//! draw decides, and a size near the smallest one may or may not be noticed in the block that is flown.

use super::said::Said;
use crate::block::Block;
use crate::diagnose::run::diagnose;
use crate::diagnose::settings::Settings;
use crate::files::scratch::Scratch;
use crate::inject::{DefaultValue, mistakes};
use crate::io::block::{read_block, write_block};
use crate::model::Model;
use crate::scenario::add_stated_noise;
use crate::screening;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Units of a size: of other parameters, such as the factor of a unit, there is no half.
const SIZED: [&str; 4] = ["m", "deg", "px", "s"];
/// Sizes that are tried, in those of the kind's default: powers of two.
const POWERS: std::ops::RangeInclusive<i32> = -10..=3;

/// A mistake of a kind and subject, and what is said of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noticed {
    /// Kind.
    pub kind: String,
    /// Whose.
    pub subject: String,
    /// The smallest size that is noticed, of those that were tried: powers of two of the default. Of a kind without a
    /// size, and where nothing is noticed, there is none.
    pub size: Option<f64>,
    /// The smallest size that is named as what it is.
    pub named_size: Option<f64>,
    /// Unit of the sizes; empty for a kind without.
    pub unit: String,
    /// What is said at the smallest size that is noticed; of a kind without a size, what is said of it.
    pub said: Said,
}

/// A mistake to be made: its kind, its subject, and its size where it has one.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Kind.
    pub kind: String,
    /// Subject; without one the kind's first that the block has.
    pub subject: Option<String>,
    /// Size and unit.
    pub size: Option<(f64, String)>,
}

/// Why mistakes cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum NoticeError {
    /// The block without any mistake is found fault with.
    #[error("the drawn block has no mistake, yet {0}; another --seed draws another one")]
    Clean(String),
    /// A mistake that cannot be made in this block.
    #[error("`{0}`: {1}")]
    Mistake(String, String),
    /// Files.
    #[error("no temporary files in {0}: {1:#}")]
    Files(PathBuf, anyhow::Error),
}

/// A block that was drawn, as files.
pub struct Drawn<'a> {
    place: Scratch,
    model: &'a Model,
    settings: &'a Settings<'a>,
}

impl<'a> Drawn<'a> {
    /// Draws the errors of `block`, whose measurements are free of them.
    ///
    /// # Errors
    /// Without a place for files; where the drawn block itself is found fault with.
    pub fn of(block: &Block, seed: u64, model: &'a Model, settings: &'a Settings<'a>) -> Result<Self, NoticeError> {
        let parent = std::env::temp_dir();
        let failed = |error: anyhow::Error| NoticeError::Files(parent.clone(), error);
        let drawn = Self { place: Scratch::new_in(&parent).map_err(|error| failed(error.into()))?, model, settings };
        let mut block = block.clone();
        add_stated_noise(&mut block, seed);
        write_block(&block, &drawn.right()).map_err(|error| failed(error.into()))?;
        match drawn.said(&drawn.right(), None, &[]) {
            Said::Nothing => Ok(drawn),
            said => Err(NoticeError::Clean(said.in_words())),
        }
    }

    /// The kinds and subjects that this block can have, by registry.
    pub fn possible(&self) -> Vec<(&'static mistakes::Kind, &'static str)> {
        let all = mistakes::registry().flat_map(|kind| kind.subjects().iter().map(move |subject| (kind, *subject)));
        all.filter(|(kind, subject)| self.made(kind, subject, 1.0).is_ok()).collect()
    }

    /// The smallest sizes of a kind of mistake that are noticed and named.
    ///
    /// # Errors
    /// A mistake that this block cannot have.
    pub fn smallest(&self, kind: &mistakes::Kind, subject: &str) -> Result<Noticed, NoticeError> {
        let noticed = |size, named_size, unit: &str, said| Noticed {
            kind: kind.id().into(),
            subject: subject.into(),
            size,
            named_size,
            unit: unit.into(),
            said,
        };
        let Some((default, unit)) = default_size(kind) else {
            return Ok(noticed(None, None, "", self.judged(kind, subject, 1.0)?));
        };
        let mut known: BTreeMap<i32, Said> = BTreeMap::new();
        let mut said = |power: i32| -> Result<Said, NoticeError> {
            if let Some(said) = known.get(&power) {
                return Ok(said.clone());
            }
            let said = self.judged(kind, subject, 2f64.powi(power))?;
            known.insert(power, said.clone());
            Ok(said)
        };
        let named = smallest_power(|power| Ok(said(power)? == Said::Named))?;
        let least = smallest_power(|power| Ok(said(power)? != Said::Nothing))?;
        let words = least.map_or(Ok(Said::Nothing), said)?;
        let size = |power: Option<i32>| power.map(|power| default * 2f64.powi(power));
        Ok(noticed(size(least), size(named), unit, words))
    }

    /// What is said of a mistake of `size` times its default.
    fn judged(&self, kind: &mistakes::Kind, subject: &str, size: f64) -> Result<Said, NoticeError> {
        (self.settings.tell)(&format!("examining {} of {subject}, {size} times its default", kind.id()));
        let (folder, points) = self.made(kind, subject, size)?;
        Ok(self.said(&folder, Some((kind.id(), subject)), &points))
    }

    /// What is said of a mistake that was asked about.
    ///
    /// # Errors
    /// A mistake that this block cannot have, or whose size has another unit.
    pub fn said_of(&self, asked: &Asked) -> Result<Said, NoticeError> {
        let failed = |why: String| NoticeError::Mistake(asked.to_string(), why);
        let kind = mistakes::find(&asked.kind).ok_or_else(|| failed("no such mistake".into()))?;
        let size = match (&asked.size, default_size(kind)) {
            (None, _) => 1.0,
            (Some((size, unit)), Some((default, own))) if unit == own => size / default,
            (Some(_), Some((_, own))) => return Err(failed(format!("its size is in {own}"))),
            (Some(_), None) => return Err(failed("it has no size".into())),
        };
        let subjects = kind.subjects().iter().copied();
        let wanted = |own: &&str| asked.subject.as_ref().is_none_or(|subject| subject == own);
        let mut why = format!("it concerns {}", kind.subjects().join(", "));
        for subject in subjects.filter(wanted) {
            match self.judged(kind, subject, size) {
                Err(NoticeError::Mistake(_, reason)) => why = reason,
                judged => return judged,
            }
        }
        Err(failed(why))
    }

    fn right(&self) -> PathBuf {
        self.place.path().join("right")
    }

    /// Makes a mistake in a copy: its folder, and the points whose measurements were changed.
    fn made(&self, kind: &mistakes::Kind, subject: &str, size: f64) -> Result<(PathBuf, Vec<String>), NoticeError> {
        let (right, wrong) = (self.right(), self.place.path().join("wrong"));
        let failed = |error: std::io::Error| NoticeError::Files(wrong.clone(), error.into());
        if wrong.exists() {
            fs::remove_dir_all(&wrong).map_err(failed)?;
        }
        fs::create_dir(&wrong).map_err(failed)?;
        for file in mistakes::FILES.iter().filter(|file| right.join(file).exists()) {
            fs::copy(right.join(file), wrong.join(file)).map_err(failed)?;
        }
        let text = text_of(kind, subject, size);
        let impossible = |error: anyhow::Error| NoticeError::Mistake(text.clone(), format!("{error:#}"));
        let mistake = mistakes::parse(&text).map_err(impossible)?;
        let made = mistakes::make(&wrong, &[mistake]).map_err(impossible)?;
        let notes = made.into_iter().flat_map(|made| made.notes);
        let points = notes.filter(|(what, _)| ["point", "a", "b"].contains(&what.as_str())).map(|(_, name)| name);
        Ok((wrong, points.collect()))
    }

    /// What `check` and then `diagnose` say of the files in a folder, with the mistake and the points it changed.
    fn said(&self, folder: &Path, mistake: Option<(&str, &str)>, points: &[String]) -> Said {
        let block = match read_block(folder) {
            Ok(read) => read.block.about_its_centre(),
            Err(error) => return Said::Refused(error.to_string()),
        };
        let Settings { significance, options, .. } = self.settings;
        let found = screening::mistakes(&block, self.model, *significance, options);
        if let Some(said) = Said::of_mistakes(&found, mistake) {
            return said;
        }
        let settings = Settings {
            plugins: self.settings.plugins,
            options: options.clone(),
            snoop: true,
            tell: &|_| {},
            ..*self.settings
        };
        match diagnose(&block, self.model, &settings) {
            Ok(diagnosed) => Said::of_diagnosis(&diagnosed.diagnosis, mistake, points),
            Err(error) => Said::Refused(error.to_string()),
        }
    }
}

impl std::fmt::Display for Asked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.kind)?;
        if let Some(subject) = &self.subject {
            write!(f, ":of={subject}")?;
        }
        self.size.as_ref().map_or(Ok(()), |(size, unit)| write!(f, " {size} {unit}"))
    }
}

/// Size of the default mistake, the root of the sum of squares of its lengths or angles, and its unit.
fn default_size(kind: &mistakes::Kind) -> Option<(f64, &'static str)> {
    let mut sum: Option<(f64, &str)> = None;
    for own in kind.parameters().iter().filter(|own| SIZED.contains(&own.unit)) {
        match own.default {
            DefaultValue::Number(default) if default != 0.0 => {
                sum = Some((sum.map_or(0.0, |(sum, _)| sum) + default * default, own.unit));
            }
            _ => {}
        }
    }
    sum.map(|(sum, unit)| (sum.sqrt(), unit))
}

/// The mistake as `inject` reads it.
fn text_of(kind: &mistakes::Kind, subject: &str, size: f64) -> String {
    let mut values: Vec<String> = Vec::new();
    for own in kind.parameters() {
        match own.default {
            _ if own.name == "of" => values.push(format!("of={subject}")),
            DefaultValue::Number(default) if SIZED.contains(&own.unit) && size != 1.0 => {
                values.push(format!("{}={}", own.name, size * default));
            }
            _ => {}
        }
    }
    format!("{}:{}", kind.id(), values.join(",")).trim_end_matches(':').to_string()
}

/// The smallest of [`POWERS`] from which `holds`, by bisection; `None` where it does not hold at the largest either.
fn smallest_power<E>(mut holds: impl FnMut(i32) -> Result<bool, E>) -> Result<Option<i32>, E> {
    let (mut below, mut above) = (POWERS.start() - 1, *POWERS.end());
    if !holds(above)? {
        return Ok(None);
    }
    while above - below > 1 {
        let middle = (below + above).div_euclid(2);
        match holds(middle)? {
            true => above = middle,
            false => below = middle,
        }
    }
    Ok(Some(above))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_power_that_holds_is_found() {
        for least in POWERS {
            let found = smallest_power(|power| Ok::<_, ()>(power >= least));
            assert_eq!(found, Ok(Some(least)));
        }
        assert_eq!(smallest_power(|_| Ok::<_, ()>(false)), Ok(None));
    }

    #[test]
    fn every_kind_is_asked_for_in_words_that_inject_reads() {
        for kind in mistakes::registry() {
            for subject in kind.subjects() {
                for size in [1.0, 0.25] {
                    let text = text_of(kind, subject, size);
                    let read = mistakes::parse(&text).unwrap_or_else(|error| panic!("{text}: {error:#}"));
                    assert_eq!(read.kind.id(), kind.id());
                }
            }
        }
        let tilt = mistakes::find("tilt").unwrap();
        assert_eq!(
            (text_of(tilt, "gnss", 0.5), default_size(tilt)),
            ("tilt:of=gnss,degrees=0.25".into(), Some((0.5, "deg")))
        );
        // A shift has the length of its parts.
        let (length, unit) = default_size(mistakes::find("plan-offset").unwrap()).unwrap();
        assert!((length - 13f64.sqrt()).abs() < 1e-12 && unit == "m");
        assert_eq!(default_size(mistakes::find("exchanged").unwrap()), None);
    }
}
