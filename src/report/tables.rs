//! One table, printed alike in the terminal and in HTML.

use super::html_text::unbroken;
use maud::{Markup, html};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A column's heading.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// What stands below it.
    pub name: String,
    /// Its unit; empty where there is none.
    pub unit: String,
    /// Numbers stand right, text left.
    pub numeric: bool,
}

/// A table of formatted cells; see [`super::numbers`] for formatting. Rows may be shorter or longer than the heading:
/// missing cells stay empty, further ones get columns without a name. Nothing is dropped.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Stands above the table.
    pub caption: String,
    /// Headings, left to right.
    pub columns: Vec<Column>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// Remarks below the table.
    pub notes: Vec<String>,
}

impl Table {
    /// An empty table.
    pub fn new(caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..Self::default() }
    }

    /// Adds a column of text.
    pub fn text(self, name: &str, unit: &str) -> Self {
        self.column(name, unit, false)
    }

    /// Adds a column of numbers.
    pub fn number(self, name: &str, unit: &str) -> Self {
        self.column(name, unit, true)
    }

    fn column(mut self, name: &str, unit: &str, numeric: bool) -> Self {
        self.columns.push(Column { name: name.into(), unit: unit.into(), numeric });
        self
    }

    /// Adds a row.
    pub fn row<C: Into<String>>(&mut self, cells: impl IntoIterator<Item = C>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    /// Adds a remark below the table.
    pub fn note(&mut self, text: impl Into<String>) -> &mut Self {
        self.notes.push(text.into());
        self
    }

    /// Aligned plain text, each line ended by a newline, within the width that [`fit_text_to`] set. Line breaks within
    /// a cell become spaces.
    pub fn to_text(&self) -> String {
        self.to_text_within(TEXT_WIDTH.load(Ordering::Relaxed))
    }

    /// [`Self::to_text`] in lines of at most `width` characters: the last columns of a wide table stand below the
    /// others, beside the first column again. A cell that is wider by itself is not cut.
    pub fn to_text_within(&self, width: usize) -> String {
        let all = self.all_columns();
        let widths: Vec<usize> = (0..all.len()).map(|k| self.text_width(&all, k)).collect();
        let mut parts: Vec<Vec<usize>> = vec![Vec::new()];
        let mut used = 0;
        for (k, own) in widths.iter().enumerate() {
            let gap = if k == 0 { 0 } else { GAP };
            if used + gap + own > width && parts.last().is_some_and(|part| part.len() > 1) {
                parts.push(vec![0]);
                used = widths[0];
            }
            parts.last_mut().expect("one at least").push(k);
            used += gap + own;
        }
        let fitted = |note: &String| if width == usize::MAX { note.clone() } else { textwrap::fill(note, width) };
        let notes: Vec<String> = self.notes.iter().map(fitted).collect();
        if parts.len() == 1 {
            return Self { notes, ..self.clone() }.to_aligned_text();
        }
        let last = parts.len() - 1;
        let part = |(number, columns): (usize, &Vec<usize>)| Self {
            caption: if number == 0 { self.caption.clone() } else { String::new() },
            columns: columns.iter().map(|k| all[*k].clone()).collect(),
            rows: self.rows.iter().map(|row| columns.iter().map(|k| cell(row, *k).to_string()).collect()).collect(),
            notes: if number == last { notes.clone() } else { Vec::new() },
        };
        parts.iter().enumerate().map(part).map(|table| table.to_aligned_text()).collect::<Vec<_>>().join("\n")
    }

    /// Characters of a column.
    fn text_width(&self, all: &[Column], k: usize) -> usize {
        let heading = all[k].name.chars().count().max(all[k].unit.chars().count());
        let cells = self.rows.iter().map(|row| cell(row, k).chars().count().min(MOST_CHARACTERS));
        cells.fold(heading, usize::max)
    }

    fn to_aligned_text(&self) -> String {
        let all = self.all_columns();
        let mut lines: Vec<Vec<String>> = vec![all.iter().map(|c| c.name.clone()).collect()];
        if all.iter().any(|c| !c.unit.is_empty()) {
            lines.push(all.iter().map(|c| c.unit.clone()).collect());
        }
        let head = lines.len();
        lines.extend(
            self.rows
                .iter()
                .map(|r| (0..all.len()).map(|k| cell(r, k).replace(['\n', '\r', '\t'], " ")).map(elided).collect()),
        );
        let width: Vec<usize> =
            (0..all.len()).map(|k| lines.iter().map(|l| l[k].chars().count()).max().unwrap_or(0)).collect();
        let mut out = String::new();
        let mut put = |line: &str| {
            out.push_str(line.trim_end());
            out.push('\n');
        };
        if !self.caption.is_empty() {
            put(&self.caption);
        }
        for (i, line) in lines.iter().enumerate() {
            if i == head {
                put(&width.iter().map(|w| "-".repeat(*w)).collect::<Vec<_>>().join("  "));
            }
            let cells =
                line.iter().zip(&width).zip(&all).map(|((text, w), column)| {
                    if column.numeric { format!("{text:>w$}") } else { format!("{text:<w$}") }
                });
            put(&cells.collect::<Vec<_>>().join("  "));
        }
        if self.rows.is_empty() {
            put("(no rows)");
        }
        self.notes.iter().for_each(|n| put(n));
        out
    }

    /// An HTML `<table>` with caption and remarks.
    pub fn to_html(&self) -> Markup {
        let all = self.all_columns();
        let class = |c: &Column| c.numeric.then_some("number");
        // Each row of a wide table becomes a card on a narrow screen, which names every cell.
        let label = |c: &Column| match c.unit.as_str() {
            _ if all.len() <= WIDEST_OF_A_PHONE => None,
            "" => Some(c.name.clone()),
            unit => Some(format!("{} ({unit})", c.name)),
        };
        let labels: Vec<Option<String>> = all.iter().map(label).collect();
        let kind = match all.len() {
            0..=WIDEST_OF_A_PHONE => "table",
            WIDE..MANY => "table wide",
            _ => "table wide many",
        };
        html! {
            div class=(kind) {
                table {
                    @if !self.caption.is_empty() { caption { (unbroken(&self.caption)) } }
                    thead {
                        tr {
                            @for c in &all {
                                th scope="col" class=[class(c)] {
                                    (c.name)
                                    @if !c.unit.is_empty() { " " span class="unit" { "(" (c.unit) ")" } }
                                }
                            }
                        }
                    }
                    tbody {
                        @for row in &self.rows {
                            tr {
                                @for (k, (c, label)) in all.iter().zip(&labels).enumerate() {
                                    td class=[class(c)] data-label=[label] { (unbroken(cell(row, k))) }
                                }
                            }
                        }
                        @if self.rows.is_empty() { tr { td colspan=(all.len().max(1)) { "no rows" } } }
                    }
                }
                @for note in &self.notes { p class="remark" { (unbroken(note)) } }
            }
        }
    }

    /// The named columns, and nameless ones for rows that are longer.
    fn all_columns(&self) -> Vec<Column> {
        let widest = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let mut all = self.columns.clone();
        while all.len() < widest {
            all.push(Column { name: String::new(), unit: String::new(), numeric: false });
        }
        all
    }
}

