//! Part of a block: the images of some flights.

use crate::block::{Block, FlightId, ImageId, Measurement};
use anyhow::{Result, ensure};

/// The images of these flights with their measurements. Points keep their numbers, also those that no image sees any
/// more.
///
/// # Errors
/// A flight that the block does not have.
pub fn only(block: &Block, flights: &[String]) -> Result<Block> {
    for flight in flights {
        ensure!(block.flights.contains(flight), "block `{}` has no flight `{flight}`", block.name);
    }
    let mut part = block.clone();
    part.flights.retain(|flight| flights.contains(flight));
    let mut renumbered: Vec<Option<ImageId>> = Vec::with_capacity(block.images.len());
    part.images.clear();
    for image in &block.images {
        let name = &block.flights[image.flight.index()];
        let flight = part.flights.iter().position(|other| other == name);
        renumbered.push(flight.map(|_| ImageId::from(part.images.len())));
        part.images
            .extend(flight.map(|flight| crate::block::Image { flight: FlightId::from(flight), ..image.clone() }));
    }
    for (_, cells) in &mut part.extra_image_columns {
        let mut kept = renumbered.iter().map(Option::is_some);
        cells.retain(|_| kept.next().unwrap_or(true));
    }
    let keep = |measurements: &[Measurement]| -> Vec<Measurement> {
        let keep = |m: &Measurement| renumbered[m.image.index()].map(|image| Measurement { image, ..*m });
        measurements.iter().filter_map(keep).collect()
    };
    part.ties = keep(&block.ties);
    part.marks = keep(&block.marks);
    Ok(part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn a_part_has_the_images_of_its_flights_and_their_measurements() {
        let overrides = BTreeMap::from([("points".to_string(), 300.0), ("check".to_string(), 20.0)]);
        let block = simulate(&Scenario::preset("dike", &overrides).unwrap(), 1).unwrap().block;
        let part = only(&block, &["nadir30".into(), "nadir70".into()]).unwrap();
        assert_eq!(part.flights, ["nadir30", "nadir70"]);
        assert_eq!(part.images.len(), 12 + 15);
        let measured = |block: &Block, measurements: &[Measurement]| {
            let row = |m: &Measurement| (block.images[m.image.index()].name.clone(), m.point, m.x.to_bits());
            measurements.iter().map(row).collect::<Vec<_>>()
        };
        let mut expected = measured(&block, &block.ties);
        expected.retain(|(image, ..)| part.images.iter().any(|other| other.name == *image));
        assert_eq!(measured(&part, &part.ties), expected);
        assert!(only(&block, &["nadir99".into()]).is_err());
    }
}
