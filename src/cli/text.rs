//! Paragraphs for people; tables are [`crate::report::tables`].

use crate::report::numbers::fixed;
use std::path::Path;
use textwrap::{Options, WordSplitter};

/// Width of a paragraph, characters.
const WIDTH: usize = 100;
/// Images that a message names.
const IMAGES_SHOWN: usize = 10;

/// A path as JSON and messages have it: where it is no UTF-8, with a mark in place of what is none.
pub fn path_text(path: &Path) -> String {
    path.display().to_string()
}

/// `text` in lines of at most [`WIDTH`] characters, the first behind `label`, all indented to `indent`.
pub fn paragraph(label: &str, indent: usize, text: &str) -> String {
    let (first, next) = (format!("{label:<indent$}"), " ".repeat(indent));
    let options = Options::new(WIDTH)
        .initial_indent(&first)
        .subsequent_indent(&next)
        .break_words(false)
        .word_splitter(WordSplitter::NoHyphenation);
    let words: Vec<&str> = text.split_whitespace().collect();
    textwrap::fill(&words.join(" "), options) + "\n"
}

/// Up to `shown` names, and how many more there are.
pub fn listed(names: &[&str], shown: usize) -> String {
    match names.len().checked_sub(shown).filter(|more| *more > 0) {
        None => names.join(", "),
        Some(more) => format!("{} and {more} more", names[..shown].join(", ")),
    }
}

/// A message that some images have too few measurements to take part.
pub fn without_part(images: &[&str]) -> String {
    format!("{} images have too few measurements to take part: {}", images.len(), listed(images, IMAGES_SHOWN))
}

/// How many images see a tie point; entry `m` of `points`: number of points that `m` images see.
pub fn multiplicity(mean: f64, points: &[usize]) -> String {
    let seen = points.iter().enumerate().filter(|(_, points)| **points > 0);
    let list: Vec<String> = seen.map(|(m, points)| format!("{m}: {points}")).collect();
    let mean = fixed(mean, 2);
    paragraph("", 0, &format!("A tie point is seen by {mean} images in the mean (images: points): {}", list.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraph_breaks_between_words() {
        let text = paragraph("What", 8, &"word ".repeat(30));
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(text.matches("word").count(), 30);
        assert!(text.lines().skip(1).all(|line| line.starts_with("        word")), "{text}");
    }
}
