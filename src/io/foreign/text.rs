//! Text files of words and numbers, read line by line: a file is never held as a whole.

use super::super::error::{Error, Place, shown};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// The lines of a text file.
pub struct Lines {
    path: PathBuf,
    /// As messages name it.
    file: String,
    reader: BufReader<File>,
    /// The line that was read last, without its end.
    text: String,
    number: u64,
    /// Where in `text` the next word may begin.
    next: usize,
}

impl Lines {
    /// Opens a file.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = super::super::open(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        Ok(Self {
            path: path.to_owned(),
            file: path.display().to_string(),
            reader: BufReader::new(file),
            text: String::new(),
            number: 0,
            next: 0,
        })
    }

    /// The next line, without its end; `None` after the last.
    ///
    /// # Errors
    /// A file that cannot be read; a line that is no UTF-8.
    pub fn next_line(&mut self) -> Result<Option<Line<'_>>, Error> {
        self.next = 0;
        let mut bytes = std::mem::take(&mut self.text).into_bytes();
        bytes.clear();
        let read = self.reader.read_until(b'\n', &mut bytes);
        if read.map_err(|source| Error::Read { path: self.path.clone(), source })? == 0 {
            return Ok(None);
        }
        self.number += 1;
        let refused = |_| Error::content(&self.file, Place::Line(self.number), "the text is not UTF-8");
        self.text = String::from_utf8(bytes).map_err(refused)?;
        self.text.truncate(self.text.trim_end_matches(['\n', '\r']).len());
        // Some editors begin a file with a byte order mark; it is no part of the text.
        if self.number == 1 && self.text.starts_with('\u{feff}') {
            self.text.remove(0);
        }
        // Whoever takes the line has its words.
        self.next = self.text.len();
        Ok(Some(self.this_line()))
    }

    /// The next line that has a word and does not begin with `#`.
    ///
    /// # Errors
    /// As [`Self::next_line`].
    pub fn next_words(&mut self) -> Result<Option<Line<'_>>, Error> {
        loop {
            match self.next_line()? {
                None => return Ok(None),
                Some(line) if line.is_empty() || line.is_comment() => {}
                // Made anew: the borrow of a line that is given back would last over the loop.
                Some(_) => return Ok(Some(self.this_line())),
            }
        }
    }

    /// [`Self::next_words`], where the file must not end; `what` should stand there.
    ///
    /// # Errors
    /// As [`Self::next_line`], and the end of the file.
    pub fn expect_words(&mut self, what: &str) -> Result<Line<'_>, Error> {
        let end = (self.file.clone(), self.number);
        self.next_words()?.ok_or_else(|| {
            Error::content(end.0, Place::Line(end.1), format!("the file ends where {what} should stand"))
        })
    }

    /// Refuses the line that was read last.
    pub fn refuse(&self, problem: impl Into<String>) -> Error {
        Error::content(&self.file, Place::Line(self.number), problem)
    }

    /// The next word, whatever the lines; `what` should stand there. For files in which line ends mean nothing.
    ///
    /// # Errors
    /// As [`Self::next_line`], and the end of the file.
    pub fn word(&mut self, what: &str) -> Result<&str, Error> {
        while self.text[self.next..].trim_start().is_empty() {
            if self.next_line()?.is_none() {
                return Err(self.refuse(format!("the file ends where {what} should stand")));
            }
            self.next = 0;
        }
        let begin = self.text.len() - self.text[self.next..].trim_start().len();
        let length = self.text[begin..].find(char::is_whitespace).unwrap_or(self.text.len() - begin);
        self.next = begin + length;
        Ok(&self.text[begin..self.next])
    }

    /// The next word as a finite number.
    ///
    /// # Errors
    /// As [`Self::word`], or anything else; `what` is the number.
    pub fn number(&mut self, what: &str) -> Result<f64, Error> {
        let found = self.word(what)?.parse().ok().filter(|number: &f64| number.is_finite());
        found.ok_or_else(|| self.refuse(format!("{what}: expected a finite number")))
    }

    /// The next `N` words as finite numbers.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number(what)?;
        }
        Ok(numbers)
    }

    /// The next word as a whole number below `end`.
    ///
    /// # Errors
    /// As [`Self::word`], or anything else; `what` is the number.
    pub fn whole(&mut self, what: &str, end: u64) -> Result<usize, Error> {
        let found = self.word(what)?.parse().ok().filter(|number: &u64| *number < end);
        let number = found.ok_or_else(|| self.refuse(format!("{what}: expected a whole number below {end}")))?;
        Ok(number as usize)
    }

    fn this_line(&self) -> Line<'_> {
        Line { file: &self.file, number: self.number, text: &self.text, rest: &self.text }
    }
}

/// A line, and what of it was not read yet.
#[derive(Debug, Clone, Copy)]
pub struct Line<'a> {
    file: &'a str,
    number: u64,
    text: &'a str,
    rest: &'a str,
}

impl<'a> Line<'a> {
    /// The whole line.
    pub fn text(&self) -> &'a str {
        self.text
    }

    /// Its number in the file, from 1.
    pub fn place(&self) -> u64 {
        self.number
    }

    /// What was not read yet, without blanks at its ends.
    pub fn rest(&self) -> &'a str {
        self.rest.trim()
    }

    /// Is there nothing more?
    pub fn is_empty(&self) -> bool {
        self.rest().is_empty()
    }

    /// Does it begin with `#`?
    pub fn is_comment(&self) -> bool {
        self.text.trim_start().starts_with('#')
    }

    /// The next word.
    ///
    /// # Errors
    /// The end of the line; `what` should stand there.
    pub fn word(&mut self, what: &str) -> Result<&'a str, Error> {
        let rest = self.rest.trim_start();
        if rest.is_empty() {
            return Err(self.refuse(format!("the line ends where {what} should stand")));
        }
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        self.rest = &rest[end..];
        Ok(&rest[..end])
    }

    /// The next word as a finite number.
    ///
    /// # Errors
    /// The end of the line, or anything else; `what` is the number.
    pub fn number(&mut self, what: &str) -> Result<f64, Error> {
        let word = self.word(what)?;
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.expected(what, "a finite number", word))
    }

    /// The next `N` words as finite numbers.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number(what)?;
        }
        Ok(numbers)
    }

    /// The next word as a whole number.
    ///
    /// # Errors
    /// The end of the line, or anything else; `what` is the number.
    pub fn whole<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, Error> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.expected(what, "a whole number in its range", word))
    }

    /// Refuses the line.
    pub fn refuse(&self, problem: impl Into<String>) -> Error {
        Error::content(self.file, Place::Line(self.number), problem)
    }

    fn expected(&self, what: &str, kind: &str, found: &str) -> Error {
        self.refuse(format!("{what}: expected {kind}, found {}", shown(found.as_bytes())))
    }
}
