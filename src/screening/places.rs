//! What values alone say of where surveyed positions lie, beside what the network of tie points says of them.

use crate::mistakes::Mistake;
use crate::mistakes::values::Places;

const OTHER_FRAME: &str = "other-frame";

/// Both in one list. The network is believed where both find groups that lie apart; its other findings on a group that
/// is far away follow from that.
pub fn with_network(places: Places, mut of_network: Vec<Mistake>) -> Vec<Mistake> {
    let Places { mut far, below } = places;
    let tells = of_network.iter().any(|own| own.kind == OTHER_FRAME);
    far.retain(|own| own.kind != OTHER_FRAME || !tells);
    if !far.is_empty() {
        of_network.retain(|own| own.kind != OTHER_FRAME && far.iter().all(|other| other.subject != own.subject));
    }
    // Heights below zero and cameras below their points say more than the offset that both make.
    let is_reversed = far.is_empty() && below.as_ref().is_some_and(|own| own.kind == "axis-reversed");
    of_network.retain(|own| own.kind != "height-offset" || !is_reversed);
    let is_surveyed = |own: &Mistake| ["control", "check", "gnss"].contains(&own.subject.as_str());
    // Heights that the network can judge it judges better.
    let silent = far.is_empty() && !of_network.iter().any(is_surveyed);
    far.into_iter().chain(of_network).chain(below.filter(|_| silent)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mistake(kind: &str, subject: &str) -> Mistake {
        Mistake::new(kind, subject, String::new(), String::new())
    }

    fn kinds(places: Places, of_network: Vec<Mistake>) -> Vec<String> {
        with_network(places, of_network).into_iter().map(|own| format!("{} {}", own.kind, own.subject)).collect()
    }

    #[test]
    fn the_network_goes_before_except_for_what_it_cannot_know() {
        let far = |kind: &str| Places { far: vec![mistake(kind, "control")], below: None };
        let network =
            || vec![mistake("rotation", "control"), mistake("other-frame", "check"), mistake("time", "images")];
        assert_eq!(kinds(far("other-frame"), network()), ["rotation control", "other-frame check", "time images"]);
        assert_eq!(kinds(far("geographic"), network()), ["geographic control", "time images"]);
        let below = || Places { far: Vec::new(), below: Some(mistake("height-offset", "control")) };
        assert_eq!(kinds(below(), Vec::new()), ["height-offset control"]);
        assert_eq!(kinds(below(), vec![mistake("height-scale", "gnss")]), ["height-scale gnss"]);
        let reversed = Places { far: Vec::new(), below: Some(mistake("axis-reversed", "gnss")) };
        assert_eq!(kinds(reversed, vec![mistake("height-offset", "control")]), ["axis-reversed gnss"]);
    }
}
