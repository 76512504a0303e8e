//! Little-endian binary files, read number by number.

use super::super::error::{Error, Place, shown};
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Longest name in a file, bytes.
const LONGEST_NAME: u64 = 1 << 16;

/// An open file.
pub(super) struct Bytes {
    path: PathBuf,
    reader: BufReader<File>,
    position: u64,
}

impl Bytes {
    /// Opens a file.
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let file = super::super::open(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        Ok(Self { path: path.to_owned(), reader: BufReader::new(file), position: 0 })
    }

    /// Refuses what was read last.
    pub(super) fn refuse(&self, problem: impl Into<String>) -> Error {
        Error::content(self.path.display().to_string(), Place::Byte(self.position), problem)
    }

    /// The next bytes; `what` is what they are.
    pub(super) fn bytes<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Error> {
        let mut bytes = [0; N];
        match self.reader.read_exact(&mut bytes) {
            Ok(()) => self.position += N as u64,
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                return Err(self.refuse(format!("the file ends where {what} should stand")));
            }
            Err(source) => return Err(Error::Read { path: self.path.clone(), source }),
        }
        Ok(bytes)
    }

    pub(super) fn u8(&mut self, what: &str) -> Result<u8, Error> {
        Ok(u8::from_le_bytes(self.bytes(what)?))
    }

    pub(super) fn u32(&mut self, what: &str) -> Result<u32, Error> {
        Ok(u32::from_le_bytes(self.bytes(what)?))
    }

    pub(super) fn i32(&mut self, what: &str) -> Result<i32, Error> {
        Ok(i32::from_le_bytes(self.bytes(what)?))
    }

    pub(super) fn u64(&mut self, what: &str) -> Result<u64, Error> {
        Ok(u64::from_le_bytes(self.bytes(what)?))
    }

    /// A finite number.
    pub(super) fn f64(&mut self, what: &str) -> Result<f64, Error> {
        let number = f64::from_le_bytes(self.bytes(what)?);
        if number.is_finite() { Ok(number) } else { Err(self.refuse(format!("{what}: {number} is no finite number"))) }
    }

    /// Finite numbers.
    pub(super) fn f64s<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64(what)?;
        }
        Ok(numbers)
    }

    /// A text that ends with a zero byte.
    pub(super) fn name(&mut self, what: &str) -> Result<String, Error> {
        let mut bytes = Vec::new();
        let mut limited = (&mut self.reader).take(LONGEST_NAME);
        let read = limited.read_until(0, &mut bytes);
        self.position += read.map_err(|source| Error::Read { path: self.path.clone(), source })? as u64;
        if bytes.pop() != Some(0) {
            return Err(self.refuse(format!("{what} does not end")));
        }
        String::from_utf8(bytes)
            .map_err(|error| self.refuse(format!("{what} {} is not UTF-8", shown(error.as_bytes()))))
    }

    /// Refuses whatever is left of the file.
    pub(super) fn end(&mut self) -> Result<(), Error> {
        let left = self.reader.fill_buf().map_err(|source| Error::Read { path: self.path.clone(), source })?;
        if left.is_empty() { Ok(()) } else { Err(self.refuse("the file goes on where it should end")) }
    }
}
