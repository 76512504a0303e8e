//! `misclosure effects`: the catalogue, and the kit for an effect of one's own.

mod build;
mod catalogue;
mod check;
mod new;
mod pages;

use super::{Answer, Console};
use crate::effects;
use crate::kit::reference;
use anyhow::Context;
use std::fs;
use std::path::{Path, PathBuf};

/// Lists the effects that a model can have, describes one, or helps to write one of your own
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
#[command(after_help = "Examples:
  misclosure effects                                        the catalogue
  misclosure effects rolling-shutter                        one effect's page
  misclosure effects --json                                 the catalogue for a program
  misclosure effects book docs/effects                      the pages of the book
  misclosure effects new sensor-pattern --stage image       a template for an effect of your own: sensor-pattern.h
  misclosure effects build sensor-pattern.h -o sensor-pattern.so
  misclosure effects check sensor-pattern.so                does it keep the laws?
  misclosure improve BLOCK -o RUN --plugin sensor-pattern.so")]
pub struct Arguments {
    /// Effect to describe
    id: Option<String>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    New(new::Arguments),
    Build(build::Arguments),
    Check(check::Arguments),
    /// Prints the reference page of effect.h, in Markdown
    #[command(after_help = "Examples:\n  misclosure effects reference > effect-header.md")]
    Reference,
    /// Writes a page of the book for each effect of the catalogue, in Markdown
    #[command(after_help = "Examples:\n  misclosure effects book docs/effects")]
    Book {
        /// Folder of the pages; a picture ID.svg that lies there stands on the page of its effect
        folder: PathBuf,
    },
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console) -> anyhow::Result<Answer> {
    match &arguments.command {
        None => catalogue::run(arguments.id.as_deref()),
        Some(Command::New(arguments)) => new::run(arguments),
        Some(Command::Build(arguments)) => build::run(arguments, console),
        Some(Command::Check(arguments)) => check::run(arguments),
        Some(Command::Reference) => {
            let page = reference::page();
            let json = serde_json::json!({ "format": 1, "markdown": page });
            Ok(Answer { text: page, json, failure: None })
        }
        Some(Command::Book { folder }) => book(folder),
    }
}

/// Writes the pages of the catalogue.
fn book(folder: &Path) -> anyhow::Result<Answer> {
    let catalogue = catalogue::run(None)?.json;
    let effects = catalogue["effects"].as_array().map_or(&[][..], Vec::as_slice);
    fs::create_dir_all(folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let pages = pages::pages(effects, |id| folder.join(format!("{id}.svg")).is_file());
    for (name, page) in &pages {
        let path = folder.join(name);
        fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
    let json = serde_json::json!({ "format": 1, "folder": folder, "pages": names });
    Ok(Answer { text: format!("{} pages: {}\n", pages.len(), folder.display()), json, failure: None })
}

/// What to say about an id that the catalogue does not have.
pub(super) fn unknown(id: &str) -> String {
    let known: Vec<String> = effects::catalogue().iter().map(|effect| effect.descriptor().id.to_string()).collect();
    format!("unknown effect `{id}`; the catalogue has: {}", known.join(", "))
}
