//! What the Python package does as the program does it. No stable interface: other programs call the library.

pub use super::adjust::{Adjusted, adjust};
pub use super::check::as_json as contents_json;
pub use super::diagnose::{Asked, Found, find};
pub use super::diagnosis_text::text as diagnosis_text;
pub use super::exit::{Bent, Disagreement, Exit, Usage};
pub use super::host::Host;
pub use super::mend::{Mended, mend};
pub use super::mistakes::{SIGNIFICANCE, of_block};
pub use super::model_options::ModelOptions;
pub use super::output::Output;
pub use super::plan::{PlanOptions, error_free};
pub use super::summary_text::text as summary_text;
pub use super::{error_chain, run_line};

use super::plugins::load_plugins;
use super::words::effect_term;
use crate::effects::Effect;
use crate::model::{EffectRef, EffectTerm};
use clap::Parser;
use std::path::PathBuf;
use std::sync::Arc;

/// Reads options as the command line does.
///
/// # Errors
/// [`Usage`], with the program's text.
pub fn options<O: clap::Args>(words: &[String]) -> Result<O, Usage> {
    #[derive(Debug, Parser)]
    #[command(name = "misclosure", no_binary_name = true)]
    struct Line<O: clap::Args> {
        #[command(flatten)]
        options: O,
    }
    let refused = |error: clap::Error| {
        let text = error.to_string();
        // What follows a blank line is how to call the program.
        let reason = text.split("\n\nUsage:").next().unwrap_or_default();
        let reason = reason.split("\n\nFor more information").next().unwrap_or_default();
        Usage(reason.trim_start_matches("error: ").trim_end().to_owned())
    };
    Line::try_parse_from(words).map(|line| line.options).map_err(refused)
}

/// The effects of shared libraries, no two of one id.
///
/// # Errors
/// A library that is no plug-in; an id that is taken.
pub fn plugins(paths: &[PathBuf]) -> anyhow::Result<Vec<Arc<dyn Effect>>> {
    load_plugins(paths)
}

/// One of `plugins` with its values, from `ID:parameter=value,...`.
///
/// # Errors
/// [`Usage`]: an effect or a parameter that is not there, a value that is none.
pub fn term(text: &str, plugins: &[EffectRef]) -> Result<EffectTerm, Usage> {
    let find = |id: &str| plugins.iter().find(|effect| effect.descriptor().id == id).cloned();
    effect_term("errors", text, &find)
}
