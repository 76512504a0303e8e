//! An XML file as a tree in which every fault has a place.

use super::super::error::{Error, Place, shown};
use super::xml_limits::beyond;
use roxmltree::{Document, Node, ParsingOptions};

/// Parses a document; `file` is its name in messages.
///
/// # Errors
/// What is no XML, and what would fill the memory or take hours; with its place.
pub(super) fn parse<'a>(file: &str, text: &'a str) -> Result<Document<'a>, Error> {
    if let Some((byte, problem)) = beyond(text) {
        return Err(Error::content(file, character(text, byte), problem));
    }
    let options = ParsingOptions { allow_dtd: false, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| {
        let place = error.pos();
        Error::content(file, Place::Character(place.row.into(), place.col.into()), format!("not XML: {error}"))
    })
}

/// Line and character of a byte.
fn character(text: &str, byte: usize) -> Place {
    let before = &text[..byte];
    let line = before.rfind('\n').map_or(0, |end| end + 1);
    let count = |number: usize| number as u64 + 1;
    Place::Character(count(before.matches('\n').count()), count(text[line..byte].chars().count()))
}

/// An element of a document.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    file: &'a str,
    node: Node<'a, 'a>,
}

impl<'a> Element<'a> {
    /// The root element of a document.
    pub(super) fn root(file: &'a str, document: &'a Document<'a>) -> Self {
        Self { file, node: document.root_element() }
    }

    /// Its name, without the name space.
    pub(super) fn name(&self) -> &'a str {
        self.node.tag_name().name()
    }

    /// All elements in it of a name.
    pub(super) fn children(self, name: &'a str) -> impl Iterator<Item = Self> {
        self.elements().filter(move |element| element.name() == name)
    }

    /// All elements in it.
    pub(super) fn elements(self) -> impl Iterator<Item = Self> {
        self.node.children().filter(Node::is_element).map(move |node| Self { file: self.file, node })
    }

    /// All elements of a name at any depth, itself included.
    pub(super) fn descendants(self, name: &'a str) -> impl Iterator<Item = Self> {
        let elements = self.node.descendants().filter(move |node| node.tag_name().name() == name);
        elements.map(move |node| Self { file: self.file, node })
    }

    /// The first element in it of a name.
    pub(super) fn optional(self, name: &'a str) -> Option<Self> {
        self.children(name).next()
    }

    /// The one element in it of a name.
    pub(super) fn child(self, name: &'a str) -> Result<Self, Error> {
        self.optional(name).ok_or_else(|| self.refuse(format!("<{}> has no <{name}>", self.name())))
    }

    /// An attribute, whatever its name space.
    pub(super) fn optional_attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attributes().find(|attribute| attribute.name() == name).map(|attribute| attribute.value())
    }

    /// All attributes: name without name space, value.
    pub(super) fn attributes(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        self.node.attributes().map(|attribute| (attribute.name(), attribute.value()))
    }

    /// An attribute that must be there.
    pub(super) fn attribute(&self, name: &str) -> Result<&'a str, Error> {
        self.optional_attribute(name).ok_or_else(|| self.refuse(format!("<{}> has no attribute {name}", self.name())))
    }

    /// A finite number in an attribute.
    pub(super) fn number_attribute(&self, name: &str) -> Result<f64, Error> {
        let text = self.attribute(name)?;
        finite(text).ok_or_else(|| {
            let found = shown(text.as_bytes());
            self.refuse(format!("<{}> {name}: expected a finite number, found {found}", self.name()))
        })
    }

    /// A finite number in an attribute, where it has that attribute.
    pub(super) fn optional_number_attribute(&self, name: &str) -> Result<Option<f64>, Error> {
        self.optional_attribute(name).map(|_| self.number_attribute(name)).transpose()
    }

    /// A whole number above zero in an attribute.
    pub(super) fn count_attribute(&self, name: &str) -> Result<u32, Error> {
        let text = self.attribute(name)?;
        text.trim().parse().ok().filter(|count| *count > 0).ok_or_else(|| {
            let found = shown(text.as_bytes());
            self.refuse(format!("<{}> {name}: expected a whole number above zero, found {found}", self.name()))
        })
    }

    /// Its text, without blanks around it.
    pub(super) fn text(&self) -> &'a str {
        self.node.text().unwrap_or_default().trim()
    }

    /// Its text, which must be there.
    pub(super) fn name_text(&self) -> Result<&'a str, Error> {
        match self.text() {
            "" => Err(self.refuse(format!("<{}>: expected a name, found nothing", self.name()))),
            text => Ok(text),
        }
    }

    /// Its text as `N` finite numbers.
    pub(super) fn numbers<const N: usize>(&self) -> Result<[f64; N], Error> {
        let numbers: Option<Vec<f64>> = self.text().split_whitespace().map(finite).collect();
        numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()).ok_or_else(|| {
            let numbers = if N == 1 { "one finite number".to_owned() } else { format!("{N} finite numbers") };
            let found = shown(self.text().as_bytes());
            self.refuse(format!("<{}>: expected {numbers}, found {found}", self.name()))
        })
    }

    /// Its text as one finite number.
    pub(super) fn number(&self) -> Result<f64, Error> {
        self.numbers().map(|[number]| number)
    }

    /// The number of an element in it, or zero where there is none.
    pub(super) fn number_or_zero(self, name: &'a str) -> Result<f64, Error> {
        self.optional(name).map_or(Ok(0.0), |element| element.number())
    }

    /// Something is wrong with it.
    pub(super) fn refuse(&self, problem: impl Into<String>) -> Error {
        let place = self.node.document().text_pos_at(self.node.range().start);
        Error::content(self.file, Place::Character(place.row.into(), place.col.into()), problem)
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// A text as the content or the attribute of an element holds it.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_have_a_place_and_say_what_was_expected() {
        let text = "<a>\n  <b x='one'>1 2</b>\n</a>";
        let document = parse("f.xml", text).unwrap();
        let root = Element::root("f.xml", &document);
        let b = root.child("b").unwrap();
        let message = |error: Error| error.to_string();
        assert_eq!(b.numbers::<2>().unwrap(), [1.0, 2.0]);
        assert_eq!(message(b.number().unwrap_err()), "f.xml:2:3: <b>: expected one finite number, found \"1 2\"");
        let found = "f.xml:2:3: <b> x: expected a finite number, found \"one\"";
        assert_eq!(message(b.number_attribute("x").unwrap_err()), found);
        assert_eq!(message(b.attribute("y").unwrap_err()), "f.xml:2:3: <b> has no attribute y");
        assert_eq!(message(root.child("c").map(|_| ()).unwrap_err()), "f.xml:1:1: <a> has no <c>");
        assert!(message(parse("f.xml", "<a>\n</b>").unwrap_err()).starts_with("f.xml:2:"));
    }

    #[test]
    fn an_element_with_more_attributes_than_any_program_writes_is_refused_at_once() {
        let attributes: String = (0..200_000).map(|k| format!("k{k}='1' ")).collect();
        let message = parse("f.xml", &format!("<a>\n é<b {attributes}/></a>")).unwrap_err().to_string();
        assert!(message.starts_with("f.xml:2:3: expected at most 1000 attributes"), "{message}");
    }

    #[test]
    fn nesting_without_end_is_read_or_refused_but_does_not_end_the_program() {
        let deep = "<a>".repeat(1_000_000);
        assert!(parse("f.xml", &deep).is_err());
        let closed = deep + &"</a>".repeat(1_000_000);
        let document = parse("f.xml", &closed).unwrap();
        assert_eq!(Element::root("f.xml", &document).descendants("a").count(), 1_000_000);
    }
}
