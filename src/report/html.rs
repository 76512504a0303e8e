//! The page of a run: one HTML file that needs nothing else, and its pictures as SVG files beside it.

use super::html_text::unbroken;
use super::tables::Table;
use crate::diagnose::verdict::Verdict;
use crate::run::folder::write_atomically;
use anyhow::{Context, Result, bail};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::fs;
use std::path::Path;

/// Class of what shows a verdict.
pub(super) fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "adequate",
        Verdict::Missing => "missing",
        Verdict::Unexplained => "unexplained",
        Verdict::Mistake => "mistake",
    }
}

/// Sign and words: a verdict is understood without its colour.
fn heading(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "✓ Adequate: no significant misfit remains",
        Verdict::Missing => "! Missing effect: the camera model lacks a cause that this block shows",
        Verdict::Unexplained => "? Unexplained: something remains that no effect of the catalogue explains",
        Verdict::Mistake => "✗ Mistake: something is recorded wrongly",
    }
}

/// A page under construction. Everything is added in reading order; all text is escaped.
#[derive(Debug, Clone, Default)]
pub struct Page {
    title: String,
    subtitle: String,
    body: String,
    /// Where the first section begins in the body: what stands before it is seen first.
    lead: Option<usize>,
    /// For the foot of every printed page.
    provenance: String,
    sections: Vec<String>,
    figures: Vec<(String, String)>,
}

