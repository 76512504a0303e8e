//! What an effect leaves unsaid: no law asks for ranges and words, and a diagnosis and its report are the better for
//! them.

use crate::effects::abi::ABI_VERSION;
use crate::effects::{Descriptor, Kind, Role};

/// What an effect that was compiled with this version of `effect.h` could say of itself and does not. Nothing of a mere
/// shape: it has no cause whose sizes and words could be known.
pub fn of(descriptor: &Descriptor, version: u32) -> Vec<String> {
    let mut remarks = Vec::new();
    if descriptor.kind == Kind::Empirical {
        return remarks;
    }
    if version < ABI_VERSION {
        remarks.push(format!(
            "It was compiled with version {version} of effect.h, which has no plausible ranges, words and pictures. \
             Compile it again with version {ABI_VERSION} to state them."
        ));
    }
    let size = |role: &Role| matches!(role, Role::Estimated | Role::Random(_));
    let unbounded = descriptor.parameters.iter().filter(|p| size(&p.role) && p.plausible.is_none());
    let unbounded: Vec<String> = unbounded.map(|p| format!("`{}`", p.name)).collect();
    if !unbounded.is_empty() {
        remarks.push(format!(
            "No plausible range is stated of {}: a diagnosis takes any size for possible. Within and UpTo of \
             effect.h state one.",
            unbounded.join(", ")
        ));
    }
    if descriptor.words.is_none() {
        remarks.push(
            "No words are stated. A report then says neither what the effect is, nor what to do, nor what tells it \
             from similar ones."
                .into(),
        );
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{catalogue, find};

    #[test]
    fn nothing_is_left_unsaid_of_the_catalogue() {
        for effect in catalogue() {
            assert_eq!(of(effect.descriptor(), ABI_VERSION), Vec::<String>::new(), "{}", effect.descriptor().id);
        }
    }

    #[test]
    fn what_is_left_unsaid_is_named() {
        let mut descriptor = find("focal-time").expect("an effect").descriptor().clone();
        descriptor.words = None;
        descriptor.parameters.iter_mut().for_each(|parameter| parameter.plausible = None);
        let [range, words] = &of(&descriptor, ABI_VERSION)[..] else { panic!("two remarks") };
        assert!(range.starts_with("No plausible range is stated of `a`:"), "{range}");
        assert!(words.starts_with("No words are stated"), "{words}");
        let older = of(&descriptor, 2);
        assert!(older.len() == 3 && older[0].contains("version 2 of effect.h"), "{older:?}");
    }
}
