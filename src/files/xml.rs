//! What the readers of XML have in common.

use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::BytesRef;

/// The character of `&...;`; `None` of an entity that no document has without saying so.
pub fn character(reference: &BytesRef<'_>) -> Option<char> {
    match resolve_predefined_entity(reference) {
        Some(text) => text.chars().next(),
        None => reference.resolve_char_ref().ok().flatten(),
    }
}