const CSS: &str = include_str!("style.css");
/// Stands in every picture file that a page writes, so that a later page knows which ones are its own to replace.
const MARK: &str = "<!-- figure of a misclosure report -->";

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// A line below the title, such as block and date of the data.
    pub fn subtitle(&mut self, text: &str) -> &mut Self {
        self.subtitle = text.into();
        self
    }

    /// Where the page comes from, for the foot of every printed page.
    pub fn provenance(&mut self, text: &str) -> &mut Self {
        self.provenance = text.into();
        self
    }

    /// A part of the page that is set apart by its class.
    pub fn part(&mut self, class: &str, content: impl FnOnce(&mut Self)) -> &mut Self {
        let content = self.apart(content);
        self.put(html! { div class=(class) { (content) } })
    }

    /// A paragraph of a class.
    pub fn line(&mut self, class: &str, text: &str) -> &mut Self {
        self.put(html! { p class=(class) { (unbroken(text)) } })
    }

    /// Terms and what is to be said of each.
    pub fn terms<T: AsRef<str>, D: AsRef<str>>(&mut self, terms: impl IntoIterator<Item = (T, D)>) -> &mut Self {
        self.put(html! {
            dl {
                @for (term, text) in terms {
                    dt { (unbroken(term.as_ref())) }
                    dd { (unbroken(text.as_ref())) }
                }
            }
        })
    }

    /// Begins a section, which the contents list.
    pub fn section(&mut self, heading: &str) -> &mut Self {
        self.lead.get_or_insert(self.body.len());
        self.sections.push(heading.into());
        let id = self.sections.len();
        self.put(html! { h2 id={ "section-" (id) } { (unbroken(heading)) } })
    }

    /// A heading within a section.
    pub fn subsection(&mut self, heading: &str) -> &mut Self {
        self.put(html! { h3 { (unbroken(heading)) } })
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) -> &mut Self {
        self.put(html! { p { (unbroken(text)) } })
    }

    /// A list.
    pub fn list<S: AsRef<str>>(&mut self, items: impl IntoIterator<Item = S>) -> &mut Self {
        let mut items = items.into_iter().peekable();
        if items.peek().is_none() {
            return self;
        }
        self.put(html! { ul { @for item in items { li { (unbroken(item.as_ref())) } } } })
    }

    /// Text as it would stand in a terminal or a file.
    pub fn code(&mut self, text: &str) -> &mut Self {
        self.put(html! { pre { (text) } })
    }

    /// The verdict: its meaning in words, then what was found.
    pub fn verdict(&mut self, verdict: Verdict, text: &str) -> &mut Self {
        self.line(&format!("verdict {}", class(verdict)), heading(verdict)).line("headline", text)
    }

    /// A remark that should not be missed.
    pub fn note(&mut self, text: &str) -> &mut Self {
        self.put(html! { div class="callout" role="note" { (unbroken(text)) } })
    }

    /// A warning.
    pub fn warning(&mut self, text: &str) -> &mut Self {
        self.put(html! { div class="callout warning" role="note" { "⚠ Warning: " (unbroken(text)) } })
    }

    /// A table.
    pub fn table(&mut self, table: &Table) -> &mut Self {
        self.put(table.to_html())
    }

    /// A picture, an SVG text from [`super::figures`], with its caption. `id` names its file: lower-case letters,
    /// digits and hyphens, once per page.
    pub fn figure(&mut self, id: &str, svg: String, caption: &str) -> &mut Self {
        self.put(html! {
            figure {
                (PreEscaped(&svg))
                @if !caption.is_empty() { figcaption { (unbroken(caption)) } }
            }
        });
        self.figures.push((id.into(), svg));
        self
    }

    /// Two pictures side by side, such as before and after; each is id, SVG and caption.
    pub fn pair(&mut self, left: (&str, String, &str), right: (&str, String, &str)) -> &mut Self {
        self.part("pair", |page| {
            page.figure(left.0, left.1, left.2).figure(right.0, right.1, right.2);
        })
    }

    /// A part that is folded away until the reader opens it. Sections do not belong into it: use subsections.
    pub fn details(&mut self, summary: &str, content: impl FnOnce(&mut Self)) -> &mut Self {
        let content = self.apart(content);
        self.put(html! { details { summary { (summary) } (content) } })
    }

    /// [`Self::details`] with rows of data, which stand in a table of the folder, too: they are not printed.
    pub fn data(&mut self, summary: &str, content: impl FnOnce(&mut Self)) -> &mut Self {
        let content = self.apart(content);
        self.put(html! { details class="data" { summary { (summary) } (content) } })
    }

    /// Adds a part of the page as a line of its own.
    fn put(&mut self, part: Markup) -> &mut Self {
        self.body += &part.0;
        self.body.push('\n');
        self
    }

    /// What `content` would add to the page.
    fn apart(&mut self, content: impl FnOnce(&mut Self)) -> Markup {
        let begins = self.body.len();
        content(self);
        PreEscaped(self.body.split_off(begins))
    }

    /// Every picture so far: its id and its SVG text, in reading order.
    pub fn figures(&self) -> &[(String, String)] {
        &self.figures
    }

    /// The whole page. Contents are listed where there are three sections or more.
    pub fn html(&self) -> String {
        let (_, rest) = self.split();
        self.document(html! {
            @if self.sections.len() >= 3 {
                nav aria-label="Contents" {
                    ol {
                        @for (i, section) in self.sections.iter().enumerate() {
                            li { a href={ "#section-" (i + 1) } { (section) } }
                        }
                    }
                }
            }
            main { (PreEscaped(rest)) }
        })
    }

    /// The part before the first section alone: one page for the client.
    pub fn client(&self) -> String {
        self.document(Markup::default())
    }

    /// What stands before the first section, and the rest.
    fn split(&self) -> (&str, &str) {
        self.body.split_at(self.lead.unwrap_or(self.body.len()))
    }

    fn document(&self, rest: Markup) -> String {
        let foot = match self.provenance.as_str() {
            "" => String::new(),
            text => format!("@page {{ @bottom-left {{ content: \"{}\"; }} }}\n", css_text(text)),
        };
        let (lead, _) = self.split();
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (self.title) }
                    style { (PreEscaped(CSS)) (PreEscaped(foot)) }
                }
                body {
                    header {
                        h1 { (self.title) }
                        @if !self.subtitle.is_empty() { p class="subtitle" { (self.subtitle) } }
                        (PreEscaped(lead))
                    }
                    (rest)
                }
            }
        };
        page.into_string()
    }

    /// Writes `report.html` and `figures/*.svg` into the folder, which is made where it is missing. Pictures of an
    /// earlier page that this one does not have are removed; other files are left alone.
    ///
    /// # Errors
    /// When a figure's id is no file name or is used twice, or a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        for (i, (id, _)) in self.figures.iter().enumerate() {
            let legal = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            if id.is_empty() || !id.chars().all(legal) {
                bail!("figure id `{id}`: only lower-case letters, digits and hyphens can name a file");
            }
            if self.figures[..i].iter().any(|(other, _)| other == id) {
                bail!("figure id `{id}` is used twice");
            }
        }
        let figures = folder.join("figures");
        fs::create_dir_all(&figures).with_context(|| format!("cannot make {}", figures.display()))?;
        remove_old(&figures, |name| self.figures.iter().any(|(id, _)| name == format!("{id}.svg")))?;
        for (id, svg) in &self.figures {
            write_atomically(&figures.join(format!("{id}.svg")), format!("{svg}{MARK}\n").as_bytes())?;
        }
        write_atomically(&folder.join("report.html"), self.html().as_bytes())?;
        Ok(())
    }
}

