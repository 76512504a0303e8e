//! `misclosure completions`: what a shell completes, made from the command line's own definition.

use super::Answer;
use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;
use serde_json::json;
use std::io::{ErrorKind, Write};

/// Prints a script with which a shell completes commands and options
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure completions bash > ~/.local/share/bash-completion/completions/misclosure
  misclosure completions zsh > ~/.zfunc/_misclosure                 with ~/.zfunc in fpath
  misclosure completions fish > ~/.config/fish/completions/misclosure.fish")]
pub struct Arguments {
    /// Shell
    shell: Shell,
}

/// Runs the command.
pub fn run(arguments: &Arguments, as_json: bool) -> anyhow::Result<Answer> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "misclosure", &mut script);
    if as_json {
        let script = String::from_utf8(script)?;
        let json = json!({ "format": 1, "shell": arguments.shell.to_string(), "script": script });
        return Ok(Answer { json, ..Answer::default() });
    }
    // Tabs and escapes as they are: an answer's text has none.
    let mut out = std::io::stdout().lock();
    match out.write_all(&script).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("cannot write to standard output"),
        _ => Ok(Answer::default()),
    }
}
