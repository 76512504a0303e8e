//! Text in HTML.

use super::svg::escape as escaped;
use maud::{Markup, PreEscaped};

/// Escaped text in which no number is broken across lines (browsers break `1e-300` behind its hyphen), but long words
/// are: names of images and points may have any length, and a column of them is as wide as its longest word.
pub(super) fn unbroken(text: &str) -> Markup {
    let words = text.split(' ').map(|word| match has_exponent(word) {
        true if word.len() <= LONG_WORD => format!("<span class=\"n\">{}</span>", escaped(word)),
        _ => breakable(word),
    });
    // A bound stays with its sign.
    let text = words.collect::<Vec<_>>().join(" ");
    PreEscaped(text.replace("&lt; <span class=\"n\">", "<span class=\"n\">&lt; "))
}

/// Characters beyond which a word may be broken.
const LONG_WORD: usize = 18;

fn breakable(word: &str) -> String {
    let characters: Vec<char> = word.chars().collect();
    if characters.len() <= LONG_WORD {
        return escaped(word);
    }
    let parts = characters.chunks(LONG_WORD / 2).map(|part| escaped(&part.iter().collect::<String>()));
    parts.collect::<Vec<_>>().join("<wbr>")
}

/// Has it a number like `4e-8`?
fn has_exponent(word: &str) -> bool {
    let is_digit = |at: Option<usize>| at.and_then(|at| word.as_bytes().get(at)).is_some_and(u8::is_ascii_digit);
    word.match_indices("e-").any(|(at, _)| is_digit(at.checked_sub(1)) && is_digit(Some(at + 2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_whole() {
        assert_eq!(unbroken("p < 1e-300.").0, "p <span class=\"n\">&lt; 1e-300.</span>");
        assert_eq!(unbroken("± 9.3e-5 s & more").0, "± <span class=\"n\">9.3e-5</span> s &amp; more");
        assert_eq!(unbroken("a one-way re-entry").0, "a one-way re-entry");
    }

    #[test]
    fn long_words_may_be_broken() {
        assert_eq!(unbroken("in DJI_20260131_0001_V&.JPG").0, "in DJI_20260<wbr>131_0001_<wbr>V&amp;.JPG");
        assert_eq!(unbroken("DJI_0001.JPG").0, "DJI_0001.JPG");
    }
}
