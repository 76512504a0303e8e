//! The reference page of `effect.h`, made from the header itself: what is not in its comments is not on the page.

use super::headers::HEADERS;

/// Where the part ends that an effect's author uses.
const END: &str = "from Apply to the C ABI";

/// The page, in Markdown.
pub fn page() -> String {
    let header = HEADERS[0].1;
    let body = header.split(END).next().unwrap_or(header);
    let mut text = String::from(
        "# effect.h\n\nMade from the header by `misclosure effects reference`. How to use it: \
         [effects-of-your-own.md]; what it does not cover: \
         [what-an-effect-is-not.md].\n\n\
         [effects-of-your-own.md]: effects-of-your-own.md\n[what-an-effect-is-not.md]: what-an-effect-is-not.md\n\n",
    );
    let (front, rest) = body.split_once("#ifndef").unwrap_or((body, ""));
    text += &prose(&comment(front.lines()));
    text += "\n## Laws\n\n`misclosure effects check` holds a plug-in against each:\n\n| law | what it asks for \
             |\n|---|---|\n";
    for (law, asks) in super::check::LAWS {
        text += &format!("| {law} | {asks} |\n");
    }
    let mut remark: Vec<&str> = Vec::new();
    let mut lines = rest.lines().peekable();
    while let Some(line) = lines.next() {
        let trimmed = line.trim();
        if let Some(comment) = trimmed.strip_prefix("// ").filter(|comment| !comment.starts_with("---")) {
            remark.push(comment);
            continue;
        }
        if trimmed == "//" {
            remark.push("");
            continue;
        }
        let mut until = |end: &str| -> Vec<&str> {
            let mut inside = vec![line];
            while !inside.last().is_some_and(|line| line.contains(end)) {
                match lines.next() {
                    Some(line) => inside.push(line),
                    None => break,
                }
            }
            inside
        };
        let said = prose(&remark);
        if let Some(name) = trimmed.strip_prefix("typedef struct ").and_then(|rest| rest.split(' ').next()) {
            text += &format!("\n## {name}\n\n{said}\n{}", fields(&until("} misclosure_")));
        } else if let Some(rest) = trimmed.strip_prefix("enum class ") {
            let name = rest.split([' ', ':']).next().unwrap_or(rest);
            text += &format!("\n## {name}\n\n{said}\n{}", members(&until("};")));
        } else if trimmed.starts_with("typedef int (*misclosure_eval)") {
            text += &format!("\n## misclosure_eval\n\n{said}\n```c\n{}\n```\n", until(";").join("\n"));
        } else if trimmed.starts_with("#define MISCLOSURE_") && trimmed.split_whitespace().count() > 2 {
            let (definition, why) = trimmed.split_once("//").unwrap_or((trimmed, ""));
            let words: Vec<&str> = definition.split_whitespace().collect();
            let why = if why.is_empty() { String::new() } else { format!(": {}", why.trim()) };
            let heading = words[1].trim_start_matches("MISCLOSURE_").to_lowercase();
            let heading = if heading == "abi_version" { "Version" } else { "Answers" };
            let said = if said.is_empty() { said } else { format!("\n## {heading}\n\n{said}\n") };
            text += &format!("{said}- `{}` = {}{why}\n", words[1], words[2].trim_end_matches('u'));
        } else if trimmed.starts_with("constexpr Parameter ") {
            let signature = until("{").join(" ");
            let signature = signature.split('{').next().unwrap_or_default();
            let words: Vec<&str> = signature.split_whitespace().skip(1).collect();
            text += &format!(
                "{}- `{}`\n",
                if said.is_empty() { String::new() } else { format!("\n## Making parameters\n\n{said}\n") },
                words.join(" ")
            );
        }
        remark.clear();
    }
    text
}

/// The text of comment lines; a bare `//` divides paragraphs.
fn comment<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    lines.filter_map(|line| line.strip_prefix("//")).map(|line| line.strip_prefix(' ').unwrap_or(line)).collect()
}

/// Paragraphs in Markdown; what is indented is code.
fn prose(lines: &[&str]) -> String {
    let mut text = String::new();
    let mut code = false;
    for line in lines {
        let is_code = line.starts_with("  ") || line.starts_with('\t');
        if is_code != code && !line.is_empty() {
            // The empty line before it stands after the end of code.
            text.truncate(text.trim_end().len());
            text += if is_code { "\n\n```cpp\n" } else { "\n```\n\n" };
            code = is_code;
        }
        text += line.strip_prefix("  ").unwrap_or(line);
        text.push('\n');
    }
    if code {
        text += "```\n";
    }
    text
}

/// A table of a struct's fields; a comment that stands alone in its line goes on with the one before.
fn fields(lines: &[&str]) -> String {
    let mut rows: Vec<(String, String)> = Vec::new();
    for line in lines.iter().skip(1).take(lines.len().saturating_sub(2)) {
        let (code, comment) = line.split_once("//").map_or((*line, ""), |(code, comment)| (code, comment.trim()));
        let code = code.trim().trim_end_matches(';');
        if code.is_empty() {
            if let Some((_, last)) = rows.last_mut() {
                *last += &format!(" {comment}");
            }
        } else {
            rows.push((code.to_owned(), comment.to_owned()));
        }
    }
    let mut text = String::from("| field | meaning |\n|---|---|\n");
    for (code, meaning) in rows {
        text += &format!("| `{code}` | {} |\n", meaning.replace('|', "\\|"));
    }
    text
}

/// The members of an enum with their values.
fn members(lines: &[&str]) -> String {
    let mut text = String::from("| member | value | meaning |\n|---|---|---|\n");
    for line in lines {
        let (code, meaning) = line.split_once("//").map_or((*line, ""), |(code, comment)| (code, comment.trim()));
        let inside =
            code.split(['{', '}']).find(|part| part.contains(" = k") || part.contains('=')).unwrap_or_default();
        for member in inside.split(',').filter(|member| member.contains('=')) {
            if let Some((name, value)) = member.split_once('=') {
                text += &format!("| `{}` | {} | {meaning} |\n", name.trim(), value.trim());
            }
        }
    }
    text
}
