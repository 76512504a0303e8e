//! The ordered registry of built-in effects: catalogue, help and screening follow its order.

use super::*;

static CATALOGUE: &[&dyn Effect] = &[&focal_time::FocalTime, &local_flaw::LocalFlaw, &gnss_lever_arm::GnssLeverArm];

/// Every built-in effect, in catalogue order.
pub fn catalogue() -> &'static [&'static dyn Effect] {
    CATALOGUE
}

/// The built-in effect of an id.
pub fn find(id: &str) -> Option<&'static dyn Effect> {
    catalogue().iter().copied().find(|effect| effect.descriptor().id == id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_keeps_the_laws() {
        let found: Vec<_> = catalogue().iter().flat_map(|effect| laws::check(*effect, 7)).collect();
        assert!(found.is_empty(), "{}", found.iter().map(|v| v.to_string() + "\n").collect::<String>());
    }

    #[test]
    fn ids_are_unique_and_found() {
        laws::unique_ids(catalogue()).unwrap();
        for effect in catalogue() {
            assert_eq!(find(&effect.descriptor().id).unwrap().descriptor(), effect.descriptor());
        }
        assert!(find("no-such-effect").is_none());
    }
}