/// Lines of tables as text have at most so many characters from now on, in this program.
pub fn fit_text_to(width: usize) {
    TEXT_WIDTH.store(width, Ordering::Relaxed);
}

/// See [`fit_text_to`].
static TEXT_WIDTH: AtomicUsize = AtomicUsize::new(usize::MAX);
/// Blanks between two columns of text.
const GAP: usize = 2;

/// Columns that a phone shows side by side.
const WIDEST_OF_A_PHONE: usize = 3;
/// The next number.
const WIDE: usize = WIDEST_OF_A_PHONE + 1;
/// Columns from which on a table is printed in small type.
const MANY: usize = 8;

/// Characters of a cell in a table of text: names may have any length, and one line of a terminal has not.
const MOST_CHARACTERS: usize = 160;

/// The beginning of a long text.
fn elided(text: String) -> String {
    match text.char_indices().nth(MOST_CHARACTERS) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

fn cell(row: &[String], k: usize) -> &str {
    row.get(k).map_or("", String::as_str)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Table {
        let mut t = Table::new("Check points").text("set", "").number("mean", "mm").number("sigma", "mm");
        t.row(["planimetry", "0.26", "0.19"]).row(["height", "0.92"]).note("after the similarity");
        t
    }

    #[test]
    fn a_wide_table_goes_on_below_beside_its_first_column() {
        let mut t =
            Table::new("Wide").text("effect", "").number("first", "mm").number("second", "").text("estimate", "");
        t.row(["rolling-shutter", "1.25", "0.001", "t = 0.0200 s"]).row(["focal-time", "17", "3", ""]).note("a note");
        let text = t.to_text_within(36);
        assert!(text.lines().all(|line| line.chars().count() <= 36), "{text}");
        assert_eq!((text.matches("rolling-shutter").count(), text.matches("Wide").count()), (2, 1), "{text}");
        assert!(text.ends_with("a note\n") && text.contains("t = 0.0200 s"), "{text}");
        assert_eq!(t.to_text_within(200), t.to_text_within(usize::MAX));
        // A cell that is wider than the line stands alone beside the first column.
        assert!(t.to_text_within(10).contains("t = 0.0200 s"));
    }

    #[test]
    fn plain_text_is_aligned() {
        insta::assert_snapshot!(sample().to_text(), @"
        Check points
        set         mean  sigma
                      mm     mm
        ----------  ----  -----
        planimetry  0.26   0.19
        height      0.92
        after the similarity
        ");
    }

    #[test]
    fn html_is_escaped_and_well_formed() {
        let mut t = sample();
        t.row(["<b>&", "1", "2", "extra"]);
        let html = t.to_html().0;
        super::super::svg::tests::assert_well_formed(&html);
        assert!(html.contains("&lt;b&gt;&amp;") && html.contains("extra"));
        assert!(t.to_text().contains("extra"));
    }

    #[test]
    fn an_empty_table_says_so() {
        assert!(Table::new("").to_text().contains("(no rows)"));
        assert!(Table::new("").to_html().0.contains("no rows"));
    }
}
