//! Tie points: multiple ones (`PMul*.txt`, `.dat`), and pairs (`Homol*/Pastis<Image1>/<Image2>.txt`, `.dat`).
//!
//! ```text
//! PMul     BeginHeader-MicMacTiePointFormat / ... / EndHeader
//!          attributes   images   name=0 / name=1 / ...   configurations
//!          of each: points   images   their numbers   of each point: x y in every image, then the attributes
//! pairs    .txt: x1 y1 x2 y2 [weight];   .dat: 2   pairs   of each: 2   weight   x1 y1 x2 y2
//! ```
//!
//! As text a number is a word; in binary files counts are 32-bit and numbers 64-bit, little endian, names stay lines.
//! Source: MicMac, `MultTieP.cpp` and `phgr_basic.cpp`.

use super::super::super::error::{Error, Place};
use super::super::text::Lines;
use super::super::tracks::{Feature, Matches, Tracks};
use super::super::{HALF_PIXEL, refuse};
use crate::block::ImageId;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const HEADER: &str = "BeginHeader-MicMacTiePointFormat";
const HEADER_END: &str = "EndHeader";

/// Words of a text, or numbers of a binary file.
enum Input<'a> {
    Text { lines: Lines, words: std::vec::IntoIter<String> },
    Binary { path: &'a Path, bytes: Vec<u8>, position: usize },
}

