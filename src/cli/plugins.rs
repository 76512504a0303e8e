//! Effects of shared libraries: loaded, and named where they gave no values.

use super::Usage;
use super::console::printable;
use super::text::path_text;
use crate::block::{Block, Measurement};
use crate::effects::{Descriptor, Effect, plugin};
use crate::faults;
use crate::model::EffectRef;
use std::path::PathBuf;
use std::sync::Arc;

/// The error of a command, with what a plug-in did where it gave no values: which, at which stage, in which image,
/// near which point.
pub(super) fn with_faults<'a>(
    error: anyhow::Error,
    effects: impl IntoIterator<Item = &'a EffectRef>,
    block: &Block,
) -> anyhow::Error {
    let faults: Vec<String> = effects.into_iter().filter_map(|effect| fault(effect, block)).collect();
    if faults.is_empty() { error } else { error.context(faults.join("; ")) }
}

fn fault(effect: &EffectRef, block: &Block) -> Option<String> {
    let plugin::Fault { what, image, place: [x, y] } = effect.take_fault()?;
    let Descriptor { id, stage, .. } = effect.descriptor();
    let path = effect.origin().map_or_else(String::new, |origin| format!("{}: ", origin.path.display()));
    let mut text = format!("{path}effect `{id}` ({} stage) {what}", stage.name());
    if let Some(of) = block.images.get(image as usize) {
        text += &format!(", in image `{}`", of.name);
        let distance = |m: &Measurement| (m.x - x).hypot(m.y - y);
        let of_image = |m: &&Measurement| m.image.index() == image as usize && distance(m).is_finite();
        let ties = block.ties.iter().filter(of_image).map(|m| (m, &block.tie_points[m.point.index()].name));
        let marks = block.marks.iter().filter(of_image).map(|m| (m, &block.surveyed[m.point.index()].name));
        if let Some((_, point)) = ties.chain(marks).min_by(|a, b| distance(a.0).total_cmp(&distance(b.0))) {
            text += &format!(" near point `{point}`");
        }
    }
    Some(text)
}

/// Says who it was where one of these libraries crashes the program or ends it, from now on.
pub(super) fn suspect(libraries: &[PathBuf]) {
    let names: Vec<String> = libraries.iter().map(|path| printable(&path_text(path))).collect();
    faults::suspect(names.join(", "));
}

/// The effects of shared libraries, no two of one id.
pub(super) fn load_plugins(paths: &[PathBuf]) -> anyhow::Result<Vec<Arc<dyn Effect>>> {
    let mut plugins: Vec<Arc<dyn Effect>> = Vec::new();
    if !paths.is_empty() {
        suspect(paths);
    }
    for path in paths {
        let effect = plugin::load(path)?;
        let id = &effect.descriptor().id;
        if plugins.iter().any(|other| other.descriptor().id == *id) {
            return Err(Usage(format!("--plugin {}: there is an effect `{id}` already", path.display())).into());
        }
        plugins.push(effect);
    }
    Ok(plugins)
}
