//! An XML file as a tree of elements and their texts, each with its line and column. Attributes and name spaces are
//! left out: missions have nothing in them.

use super::{MissionError, Place, Result};
use crate::files::xml::character;
use quick_xml::Reader;
use quick_xml::events::Event;

/// Depth beyond which no mission nests.
const DEEPEST: usize = 64;
/// Most elements: each takes some hundred bytes of memory, however short it is in the file.
const MOST_ELEMENTS: usize = 2_000_000;
/// Longest text of an element that a message repeats, characters.
const SHOWN: usize = 40;

/// An element.
#[derive(Debug, Default)]
pub(super) struct Element {
    /// Name without name space.
    pub name: String,
    /// What it has inside.
    pub children: Vec<Element>,
    text: String,
    line: usize,
    column: usize,
}

/// Parses a document and gives its root.
///
/// # Errors
/// What is no XML, with its place.
pub(super) fn parse(file: &str, text: &str) -> Result<Element> {
    let mut reader = Reader::from_str(text);
    reader.config_mut().expand_empty_elements = true;
    let mut place = Cursor { text, byte: 0, line: 1, column: 1 };
    let (mut open, mut root, mut count) = (Vec::<Element>::new(), None, 0);
    loop {
        place.go_to(reader.buffer_position() as usize);
        let refuse = |problem: String| MissionError::new(file, Place::Character(place.line, place.column), problem);
        let event = reader.read_event().map_err(|error| refuse(format!("not XML: {error}")))?;
        match event {
            Event::Start(start) => {
                count += 1;
                if open.len() >= DEEPEST || count > MOST_ELEMENTS || root.is_some() {
                    let most = format!("expected one element with at most {MOST_ELEMENTS} in it, {DEEPEST} deep");
                    return Err(refuse(most));
                }
                let name = start.local_name().as_ref().to_owned();
                let (line, column) = (place.line, place.column);
                open.push(Element { name, children: Vec::new(), text: String::new(), line, column });
            }
            Event::End(_) => {
                let Some(element) = open.pop() else { return Err(refuse("not XML: nothing to end".into())) };
                match open.last_mut() {
                    Some(parent) => parent.children.push(element),
                    None => root = Some(element),
                }
            }
            Event::Text(text) => add(&mut open, &text),
            Event::CData(text) => add(&mut open, &text),
            Event::GeneralRef(reference) => match character(&reference) {
                Some(character) => add(&mut open, character.encode_utf8(&mut [0; 4])),
                None => return Err(refuse(format!("the entity &{}; is not known", &*reference))),
            },
            Event::Eof => {
                let inside = open.last().map(|element| format!("the file ends inside of <{}>", element.name));
                return root
                    .filter(|_| inside.is_none())
                    .ok_or_else(|| refuse(inside.unwrap_or("expected an XML document, found nothing".into())));
            }
            _ => {}
        }
    }
}

fn add(open: &mut [Element], text: &str) {
    if let Some(element) = open.last_mut() {
        element.text.push_str(text);
    }
}

/// Line and column of a byte that only moves on.
struct Cursor<'a> {
    text: &'a str,
    byte: usize,
    line: usize,
    column: usize,
}

impl Cursor<'_> {
    fn go_to(&mut self, byte: usize) {
        let passed = self.text.get(self.byte..byte).unwrap_or("");
        self.line += passed.matches('\n').count();
        self.column = match passed.rsplit_once('\n') {
            Some((_, line)) => line.chars().count() + 1,
            None => self.column + passed.chars().count(),
        };
        self.byte = byte;
    }
}

impl Element {
    /// The first element in it of a name.
    pub(super) fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Elements in it of a name.
    pub(super) fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Element> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Elements of a name at any depth, in the order of the file.
    pub(super) fn descendants<'a>(&'a self, name: &str, found: &mut Vec<&'a Element>) {
        for child in &self.children {
            if child.name == name {
                found.push(child);
            }
            child.descendants(name, found);
        }
    }

    /// Its text without blanks around it.
    pub(super) fn text(&self) -> &str {
        self.text.trim()
    }

    /// The text of the first element in it of a name; empty without one.
    pub(super) fn text_of(&self, name: &str) -> &str {
        self.child(name).map_or("", Element::text)
    }

    /// The number in the first element of a name; `None` without one.
    ///
    /// # Errors
    /// What is no finite number.
    pub(super) fn number(&self, file: &str, name: &str) -> Result<Option<f64>> {
        let Some(child) = self.child(name) else { return Ok(None) };
        let number = child.text().parse().ok().filter(|number: &f64| number.is_finite());
        let expected = || child.refuse(file, format!("expected a number, found {}", child.shown()));
        number.map(Some).ok_or_else(expected)
    }

    /// The number in an element that must be there.
    ///
    /// # Errors
    /// No such element, or no finite number in it.
    pub(super) fn required(&self, file: &str, name: &str) -> Result<f64> {
        self.number(file, name)?.ok_or_else(|| self.refuse(file, format!("expected <{name}> in it")))
    }

    /// Its text, as a message shows it.
    pub(super) fn shown(&self) -> String {
        let text: String = self.text().chars().take(SHOWN).collect();
        format!("{text:?}")
    }

    /// Something is wrong with it.
    pub(super) fn refuse(&self, file: &str, problem: impl Into<String>) -> MissionError {
        let problem = format!("<{}>: {}", self.name, problem.into());
        MissionError::new(file, Place::Character(self.line, self.column), problem)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_have_names_texts_and_places() {
        let text = "<?xml version='1.0'?>\n<a xmlns:w='u'>\n  <w:b> 1 &amp; &#50; </w:b><c/><b>x</b>\n</a>\n";
        let root = parse("f.kml", text).unwrap();
        assert_eq!((root.name.as_str(), root.text_of("b"), root.children.len()), ("a", "1 & 2", 3));
        assert_eq!(root.number("f.kml", "d").unwrap(), None);
        let error = root.number("f.kml", "c").unwrap_err().to_string();
        assert_eq!(error, "f.kml:3:29: <c>: expected a number, found \"\"");
        let mut found = Vec::new();
        root.descendants("b", &mut found);
        assert_eq!(found.iter().map(|b| b.text()).collect::<Vec<_>>(), ["1 & 2", "x"]);
    }

    #[test]
    fn what_is_no_xml_is_refused_with_its_place() {
        let deep = "<a>".repeat(DEEPEST + 1);
        for (text, place) in [
            ("", "f.kml:1:1: expected an XML document"),
            ("<a>\n<b>", "f.kml:2:4: the file ends inside of <b>"),
            ("<a></b>", "f.kml:1:4: not XML"),
            ("<a>&nope;</a>", "f.kml:1:4: the entity &nope; is not known"),
            ("<a/><b/>", "f.kml:1:5: expected one element"),
            (deep.as_str(), "f.kml:1:193: expected one element"),
        ] {
            let error = parse("f.kml", text).unwrap_err().to_string();
            assert!(error.starts_with(place), "{text}: {error}");
        }
    }
}
