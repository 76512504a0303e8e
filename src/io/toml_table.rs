//! A TOML table that is being read: every key is known, every value has the type that is expected, every fault has a
//! place.

use super::error::{Error, Place, SHOWN_CHARACTERS, advice, shown};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text of a TOML file, and its name in messages.
pub(crate) struct Source {
    file: String,
    text: String,
}

impl Source {
    /// Reads a file that must be there; `missing` says what it is for.
    pub(crate) fn read(path: &Path, file: impl Into<String>, missing: &str) -> Result<Self, Error> {
        let file = file.into();
        let bytes = match crate::files::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Err(Error::content(file, Place::File, format!("the file is missing; {missing}")));
            }
            Err(source) => return Err(Error::Read { path: path.to_owned(), source }),
        };
        match String::from_utf8(bytes) {
            // Some editors begin a file with a byte order mark; it is no part of the text.
            Ok(text) => Ok(Self { file, text: text.trim_start_matches('\u{feff}').to_owned() }),
            Err(error) => {
                let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
                let line = 1 + valid.iter().filter(|byte| **byte == b'\n').count() as u64;
                Err(Error::content(file, Place::Line(line), "the text is not UTF-8; save the file as UTF-8"))
            }
        }
    }

    /// The document's root table.
    pub(crate) fn parse(&self) -> Result<Spanned<DeTable<'_>>, Error> {
        DeTable::parse(&self.text).map_err(|error| {
            let place = error.span().map_or(Place::File, |span| self.place(span.start));
            Error::content(&self.file, place, format!("not TOML: {}", error.message().replace('\n', ", ")))
        })
    }

    /// Something at a byte of the text is wrong.
    pub(crate) fn refuse(&self, span: &Range<usize>, problem: impl Into<String>) -> Error {
        Error::content(&self.file, self.place(span.start), problem)
    }

    fn place(&self, byte: usize) -> Place {
        let before = self.text.get(..byte).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        let line = 1 + before.bytes().filter(|byte| *byte == b'\n').count() as u64;
        Place::Character(line, 1 + before[line_start..].chars().count() as u64)
    }
}

/// A text and its place.
pub(crate) type Placed<'a> = (&'a str, Range<usize>);

