//! Mistakes of people, made on purpose: the files of a block are rewritten as a person would do it in a spreadsheet.
//!
//! They come last, after every error and the noise: a person has the measurements already. Nothing here knows the
//! search for mistakes or its edits; a table is text, and a mistake rewrites cells.
//!
//! ```text
//! files of a block ──► tables of text ──► mistake, mistake, ... ──► files of a block
//! ```

mod camera;
mod duplicated;
mod exchanged;
mod files;
mod gnss;
mod group;
mod measurements;
mod members;
mod orientations;
mod records;
mod single;
mod survey;
mod table;
mod tracks;
mod undistorted;

pub use crate::files::OF_BLOCK as FILES;

use super::injection::{assigned, nearest};
use super::parameters::{DefaultValue, ParameterSpec, Values, parameter};
use anyhow::{Context, Result, bail, ensure};
use files::Files;
use std::fmt;
use std::path::Path;

/// What a mistake did, beside its parameters.
type Notes = Vec<(String, String)>;

/// One kind of mistake: its name, its parameters, and how it rewrites files.
pub struct Kind {
    id: &'static str,
    subjects: &'static [&'static str],
    summary: &'static str,
    parameters: &'static [ParameterSpec],
    act: fn(&mut Files, &Values) -> Result<Notes>,
}

impl Kind {
    /// Id on the command line.
    pub fn id(&self) -> &'static str {
        self.id
    }

    /// What it may concern: `control`, `check`, `gnss`, `ties`, `marks`, `images`, `camera`.
    pub fn subjects(&self) -> &'static [&'static str] {
        self.subjects
    }

    /// One sentence for the list of mistakes.
    pub fn summary(&self) -> &'static str {
        self.summary
    }

    /// Parameters, in the order of the list. `of` is the subject, where there are several.
    pub fn parameters(&self) -> &'static [ParameterSpec] {
        self.parameters
    }
}

/// By subject: survey, image measurements, images, orientations, cameras, records.
static REGISTRY: [&[Kind]; 12] = [
    &survey::KINDS,
    &exchanged::KINDS,
    &members::KINDS,
    &gnss::KINDS,
    &measurements::KINDS,
    &undistorted::KINDS,
    &single::KINDS,
    &duplicated::KINDS,
    &tracks::KINDS,
    &orientations::KINDS,
    &camera::KINDS,
    &records::KINDS,
];

/// Every kind of mistake, in the order of the list.
pub fn registry() -> impl Iterator<Item = &'static Kind> {
    REGISTRY.iter().flat_map(|kinds| kinds.iter())
}

/// The kind of an id.
pub fn find(id: &str) -> Option<&'static Kind> {
    registry().find(|kind| kind.id == id)
}

/// A kind of mistake with its parameters.
#[derive(Clone)]
pub struct Mistake {
    /// The kind.
    pub kind: &'static Kind,
    /// Its parameters, defaults filled in.
    pub values: Values,
}

impl fmt::Debug for Mistake {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Mistake").field("kind", &self.kind.id).field("values", &self.values).finish()
    }
}

/// Reads `KIND[:key=value,...]`, `scale:of=gnss,unit=feet` say.
///
/// # Errors
/// An unknown kind (the nearest ones are named), an unknown or repeated key, text that is no value of its type.
pub fn parse(text: &str) -> Result<Mistake> {
    let (id, assignments) = text.split_once(':').unwrap_or((text, ""));
    let Some(kind) = find(id) else {
        let near = nearest(id, registry().map(Kind::id).collect());
        bail!("no mistake is called `{id}`; nearest: {}", near.join(", "));
    };
    let values = assigned(&format!("mistake `{id}`"), kind.parameters, assignments)?;
    Ok(Mistake { kind, values })
}

/// A mistake as it was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Made {
    /// Id of its kind.
    pub kind: &'static str,
    /// Its parameters, as text; those not given and without default are left out.
    pub parameters: Vec<(&'static str, String)>,
    /// What it chose or derived, and how many cells it changed.
    pub notes: Vec<(String, String)>,
}

/// Makes mistakes in the files of the block in `folder`, in their order.
///
/// # Errors
/// A file that cannot be read or written, a parameter out of its range, a block without what a mistake concerns, a
/// mistake that changes nothing. The files may then be partly rewritten.
pub fn make(folder: &Path, mistakes: &[Mistake]) -> Result<Vec<Made>> {
    if mistakes.is_empty() {
        return Ok(Vec::new());
    }
    let mut files = Files::read(folder)?;
    let made = mistakes.iter().map(|mistake| one(&mut files, mistake)).collect::<Result<_>>()?;
    files.write()?;
    Ok(made)
}

fn one(files: &mut Files, Mistake { kind, values }: &Mistake) -> Result<Made> {
    let what = || format!("mistake `{}`", kind.id);
    let before = files.changes();
    let mut notes = (kind.act)(files, values).with_context(what)?;
    let changes = files.changes() - before;
    ensure!(changes > 0, "{}: it changes nothing in this block", what());
    notes.push(("cells changed".into(), changes.to_string()));
    let parameters = values.iter().map(|(name, value)| (name, value.to_string()));
    Ok(Made { kind: kind.id, parameters: parameters.filter(|(_, value)| !value.is_empty()).collect(), notes })
}

/// A note.
fn note(name: &str, value: impl fmt::Display) -> (String, String) {
    (name.into(), value.to_string())
}

#[cfg(test)]
mod tests;
