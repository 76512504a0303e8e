//! The pages of the catalogue in the book, one for each effect, made from what `misclosure effects --json` prints.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Width of a line of text.
const WIDTH: usize = 120;
/// Most parameters that are listed one by one; of more, the first [`FIRST`].
const MOST: usize = 12;
/// How many stand for the rest.
const FIRST: usize = 3;

/// Name and Markdown of each page: the index first, then the references and one for each effect. `has_picture` says of
/// an id whether there is a picture of its residuals beside the pages.
pub fn pages(effects: &[Value], has_picture: impl Fn(&str) -> bool) -> Vec<(String, String)> {
    let ids: Vec<&str> = effects.iter().map(|effect| text(effect, "id")).collect();
    let mut pages = vec![("README.md".to_owned(), index(effects)), ("references.md".to_owned(), references(effects))];
    for effect in effects {
        let id = text(effect, "id");
        pages.push((format!("{id}.md"), page(effect, &ids, has_picture(id))));
    }
    pages
}

fn index(effects: &[Value]) -> String {
    let mut page = String::from("# The effects\n\n");
    page += &paragraph(
        "The catalogue, a page for each effect. `misclosure effects book docs/effects` writes these pages from the \
         effects themselves; nothing on them is written by hand. A *physical* effect names a cause. An *empirical* one \
         takes away a shape and names no cause: a block that only it explains is `unexplained`.",
    );
    page += "\n| effect | stage | kind | what happens |\n|---|---|---|---|\n";
    for effect in effects {
        let (id, stage, kind) = (text(effect, "id"), text(effect, "stage"), text(effect, "kind"));
        let summary = cell(text(effect, "summary"));
        writeln!(page, "| [`{id}`]({id}.md) | {stage} | {kind} | {summary} |").expect("a string");
    }
    page += "\nLiterature: [references](references.md).\n";
    page
}

/// The literature, each with the effects that rest on it.
fn references(effects: &[Value]) -> String {
    // `de Boor` stands beside `Daakir`.
    let mut all: BTreeMap<(String, &str), Vec<String>> = BTreeMap::new();
    for effect in effects {
        let id = text(effect, "id");
        for reference in list(effect, "literature").iter().filter_map(Value::as_str) {
            all.entry((reference.to_lowercase(), reference)).or_default().push(format!("[{id}]({id}.md)"));
        }
    }
    let mut page = String::from("# References\n\n");
    page += &paragraph(
        "Literature on the effects of the catalogue, by author. `misclosure effects book docs/effects` writes this \
         page from the effects themselves. An effect that stands nowhere here comes from practice; its page says from \
         where.",
    );
    page += "\n";
    for ((_, reference), effects) in all {
        // Markdown makes a link of an address between angle brackets, and leaves its brackets alone.
        let reference = match reference.split_once(" https://") {
            Some((work, address)) => format!("{work} <https://{address}>"),
            None => reference.to_owned(),
        };
        page += &textwrap::fill(&format!("- {reference} ({})", effects.join(", ")), lines().subsequent_indent("  "));
        page.push('\n');
    }
    page
}

fn page(effect: &Value, ids: &[&str], has_picture: bool) -> String {
    let (id, words) = (text(effect, "id"), &effect["words"]);
    let mut page = format!("# {id}\n\n");
    if words.is_object() {
        page += &paragraph(text(words, "what"));
        page += "\n";
    }
    page += &paragraph(text(effect, "summary"));
    write!(page, "\n```text\n{}\n```\n", text(effect, "formula")).expect("a string");
    let needs: Vec<&str> = list(effect, "needs").iter().filter_map(Value::as_str).collect();
    let needs = if needs.is_empty() { "nothing".to_owned() } else { needs.join(", ") };
    let (stage, kind, source) = (text(effect, "stage"), text(effect, "kind"), cell(text(effect, "source")));
    write!(
        page,
        "\n| | |\n|---|---|\n| stage | {stage} |\n| kind | {kind} |\n| needs | {needs} |\n| source | {source} |\n"
    )
    .expect("a string");
    page += "\n## Parameters\n\n";
    page += &parameters(list(effect, "parameters"));
    page += "\n## What it is confused with\n\n";
    page += &paragraph(&linked(text(effect, "confused_with"), id, ids));
    if words.is_object() {
        page += "\n";
        page += &paragraph(&format!("To tell them apart: {}.", text(words, "tell")));
        page += "\n## What to do\n\n";
        page += &paragraph(text(words, "remedy"));
    }
    page += "\n## How it shows\n\n";
    let picture = text(effect, "picture");
    page += &paragraph(&format!("Figure of the report: {picture}."));
    if has_picture {
        write!(page, "\n![{id}: {picture}]({id}.svg)\n").expect("a string");
    }
    write!(page, "\n## In a model\n\n```text\nmisclosure adjust BLOCK -o RUN --add {id}\n```\n").expect("a string");
    page
}

