//! `misclosure man`: a manual page for each command, made from the command line's own definition.

use super::Answer;
use anyhow::Context;
use clap::CommandFactory;
use serde_json::json;
use std::fs;
use std::path::PathBuf;

/// Writes the manual pages, one for each command, for man(1)
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure man ~/.local/share/man/man1          then: man misclosure-adjust")]
pub struct Arguments {
    /// Folder for the pages
    folder: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    let folder = &arguments.folder;
    fs::create_dir_all(folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let mut pages = Vec::new();
    for (name, page) in pages_of(super::Arguments::command())? {
        let path = folder.join(&name);
        fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
        pages.push(name);
    }
    let text = format!("{} manual pages: {}\n", pages.len(), folder.display());
    Ok(Answer { text, json: json!({ "format": 1, "folder": folder, "pages": pages }), failure: None })
}

/// File name and text of each page: of the program, of its commands, and of theirs.
fn pages_of(program: clap::Command) -> std::io::Result<Vec<(String, String)>> {
    // No pages of `help`, which repeat the others.
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut open = vec![program];
    let mut pages = Vec::new();
    while let Some(command) = open.pop() {
        open.extend(command.get_subcommands().filter(|command| !command.is_hide_set()).cloned());
        let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        // The examples stand in columns: their lines are not to be filled.
        let page = String::from_utf8_lossy(&page).replace(".SH EXTRA\n", ".SH EXTRA\n.nf\n");
        pages.push((format!("{name}.1"), page));
    }
    pages.sort();
    Ok(pages)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_with_its_options() {
        let pages = pages_of(crate::cli::Arguments::command()).expect("pages");
        let page = |name: &str| {
            let found = pages.iter().find(|(file, _)| file == name);
            found.unwrap_or_else(|| panic!("no {name}")).1.as_str()
        };
        assert!(page("misclosure.1").contains("misclosure\\-adjust(1)"));
        assert!(page("misclosure-adjust.1").contains("\\-\\-solver"));
        assert!(page("misclosure-effects-build.1").contains(".nf\nExamples:"));
        assert!(!pages.iter().any(|(name, _)| name.contains("help")), "pages of help repeat the others");
    }
}
