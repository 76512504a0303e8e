//! Options that one always gives, from a file of the user.
//!
//! ```toml
//! threads = 2                   # options of every command
//!
//! [improve]                     # of one command, by their long names
//! tie = "dc=pp"
//! fix = ["affinity", "k3"]      # an option that may be repeated
//! multistart = true             # a flag
//!
//! [effects.check]               # of a command of a command
//! quiet = true
//! ```
//!
//! They are appended to the command line, so that a run records them as if they had been typed. One that was typed, or
//! that excludes one that was typed, stays out.

use crate::io::Error;
use crate::io::toml_table::{Placed, Source, Table};
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command};
use std::env;
use std::ffi::OsString;
use std::path::PathBuf;
use toml::de::{DeTable, DeValue};

/// Names another file than the user's own; empty, it stands for none.
const VARIABLE: &str = "MISCLOSURE_CONFIG";
/// Below the folder of the user's settings.
const FILE: &str = "misclosure/config.toml";
/// What clap adds to every command.
const NO_OPTIONS: [&str; 2] = ["help", "version"];

/// The command line `typed`, with what the user's file adds to the options of `program`.
///
/// # Errors
/// With file, line and column: no TOML, an unknown command or option, a value that the option refuses.
pub fn complete(mut typed: Vec<OsString>, mut program: Command) -> Result<Vec<OsString>, Error> {
    let Some(path) = file() else { return Ok(typed) };
    program.build();
    // What is wrong with the command line the parser says afterwards; help needs no file.
    let given = program.clone().ignore_errors(true).try_get_matches_from(&typed).unwrap_or_else(|help| help.exit());
    let name = path.display().to_string();
    let source = Source::read(&path, name, &format!("{VARIABLE} names it; an empty {VARIABLE} means no file"))?;
    let root = source.parse()?;
    let mut added = Vec::new();
    add(&source, "the file", root.get_ref(), &program, Some(&given), &mut added)?;
    // Behind `--` everything is a file or a name.
    let end = typed.iter().position(|word| word == "--").unwrap_or(typed.len());
    typed.splice(end..end, added.into_iter().map(OsString::from));
    Ok(typed)
}

/// The file, if there is one.
fn file() -> Option<PathBuf> {
    let folder = |name: &str| env::var_os(name).map(PathBuf::from).filter(|folder| folder.is_absolute());
    match env::var_os(VARIABLE) {
        Some(named) => (!named.is_empty()).then(|| named.into()),
        None => {
            let settings = folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?;
            Some(settings.join(FILE)).filter(|file| file.exists())
        }
    }
}

/// Checks a table of the file, and adds the options that apply. `given` is what was typed of this command, if it is the
/// one that runs. Options of a command come before those of the program, which they replace.
fn add(
    source: &Source,
    name: &str,
    entries: &DeTable<'_>,
    command: &Command,
    given: Option<&ArgMatches>,
    added: &mut Vec<String>,
) -> Result<(), Error> {
    let options = command.get_arguments().filter_map(Arg::get_long).filter(|name| !NO_OPTIONS.contains(name));
    let known: Vec<&str> = command.get_subcommands().map(Command::get_name).chain(options).collect();
    let table = Table::new(source, name, entries, &known)?;
    let (commands, options): (Vec<Placed>, Vec<Placed>) =
        table.keys().into_iter().partition(|(key, _)| command.find_subcommand(key).is_some());
    for (key, _) in commands {
        let (Some(inner), Some((entries, _))) = (command.find_subcommand(key), table.table(key)?) else { continue };
        let of_inner = given.and_then(ArgMatches::subcommand).filter(|(name, _)| *name == key).map(|(_, own)| own);
        add(source, &format!("[{key}]"), entries, inner, of_inner, added)?;
    }
    for (key, _) in options {
        let Some(option) = command.get_arguments().find(|option| option.get_long() == Some(key)) else { continue };
        let words = words(source, &table, key, option, command)?;
        let there = |word: &String| word.split('=').next() == Some(&format!("--{key}"));
        // Clap knows one direction of an exclusion.
        let excludes =
            |a: &Arg, b: &Arg| command.get_arg_conflicts_with(a).iter().any(|own| own.get_id() == b.get_id());
        let typed = |given: &ArgMatches| {
            let is_typed = |own: &&Arg| given.value_source(own.get_id().as_str()) == Some(ValueSource::CommandLine);
            let against = |own: &Arg| own == option || excludes(own, option) || excludes(option, own);
            command.get_arguments().filter(is_typed).any(against)
        };
        if given.is_some_and(|given| !typed(given)) && !added.iter().any(there) {
            added.extend(words);
        }
    }
    Ok(())
}

/// Words of the command line that give an option its value.
fn words(source: &Source, table: &Table<'_>, key: &str, option: &Arg, command: &Command) -> Result<Vec<String>, Error> {
    let Some(value) = table.value(key) else { return Ok(Vec::new()) };
    let is_flag = !option.get_action().takes_values();
    let word = |value: &DeValue<'_>| match value {
        DeValue::Boolean(is_set) if is_flag => Some(if *is_set { format!("--{key}") } else { String::new() }),
        DeValue::String(text) if !is_flag => Some(format!("--{key}={text}")),
        DeValue::Integer(number) if !is_flag => Some(format!("--{key}={number}")),
        DeValue::Float(number) if !is_flag => Some(format!("--{key}={number}")),
        _ => None,
    };
    let (words, expected): (Option<Vec<String>>, _) = match (value.get_ref(), option.get_action()) {
        (DeValue::Array(list), ArgAction::Append) => (list.iter().map(|own| word(own.get_ref())).collect(), "a list"),
        (one, ArgAction::Append) => (word(one).map(|word| vec![word]), "a text, a number or a list of them"),
        (one, _) => (word(one).map(|word| vec![word]), if is_flag { "true or false" } else { "a text or a number" }),
    };
    let Some(mut words) = words else { return Err(table.refuse(key, value, expected)) };
    words.retain(|word| !word.is_empty());
    // The command's own parser knows the values; that others are missing is another matter.
    let line = std::iter::once(command.get_name().to_owned()).chain(words.iter().cloned());
    match command.clone().ignore_errors(false).try_get_matches_from(line) {
        Err(error) if matches!(error.kind(), ErrorKind::InvalidValue | ErrorKind::ValueValidation) => {
            let said = error.to_string();
            let lines = said.lines().take_while(|line| !line.is_empty()).map(str::trim);
            let problem = lines.collect::<Vec<_>>().join(" ");
            Err(source.refuse(&value.span(), problem.trim_start_matches("error: ")))
        }
        _ => Ok(words),
    }
}