/// A table of parameters, and where their ranges come from.
fn parameters(all: &[Value]) -> String {
    let mut part =
        String::from("| parameter | unit | values | nominal | typical | possible | how it gets its value |\n");
    part += "|---|---|---|---|---|---|---|\n";
    let shown = if all.len() > MOST { FIRST } else { all.len() };
    for p in &all[..shown] {
        let range = &p["plausible"];
        let possible = if range.is_object() { format!("{} to {}", range["min"], range["max"]) } else { "-".to_owned() };
        writeln!(
            part,
            "| `{}` | {} | {} | {} | {} | {possible} | {} |",
            text(p, "name"),
            text(p, "unit"),
            text(p, "values"),
            p["nominal"],
            p["typical"],
            cell(text(p, "role"))
        )
        .expect("a string");
    }
    if shown < all.len() {
        write!(part, "\nThere are {} in all, alike.\n", all.len()).expect("a string");
    }
    // Several parameters often share a source.
    let mut sources: Vec<&str> = Vec::new();
    for source in all.iter().filter_map(|p| p["plausible"]["source"].as_str()) {
        if !sources.contains(&source) {
            sources.push(source);
        }
    }
    for source in sources {
        part += "\n";
        part += &paragraph(&format!("Source of the range: {source}."));
    }
    part
}

/// The ids of other effects as links to their pages.
fn linked(sentence: &str, own: &str, ids: &[&str]) -> String {
    let is_of_id = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let mut result = String::new();
    let mut rest = sentence;
    while let Some(start) = rest.find(is_of_id) {
        let after = &rest[start..];
        let word = &after[..after.find(|c| !is_of_id(c)).unwrap_or(after.len())];
        result += &rest[..start];
        match word != own && ids.contains(&word) {
            true => write!(result, "[{word}]({word}.md)").expect("a string"),
            false => result += word,
        }
        rest = &after[word.len()..];
    }
    let sentence = result + rest;
    if sentence.ends_with('.') { sentence } else { sentence + "." }
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or("")
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

/// Text in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn paragraph(text: &str) -> String {
    textwrap::fill(text, lines()) + "\n"
}

/// Lines break between words alone: a break behind a hyphen would cut links.
fn lines() -> textwrap::Options<'static> {
    textwrap::Options::new(WIDTH).word_splitter(textwrap::WordSplitter::NoHyphenation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_work_stands_once_with_its_address_and_its_effects() {
        let work = "Fraser, C. S. (1997): Digital camera self-calibration. ISPRS Journal 52(4). \
                    https://doi.org/10.1016/S0(97)5";
        let effect = |id: &str, literature: &[&str]| json!({ "id": id, "literature": literature });
        let page = references(&[
            effect("one", &[work]),
            effect("two", &[work, "Brown (1966): Lenses."]),
            effect("three", &[]),
        ]);
        let items: Vec<&str> = page.split("\n- ").skip(1).collect();
        assert_eq!(items.len(), 2, "{page}");
        assert_eq!(items[0], "Brown (1966): Lenses. ([two](two.md))");
        assert!(items[1].contains("<https://doi.org/10.1016/S0(97)5>"), "{page}");
        assert!(
            items[1].split_whitespace().collect::<Vec<_>>().join(" ").ends_with("([one](one.md), [two](two.md))"),
            "{page}"
        );
        assert!(page.lines().all(|line| line.len() <= WIDTH), "{page}");
    }
}
