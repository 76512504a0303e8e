//! Plain-text tables and paragraphs for people.

/// Width of a paragraph, characters.
const WIDTH: usize = 100;

/// Columns padded to their widest cell, two blanks between; the first row is the header.
pub fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    // A column of numbers stands at the right.
    let number = |cell: &String| cell.is_empty() || cell.parse::<f64>().is_ok();
    let right: Vec<bool> = (0..columns).map(|k| rows.iter().skip(1).filter_map(|row| row.get(k)).all(number)).collect();
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().enumerate().map(|(k, cell)| match right[k] {
            true => format!("{cell:>width$}", width = widths[k]),
            false => format!("{cell:<width$}", width = widths[k]),
        });
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_the_right() {
        let rows = [vec!["flight".into(), "n".into()], vec!["a".into(), "5".into()], vec!["bc".into(), "12".into()]];
        assert_eq!(table(&rows), "flight   n\na        5\nbc      12\n");
    }

    #[test]
    fn paragraph_breaks_between_words() {
        let text = paragraph("What", 8, &"word ".repeat(30));
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(text.matches("word").count(), 30);
        assert!(text.lines().skip(1).all(|line| line.starts_with("        word")), "{text}");
    }
}
