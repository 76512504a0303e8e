//! The reader of models: what it takes can be written and reads back as it was.

use super::folder::{said, with_files};
use misclosure::effects;
use misclosure::io::model::{read_model, write_model};
use misclosure::model::EffectRef;

/// One input.
pub fn run(data: &[u8]) {
    let find = |id: &str| effects::find(id).map(EffectRef::Builtin);
    with_files(&["model.toml"], data, |folder| {
        let path = folder.join("model.toml");
        let model = match read_model(&path, &find) {
            Ok(model) => model,
            Err(error) => return said(error),
        };
        write_model(&model, &path).expect("what was read can be written");
        let copy = read_model(&path, &find).expect("what was written can be read");
        assert_eq!(format!("{copy:?}"), format!("{model:?}"));
    });
}
