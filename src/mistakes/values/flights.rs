//! Flights as paths in time.

use super::tables::{Image, Tables};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Where the position of an image is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Receiver.
    Gnss,
    /// Approximate projection centre.
    Approximate,
}

/// An image that has a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Exposure time, s.
    pub time: f64,
    /// Position, m.
    pub position: Vector3<f64>,
    /// Velocity of the platform as stated, m/s.
    pub velocity: Option<Vector3<f64>>,
}

/// Images of each camera in each flight that have a time, in the order of the file. GNSS positions come from paths
/// alone that have one at each of these images: two sources on one path may be two systems.
pub fn paths(tables: &Tables, source: Source) -> Vec<Vec<Place>> {
    let mut own: BTreeMap<(usize, usize), Vec<&Image>> = BTreeMap::new();
    let timed = tables.images.iter().filter(|image| image.time_s.is_some_and(f64::is_finite));
    timed.for_each(|image| own.entry((image.flight, image.camera)).or_default().push(image));
    let place = |image: &&Image| {
        let position = match source {
            Source::Gnss => image.gnss?,
            Source::Approximate => image.centre,
        };
        Some(Place { time: image.time_s?, position, velocity: image.velocity })
    };
    let complete = |images: &Vec<&Image>| images.iter().map(place).collect::<Option<Vec<Place>>>();
    own.values().filter_map(complete).filter(|path| path.len() > 1).collect()
}

/// The same path in the order of time.
pub fn by_time(path: &[Place]) -> Vec<Place> {
    let mut sorted = path.to_vec();
    sorted.sort_by(|a, b| a.time.total_cmp(&b.time));
    sorted
}

/// Length of a path, m.
pub fn length(path: &[Place]) -> f64 {
    path.windows(2).map(|pair| (pair[1].position - pair[0].position).norm()).sum()
}

/// Which source the positions of a block are taken from: the receiver's, where there are any.
pub fn source(tables: &Tables) -> Source {
    let gnss = tables.images.iter().any(|image| image.gnss.is_some());
    if gnss { Source::Gnss } else { Source::Approximate }
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    #[test]
    fn paths_are_of_one_source_in_one_flight() {
        let mut tables = made::with_images(made::images(20));
        assert_eq!(source(&tables), Source::Approximate);
        let paths_of = |tables: &Tables, source| paths(tables, source).iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(paths_of(&tables, Source::Approximate), [20]);
        tables.images[3].gnss = Some(Vector3::zeros());
        assert_eq!(source(&tables), Source::Gnss);
        assert!(paths_of(&tables, Source::Gnss).is_empty());
        tables.images[3].flight = 1;
        tables.images[4].flight = 1;
        tables.images[4].gnss = Some(Vector3::zeros());
        assert_eq!(paths_of(&tables, Source::Gnss), [2]);
    }

    #[test]
    fn the_order_of_time_is_another_one_than_that_of_the_file() {
        let mut tables = made::with_images(made::images(10));
        assert!((length(&paths(&tables, Source::Approximate)[0]) - 90.0).abs() < 1e-9);
        tables.images.swap(2, 7);
        let path = &paths(&tables, Source::Approximate)[0];
        assert!(length(path) > 100.0);
        assert!((length(&by_time(path)) - 90.0).abs() < 1e-9);
    }
}
