//! Paragraphs for people; tables are [`crate::report::tables`].

use crate::report::numbers::fixed;

/// Width of a paragraph, characters.
const WIDTH: usize = 100;

/// `text` in lines of at most [`WIDTH`] characters, the first behind `label`, all indented to `indent`.
pub fn paragraph(label: &str, indent: usize, text: &str) -> String {
    let mut out = format!("{label:<indent$}");
    let mut column = indent.max(label.chars().count());
    for (k, word) in text.split_whitespace().enumerate() {
        let length = word.chars().count();
        if k > 0 && column + 1 + length > WIDTH {
            out += &format!("\n{:indent$}", "");
            column = indent;
        } else if k > 0 {
            out.push(' ');
            column += 1;
        }
        out += word;
        column += length;
    }
    out.push('\n');
    out
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
