//! An XML file as a stream of records: elements of chosen names, each with the texts of what it holds. However long the
//! file is, no more than one record of each kind is held.

use super::super::super::error::{Error, Place, shown};
use crate::files::xml::character;
use quick_xml::Reader;
use quick_xml::events::Event;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Depth beyond which no file of this format nests.
const DEEPEST: usize = 100;

/// An element and the texts in it, by the way that leads there: `Pose/Center/x`. What belongs to a record inside is not
/// in it.
pub(super) struct Record {
    /// Name of the element.
    pub name: String,
    depth: usize,
    fields: Vec<(String, String)>,
    file: String,
    /// Where it ends, for messages.
    byte: u64,
}

impl Record {
    /// A text; `None` where it is absent or empty.
    pub(super) fn text(&self, way: &str) -> Option<&str> {
        self.fields
            .iter()
            .find(|(other, _)| other == way)
            .map(|(_, text)| text.as_str())
            .filter(|text| !text.is_empty())
    }

    /// A text that must be there.
    pub(super) fn required(&self, way: &str) -> Result<&str, Error> {
        self.text(way).ok_or_else(|| self.refuse(format!("{} is missing", self.field(way))))
    }

    /// A finite number; `None` where it is absent.
    pub(super) fn number(&self, way: &str) -> Result<Option<f64>, Error> {
        let Some(text) = self.text(way) else { return Ok(None) };
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        let problem = || format!("{}: expected a finite number, found {}", self.field(way), shown(text.as_bytes()));
        number.map(Some).ok_or_else(|| self.refuse(problem()))
    }

    /// Finite numbers that must be there.
    pub(super) fn numbers<const N: usize>(&self, ways: [&str; N]) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for (number, way) in numbers.iter_mut().zip(ways) {
            *number = self.number(way)?.ok_or_else(|| self.refuse(format!("{} is missing", self.field(way))))?;
        }
        Ok(numbers)
    }

    /// Is there anything below a way?
    pub(super) fn has(&self, way: &str) -> bool {
        self.fields.iter().any(|(other, _)| other.starts_with(way))
    }

    /// Refuses the record.
    pub(super) fn refuse(&self, problem: impl Into<String>) -> Error {
        Error::content(&self.file, Place::Byte(self.byte), problem)
    }

    fn field(&self, way: &str) -> String {
        format!("<{}> {way}", self.name)
    }
}

/// A file that is read record by record.
pub(super) struct Records {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    /// Elements that are records.
    names: &'static [&'static str],
    buffer: Vec<u8>,
    /// Names of the open elements.
    open: Vec<String>,
    records: Vec<Record>,
    text: String,
}

impl Records {
    pub(super) fn open(path: &Path, names: &'static [&'static str]) -> Result<Self, Error> {
        let file = super::super::super::open(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        Ok(Self {
            path: path.to_owned(),
            reader: Reader::from_reader(BufReader::new(file)),
            names,
            buffer: Vec::new(),
            open: Vec::new(),
            records: Vec::new(),
            text: String::new(),
        })
    }

    /// The next record that is complete, inner ones before those that hold them; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Record>, Error> {
        loop {
            self.buffer.clear();
            let byte = self.reader.buffer_position();
            let event = self.reader.read_event_into(&mut self.buffer);
            let event = event.map_err(|error| refuse(&self.path, byte, format!("not XML: {error}")))?;
            match event {
                Event::Start(element) => {
                    let name = element.local_name().as_ref().to_owned();
                    if self.open.len() >= DEEPEST {
                        return Err(refuse(&self.path, byte, format!("elements nest more than {DEEPEST} deep")));
                    }
                    if self.names.contains(&name.as_str()) {
                        let (file, depth) = (self.path.display().to_string(), self.open.len() + 1);
                        self.records.push(Record { name: name.clone(), depth, fields: Vec::new(), file, byte });
                    }
                    self.open.push(name);
                    self.text.clear();
                }
                Event::Text(text) => self.text.push_str(&text),
                Event::CData(text) => self.text.push_str(&text),
                Event::GeneralRef(reference) => match character(&reference) {
                    Some(character) => self.text.push(character),
                    None => {
                        let problem = format!("the entity &{}; is not known", &*reference);
                        return Err(refuse(&self.path, byte, problem));
                    }
                },
                Event::End(_) => {
                    let depth = self.open.len();
                    if let Some(mut record) = self.records.pop_if(|record| record.depth == depth) {
                        record.byte = byte;
                        self.open.pop();
                        self.text.clear();
                        return Ok(Some(record));
                    }
                    if let Some(record) = self.records.last_mut() {
                        let text = self.text.trim();
                        if !text.is_empty() {
                            record.fields.push((self.open[record.depth..].join("/"), text.to_owned()));
                        }
                    }
                    self.open.pop();
                    self.text.clear();
                }
                Event::Eof if self.open.is_empty() => return Ok(None),
                Event::Eof => {
                    let problem = format!("the file ends inside of <{}>", self.open.join("> <"));
                    return Err(refuse(&self.path, byte, problem));
                }
                _ => {}
            }
        }
    }
}

fn refuse(path: &Path, byte: u64, problem: String) -> Error {
    Error::content(path.display().to_string(), Place::Byte(byte), problem)
}
