//! What an effect says of itself beside its formula: plausible ranges, words and the picture. None has to be stated;
//! those that are have to be sound.

use crate::effects::{Descriptor, Parameter, Role};

/// A plausible range belongs to a size, has its source, and holds the nominal and the typical value.
pub(super) fn range(parameter: &Parameter) -> Result<(), String> {
    let Some(range) = &parameter.plausible else { return Ok(()) };
    if !matches!(parameter.role, Role::Estimated | Role::Random(_)) {
        return Err("only what is estimated or random has a plausible range, not what is given or searched".into());
    }
    let holds = |value: f64| (range.min..=range.max).contains(&value);
    if !(holds(parameter.nominal) && holds(parameter.typical)) || range.source.trim().is_empty() {
        return Err("the plausible range has its source, and nominal and typical value lie in it".into());
    }
    Ok(())
}

/// Words are all stated, or none.
pub(super) fn words(descriptor: &Descriptor) -> Result<(), String> {
    let Some(words) = &descriptor.words else { return Ok(()) };
    for (name, text) in [("what", &words.what), ("remedy", &words.remedy), ("tell", &words.tell)] {
        if text.trim().is_empty() {
            return Err(format!("of its words `{name}` is empty"));
        }
    }
    Ok(())
}

/// The picture shows residuals that the stage can move.
pub(super) fn picture(descriptor: &Descriptor) -> Result<(), String> {
    let Descriptor { picture, stage, .. } = descriptor;
    if picture.suits(*stage) {
        return Ok(());
    }
    Err(format!("its picture ({picture}) shows residuals that the {} stage does not move", stage.name()))
}