impl<'a> Input<'a> {
    fn open(path: &'a Path) -> Result<Self, Error> {
        if path.extension().is_some_and(|extension| extension == "dat") {
            let bytes = crate::files::read(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
            return Ok(Self::Binary { path, bytes, position: 0 });
        }
        Ok(Self::Text { lines: Lines::open(path)?, words: Vec::new().into_iter() })
    }

    /// A whole line.
    fn line(&mut self, what: &str) -> Result<String, Error> {
        match self {
            Self::Text { lines, .. } => Ok(lines.expect_words(what)?.text().trim().to_owned()),
            Self::Binary { path, bytes, position } => {
                let rest = bytes.get(*position..).unwrap_or_default();
                let end = rest.iter().position(|byte| *byte == b'\n').ok_or_else(|| ends(path, what))?;
                let line = std::str::from_utf8(&rest[..end]).map_err(|_| refuse(path, format!("{what}: no UTF-8")))?;
                *position += end + 1;
                Ok(line.trim().to_owned())
            }
        }
    }

    fn word(lines: &mut Lines, words: &mut std::vec::IntoIter<String>, what: &str) -> Result<String, Error> {
        loop {
            if let Some(word) = words.next() {
                return Ok(word);
            }
            let line = lines.expect_words(what)?;
            *words = line.text().split_whitespace().map(str::to_owned).collect::<Vec<_>>().into_iter();
        }
    }

    fn count(&mut self, what: &str) -> Result<usize, Error> {
        match self {
            Self::Text { lines, words } => {
                let word = Self::word(lines, words, what)?;
                word.parse::<u32>()
                    .map(|count| count as usize)
                    .map_err(|_| lines.refuse(format!("{what}: expected a whole number, found {word:?}")))
            }
            Self::Binary { path, bytes, position } => {
                let number = bytes.get(*position..*position + 4).and_then(|four| <[u8; 4]>::try_from(four).ok());
                *position += 4;
                number.map(|four| u32::from_le_bytes(four) as usize).ok_or_else(|| ends(path, what))
            }
        }
    }

    fn number(&mut self, what: &str) -> Result<f64, Error> {
        let (number, found) = match self {
            Self::Text { lines, words } => {
                let word = Self::word(lines, words, what)?;
                (word.parse().unwrap_or(f64::NAN), word)
            }
            Self::Binary { path, bytes, position } => {
                let number = bytes.get(*position..*position + 8).and_then(|eight| <[u8; 8]>::try_from(eight).ok());
                *position += 8;
                let number = number.map(f64::from_le_bytes).ok_or_else(|| ends(path, what))?;
                (number, number.to_string())
            }
        };
        if number.is_finite() {
            Ok(number)
        } else {
            Err(self.refuse(format!("{what}: expected a number, found {found:?}")))
        }
    }

    /// An image point from the outer corner of the top-left pixel.
    fn place(&mut self, what: &str) -> Result<[f64; 2], Error> {
        Ok([self.number(what)? + HALF_PIXEL, self.number(what)? + HALF_PIXEL])
    }

    fn is_at_end(&mut self) -> Result<bool, Error> {
        match self {
            Self::Text { lines, words } => Ok(words.as_slice().is_empty() && lines.next_words()?.is_none()),
            Self::Binary { bytes, position, .. } => Ok(*position >= bytes.len()),
        }
    }

    fn refuse(&self, problem: String) -> Error {
        match self {
            Self::Text { lines, .. } => lines.refuse(problem),
            Self::Binary { path, position, .. } => {
                Error::content(path.display().to_string(), Place::File, format!("before byte {position}: {problem}"))
            }
        }
    }
}

fn ends(path: &Path, what: &str) -> Error {
    refuse(path, format!("the file ends where {what} should stand"))
}

/// Reads multiple tie points; gives the names of images that are not among `images`.
pub(super) fn multiple(
    path: &Path,
    images: &HashMap<&str, ImageId>,
    tracks: &mut Tracks,
    number: &mut usize,
) -> Result<Vec<String>, Error> {
    let mut input = Input::open(path)?;
    let first = input.line(HEADER)?;
    if first != HEADER {
        return Err(input.refuse(format!("expected {HEADER}, found {first:?}")));
    }
    while input.line(HEADER_END)? != HEADER_END {}
    let attributes = input.count("the number of attributes")?;
    let count = input.count("the number of images")?;
    let (mut known, mut strange) = (Vec::new(), Vec::new());
    for expected in 0..count {
        let line = input.line("name=number of an image")?;
        let (name, id) = line.rsplit_once('=').unwrap_or((&line, ""));
        if id.trim().parse() != Ok(expected) {
            return Err(input.refuse(format!("expected name={expected} of an image, found {line:?}")));
        }
        known.push(images.get(name).copied());
        if known[expected].is_none() {
            strange.push(name.to_owned());
        }
    }
    for _ in 0..input.count("the number of configurations")? {
        let points = input.count("the number of points")?;
        let seen = input.count("the number of images of a configuration")?;
        if seen < 2 {
            return Err(input.refuse(format!("expected a configuration of two images or more, found {seen}")));
        }
        let mut own = Vec::new();
        for _ in 0..seen {
            let id = input.count("the number of an image")?;
            let image = known.get(id).ok_or_else(|| input.refuse(format!("there is no image {id}")))?;
            own.push(*image);
        }
        for _ in 0..points {
            *number += 1;
            let point = tracks.point(number.to_string(), None);
            for image in &own {
                let xy = input.place("a coordinate")?;
                if let Some(image) = image {
                    tracks.measure(*image, point, xy);
                }
            }
            for _ in 0..attributes {
                input.number("an attribute")?;
            }
        }
    }
    Ok(strange)
}

/// Reads the pairs of a folder `Homol*`. Each pair of images stands there twice, once from each side; one is enough.
pub(super) fn pairs(
    folder: &Path,
    images: &HashMap<&str, ImageId>,
    matches: &mut Matches,
) -> Result<Vec<String>, Error> {
    let mut strange = Vec::new();
    for first in sorted(folder)? {
        let Some(name) = file_name(&first).and_then(|name| name.strip_prefix("Pastis").map(str::to_owned)) else {
            continue;
        };
        for second in sorted(&first)? {
            let Some(other) = second.file_stem().and_then(|stem| stem.to_str()) else { continue };
            let is_pair = second.extension().is_some_and(|extension| extension == "txt" || extension == "dat");
            if !is_pair {
                continue;
            }
            match (images.get(name.as_str()), images.get(other)) {
                (Some(a), Some(b)) => pair(&second, *a, *b, matches)?,
                (None, _) => strange.push(name.clone()),
                (_, None) => strange.push(other.to_owned()),
            }
        }
    }
    strange.sort();
    strange.dedup();
    Ok(strange)
}

fn pair(path: &Path, a: ImageId, b: ImageId, matches: &mut Matches) -> Result<(), Error> {
    let mut add = |[x, y]: [f64; 2], [u, v]: [f64; 2]| {
        matches.pair(Feature { image: a, xy: [x, y] }, Feature { image: b, xy: [u, v] });
    };
    if path.extension().is_some_and(|extension| extension == "txt") {
        let mut lines = Lines::open(path)?;
        while let Some(mut line) = lines.next_words()? {
            let [x, y, u, v] = line.numbers("x1 y1 x2 y2")?.map(|value: f64| value + HALF_PIXEL);
            add([x, y], [u, v]);
        }
        return Ok(());
    }
    let mut input = Input::open(path)?;
    let expect_two = |input: &mut Input<'_>, what: &str| match input.count(what)? {
        2 => Ok(()),
        other => Err(input.refuse(format!("{what}: expected 2, found {other}"))),
    };
    expect_two(&mut input, "the number of images")?;
    for _ in 0..input.count("the number of pairs")? {
        expect_two(&mut input, "the number of points of a pair")?;
        input.number("a weight")?;
        add(input.place("a coordinate")?, input.place("a coordinate")?);
    }
    match input.is_at_end()? {
        true => Ok(()),
        false => Err(input.refuse("expected the end of the file".into())),
    }
}

/// What is in a folder, by name.
pub(super) fn sorted(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = |source| Error::Read { path: folder.to_owned(), source };
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>().map_err(failed)?;
    paths.sort();
    Ok(paths)
}

pub(super) fn file_name(path: &Path) -> Option<&str> {
    path.file_name().and_then(|name| name.to_str())
}
