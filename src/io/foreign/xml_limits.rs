//! Limits of an XML document, held before a tree is made of it: one pass over the bytes, no memory.
//!
//! A tree takes some 60 bytes per tag and per attribute, however short they are in the file, and compares each
//! attribute of an element, and each declared name space, with those before it.

/// Most tags of a document: a project of a hundred thousand images has four million.
const MOST_TAGS: usize = 10_000_000;
/// Most signs of equality: each may be an attribute.
const MOST_EQUALS: usize = 20_000_000;
/// Most attributes of an element, and most name spaces of a document: programs write some dozens.
const MOST_ATTRIBUTES: usize = 1000;
/// What has no attributes, by how it begins and ends.
const OTHERS: [(&str, &str); 3] = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];

/// Where a document goes beyond the limits (byte), and what was expected; `None` where it keeps them. Says nothing of
/// what is no XML.
pub(super) fn beyond(text: &str) -> Option<(usize, String)> {
    let (mut tags, mut equals, mut spaces, mut at) = (0, 0, 0, 0);
    while let Some(begin) = text[at..].find('<').map(|next| at + next) {
        equals += text[at..begin].matches('=').count();
        let other = OTHERS.iter().find(|(start, _)| text[begin..].starts_with(start));
        let length = match other {
            Some((_, end)) => text[begin..].find(end).map(|found| found + end.len()),
            None => {
                let (length, attributes, declared) = tag(&text.as_bytes()[begin..]);
                spaces += declared;
                if attributes > MOST_ATTRIBUTES || spaces > MOST_ATTRIBUTES {
                    let what = format!(
                        "expected at most {MOST_ATTRIBUTES} attributes in a tag and name spaces in all, found more"
                    );
                    return Some((begin, what));
                }
                Some(length)
            }
        };
        at = begin + length.unwrap_or(text.len() - begin);
        equals += text[begin..at].matches('=').count();
        tags += 1;
        if tags > MOST_TAGS || equals > MOST_EQUALS {
            return Some((
                begin,
                format!("expected at most {MOST_TAGS} tags and {MOST_EQUALS} attributes, found more"),
            ));
        }
    }
    // A text behind the last tag is no XML, and is counted all the same where a tree is made.
    (equals + text[at..].matches('=').count() > MOST_EQUALS)
        .then(|| (at, format!("expected at most {MOST_EQUALS} attributes, found more")))
}

/// Length of a tag, its attributes, and the name spaces that it declares.
fn tag(bytes: &[u8]) -> (usize, usize, usize) {
    let (mut attributes, mut spaces, mut quote) = (0, 0, None);
    for (k, byte) in bytes.iter().enumerate() {
        match (quote, byte) {
            (None, b'>') => return (k + 1, attributes, spaces),
            (None, b'"' | b'\'') => quote = Some(*byte),
            (None, b'=') => attributes += 1,
            (None, b'x') => spaces += usize::from(bytes[k..].starts_with(b"xmlns")),
            (Some(open), close) if open == *close => quote = None,
            _ => {}
        }
    }
    (bytes.len(), attributes, spaces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projects_pass_and_what_fills_memory_or_time_does_not() {
        let fine = "<?a x='<'?><!-- < = -->\n<a b=\"1 > 0\" c='=='><![CDATA[<a =]]>text</a>".repeat(1000);
        assert_eq!(beyond(&fine), None);
        let many = format!("<a>\n<b {}/></a>", "k='1' ".repeat(MOST_ATTRIBUTES + 1));
        assert_eq!(beyond(&many).unwrap().0, 4);
        let declared: String = (0..=MOST_ATTRIBUTES).map(|k| format!("<a xmlns:n{k}='u'>")).collect();
        assert!(beyond(&declared).unwrap().1.contains("name spaces"));
        let tags = "<a/>".repeat(MOST_TAGS + 1);
        assert_eq!(beyond(&tags).unwrap().0, 4 * MOST_TAGS);
        for equals in ["=".repeat(MOST_EQUALS + 1), format!("<a>{}</a>", "=".repeat(MOST_EQUALS + 1))] {
            assert!(beyond(&equals).is_some());
        }
    }

    #[test]
    fn what_does_not_end_is_read_to_its_end() {
        for text in ["<", "<!--", "<a b='", "<![CDATA[", "<?", "a", "", "<a><"] {
            assert_eq!(beyond(text), None, "{text}");
        }
    }
}