/// A table of which every key is known.
#[derive(Clone, Copy)]
pub(crate) struct Table<'a> {
    source: &'a Source,
    /// The table in messages: `the file`, `[sigma]`.
    name: &'a str,
    entries: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    /// The table `name`; a key that is not among `known` is refused.
    pub(crate) fn new(
        source: &'a Source,
        name: &'a str,
        entries: &'a DeTable<'a>,
        known: &[&str],
    ) -> Result<Self, Error> {
        let unknown = entries.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        if let Some(key) = unknown.min_by_key(|key| key.span().start) {
            let text = key.get_ref();
            let problem = format!("unknown key {} in {name}; {}", shown(text.as_bytes()), advice(text, known));
            return Err(source.refuse(&key.span(), problem));
        }
        Ok(Self { source, name, entries })
    }

    /// A table whose keys are names of the user's.
    pub(crate) fn of_names(source: &'a Source, name: &'a str, entries: &'a DeTable<'a>) -> Self {
        Self { source, name, entries }
    }

    /// Keys and their places, in the file's order.
    pub(crate) fn keys(&self) -> Vec<Placed<'a>> {
        let mut keys: Vec<_> = self.entries.keys().map(|key| (key.get_ref().as_ref(), key.span())).collect();
        keys.sort_by_key(|(_, span)| span.start);
        keys
    }

    /// The value of a key, if it is there.
    pub(crate) fn value(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.entries.iter().find(|(other, _)| other.get_ref() == key).map(|(_, value)| value)
    }

    /// A value that must be there; `whole` is the place of the table.
    pub(crate) fn required<T>(&self, key: &str, whole: &Range<usize>, value: Option<T>) -> Result<T, Error> {
        value.ok_or_else(|| self.source.refuse(whole, format!("key {key} is missing in {}", self.name)))
    }

    /// The value of a key is not what was expected.
    pub(crate) fn refuse(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: &str) -> Error {
        let text = self.source.text.get(value.span()).unwrap_or_default();
        let found: String = text.lines().next().unwrap_or_default().chars().take(SHOWN_CHARACTERS).collect();
        self.source.refuse(&value.span(), format!("key {key}: expected {expected}, found {found}"))
    }

    /// A text.
    pub(crate) fn text(&self, key: &str) -> Result<Option<&'a str>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some(text.as_ref())),
            _ => Err(self.refuse(key, value, "a text in quotes")),
        }
    }

    /// A finite number, integer or not.
    pub(crate) fn number(&self, key: &str) -> Result<Option<f64>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let parsed: Option<f64> = match value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().parse().ok(),
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        };
        match parsed {
            Some(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(self.refuse(key, value, "a finite number")),
        }
    }

    /// A number above zero.
    pub(crate) fn positive(&self, key: &str) -> Result<Option<f64>, Error> {
        match (self.number(key)?, self.value(key)) {
            (Some(number), Some(value)) if number <= 0.0 => Err(self.refuse(key, value, "a number above zero")),
            (number, _) => Ok(number),
        }
    }

    /// A whole number above zero.
    pub(crate) fn count(&self, key: &str) -> Result<Option<u32>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let parsed = match value.get_ref() {
            DeValue::Integer(number) => u32::from_str_radix(number.as_str(), number.radix()).ok(),
            _ => None,
        };
        match parsed {
            Some(number) if number > 0 => Ok(Some(number)),
            _ => Err(self.refuse(key, value, "a whole number above zero")),
        }
    }

    /// The elements of an array, none when the key is absent.
    pub(crate) fn array(&self, key: &str, expected: &str) -> Result<Option<&'a [Spanned<DeValue<'a>>]>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Array(elements) => Ok(Some(elements)),
            _ => Err(self.refuse(key, value, expected)),
        }
    }

    /// The texts of an array, with their places.
    pub(crate) fn texts(&self, key: &str) -> Result<Option<Vec<Placed<'a>>>, Error> {
        let Some(elements) = self.array(key, "a list of texts")? else { return Ok(None) };
        let text = |element: &'a Spanned<DeValue<'a>>| match element.get_ref() {
            DeValue::String(text) => Ok((text.as_ref(), element.span())),
            _ => Err(self.refuse(key, element, "a text in quotes")),
        };
        elements.iter().map(text).collect::<Result<_, _>>().map(Some)
    }

    /// A table inside this one, with its place.
    pub(crate) fn table(&self, key: &str) -> Result<Option<(&'a DeTable<'a>, Range<usize>)>, Error> {
        let Some(value) = self.value(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Table(table) => Ok(Some((table, value.span()))),
            _ => Err(self.refuse(key, value, "a table")),
        }
    }

    /// The tables of an array `[[key]]`, with their places.
    pub(crate) fn tables(&self, key: &str) -> Result<Vec<(&'a DeTable<'a>, Range<usize>)>, Error> {
        let expected = format!("tables [[{key}]]");
        let table = |element: &'a Spanned<DeValue<'a>>| match element.get_ref() {
            DeValue::Table(table) => Ok((table, element.span())),
            _ => Err(self.refuse(key, element, &expected)),
        };
        self.array(key, &expected)?.unwrap_or_default().iter().map(table).collect()
    }

    /// Refuses any format number but `expected`.
    pub(crate) fn expect_format(&self, expected: u32, whole: &Range<usize>) -> Result<(), Error> {
        let value = self.required("format", whole, self.value("format"))?;
        match value.get_ref() {
            DeValue::Integer(number) if number.as_str().parse() == Ok(expected) => Ok(()),
            _ => Err(self.refuse("format", value, &format!("{expected}, the one this program reads"))),
        }
    }
}

/// A text as a TOML file holds it, quoted with `"` so that it serves as a key too.
pub(crate) fn quoted(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            control if control.is_control() => quoted.push_str(&format!("\\U{:08X}", u32::from(control))),
            other => quoted.push(other),
        }
    }
    quoted.push('"');
    quoted
}
