//! Commands that a page shows, and the lines that it says they print.

/// Commands of the code blocks that begin with one, each with the lines that it is said to print.
pub fn commands(text: &str) -> Vec<(String, Vec<String>)> {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    // Between fences: whether the block is one of commands, once its first line is known.
    let mut block: Option<Option<bool>> = None;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            block = if block.is_some() { None } else { Some(None) };
            continue;
        }
        let Some(of_commands) = &mut block else { continue };
        if !*of_commands.get_or_insert(line.starts_with("$ ")) {
            continue;
        }
        match (line.strip_prefix("$ "), found.last_mut()) {
            (Some(command), _) => found.push((command.to_owned(), Vec::new())),
            (None, Some((_, printed))) => printed.push(line.to_owned()),
            (None, None) => unreachable!("the block begins with a command"),
        }
    }
    found
}

/// The lines stand in what was printed, in their order; `...` is any number of lines, or the rest of one. Spaces do not
/// count. Of a command without lines nothing is asked.
pub fn compare(expected: &[String], printed: &str) -> Result<(), String> {
    let plain = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut lines = printed.lines().map(plain).filter(|line| !line.is_empty());
    let expected: Vec<String> = expected.iter().map(|line| plain(line)).filter(|line| !line.is_empty()).collect();
    let mut skips = expected.is_empty();
    for line in expected {
        if line == "..." {
            skips = true;
            continue;
        }
        let (start, open) = line.strip_suffix("...").map_or((line.as_str(), false), |start| (start.trim_end(), true));
        let fits = |found: &String| if open { found.starts_with(start) } else { found == start };
        let met = if skips { lines.any(|found| fits(&found)) } else { lines.next().is_some_and(|found| fits(&found)) };
        if !met {
            return Err(format!("`{line}` is not where the text has it, in:\n{printed}"));
        }
        skips = false;
    }
    match lines.next() {
        Some(more) if !skips => Err(format!("`{more}` is printed, and the text does not have it")),
        _ => Ok(()),
    }
}