/// Text in a string of a style sheet within HTML.
fn css_text(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '"' | '\\' | '<' | '>' | '&' | '\n' | '\r' => out += &format!("\\{:x} ", u32::from(c)),
            c => out.push(c),
        }
    }
    out
}

fn remove_old(figures: &Path, keep: impl Fn(&str) -> bool) -> Result<()> {
    let context = || format!("cannot tidy {}", figures.display());
    for entry in fs::read_dir(figures).with_context(context)? {
        let entry = entry.with_context(context)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let ours = || crate::files::read_text(&entry.path()).is_ok_and(|text| text.trim_end().ends_with(MARK));
        if name.ends_with(".svg") && !keep(&name) && ours() {
            fs::remove_file(entry.path()).with_context(context)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::figures::{Histogram, histogram};
    use super::super::svg::tests::assert_well_formed;
    use super::*;

    fn sample() -> Page {
        let svg = || histogram(&Histogram { title: "a < b".into(), ..Histogram::default() });
        let mut page = Page::new("Dike & <flights>");
        page.subtitle("four flights").verdict(Verdict::Unexplained, "at <row> 12");
        for s in ["One", "Two", "Three & four"] {
            page.section(s).paragraph("text").note("a note").warning("careful");
        }
        page.list(["a", "b<"]).code("x < y").table(&Table::new("t").number("v", "mm"));
        page.figure("first", svg(), "caption").pair(("before", svg(), "b"), ("after", svg(), "a"));
        page.details("More", |p| {
            p.subsection("Inside").figure("inside", svg(), "");
        });
        page
    }

    #[test]
    fn the_page_is_well_formed_escaped_and_loads_nothing() {
        let html = sample().html();
        assert_well_formed(&html);
        assert!(html.contains("Dike &amp; &lt;flights&gt;") && html.contains("#section-3"));
        for outside in ["<script", "src=", "@import", "url(", "<link"] {
            assert!(!html.contains(outside), "{outside}");
        }
        let links = html.matches("http").count();
        assert_eq!(links, html.matches("xmlns=\"http://www.w3.org/2000/svg\"").count(), "only the SVG name space");
        assert_eq!(html, sample().html());
    }

    #[test]
    fn writing_makes_the_folder_and_replaces_old_pictures_only() {
        let tmp = tempfile::tempdir().expect("a folder");
        let run = tmp.path().join("run");
        sample().write(&run).expect("written");
        fs::write(run.join("figures/mine.svg"), "<svg/>").expect("written");
        let mut other = Page::new("p");
        other.figure("first", histogram(&Histogram::default()), "");
        other.write(&run).expect("written");
        let mut names: Vec<String> = fs::read_dir(run.join("figures"))
            .expect("listed")
            .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        assert_eq!(names, ["first.svg", "mine.svg"]);
        assert!(fs::read_to_string(run.join("report.html")).expect("read").contains("no data"));
    }

    #[test]
    fn bad_and_repeated_ids_are_refused() {
        let tmp = tempfile::tempdir().expect("a folder");
        for ids in [["a", "a"], ["a", "../b"], ["", "a"]] {
            let mut page = Page::new("p");
            ids.iter().for_each(|id| {
                page.figure(id, String::new(), "");
            });
            assert!(page.write(tmp.path()).is_err(), "{ids:?}");
        }
    }
}
