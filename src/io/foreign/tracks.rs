//! Tie points as programs keep them: gathered by point ([`Tracks`]), or as matches of two images each ([`Matches`]).

use super::Note;
use crate::block::{ImageId, Measurement, PointId, TiePoint};
use nalgebra::Vector3;
use std::collections::HashMap;

/// Tie points and their measurements, gathered in any order.
#[derive(Debug, Clone, Default)]
pub struct Tracks {
    points: Vec<TiePoint>,
    ties: Vec<Measurement>,
}

impl Tracks {
    /// Adds a point, under a name that no other has.
    pub fn point(&mut self, name: impl Into<String>, position: Option<Vector3<f64>>) -> PointId {
        self.points.push(TiePoint { name: name.into(), position });
        PointId::from(self.points.len() - 1)
    }

    /// Adds a measurement, px from the outer corner of the top-left pixel.
    pub fn measure(&mut self, image: ImageId, point: PointId, [x, y]: [f64; 2]) {
        self.ties.push(Measurement { image, point, x, y, sigma: None });
    }

    /// Adds a measurement with everything that is known of it.
    pub fn push(&mut self, tie: Measurement) {
        self.ties.push(tie);
    }

    /// The measurements so far, in the order in which they came.
    pub fn measurements(&self) -> &[Measurement] {
        &self.ties
    }

    /// Changes each measurement, and leaves out those of which `change` says no.
    pub fn change_measurements(&mut self, change: impl FnMut(&mut Measurement) -> bool) {
        self.ties.retain_mut(change);
    }

    /// The points that intersect, with their measurements in the order in which they came. What is left out is said: a
    /// point at two places of one image (which of them it is, nobody knows), and points with fewer than two images.
    pub fn finish(self, notes: &mut Vec<Note>) -> (Vec<TiePoint>, Vec<Measurement>) {
        let Self { mut points, mut ties } = self;
        let ambiguous = ambiguous(&ties);
        let repeated = ambiguous.iter().filter(|ambiguous| **ambiguous).count();
        let mut is_ambiguous = ambiguous.iter();
        ties.retain(|_| is_ambiguous.next() == Some(&false));
        let mut rays = vec![0u32; points.len()];
        ties.iter().for_each(|tie| rays[tie.point.index()] += 1);
        let mut kept = 0;
        let renumbered: Vec<Option<PointId>> = rays
            .iter()
            .map(|rays| {
                (*rays >= 2).then(|| {
                    kept += 1;
                    PointId::from(kept - 1)
                })
            })
            .collect();
        let lone = points.len() - kept;
        ties.retain_mut(|tie| match renumbered[tie.point.index()] {
            Some(point) => {
                tie.point = point;
                true
            }
            None => false,
        });
        let mut number = renumbered.iter();
        points.retain(|_| number.next().is_some_and(Option::is_some));
        if repeated > 0 {
            notes.push(Note::loss(format!(
                "{repeated} measurements are left out: their point is measured more than once in the image"
            )));
        }
        if lone > 0 {
            notes.push(Note::loss(format!("{lone} tie points are left out: fewer than two images measure them")));
        }
        (points, ties)
    }
}

/// Of each measurement: is its point measured at another place of the same image too, or was it measured there before?
fn ambiguous(ties: &[Measurement]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..ties.len()).collect();
    order.sort_unstable_by_key(|k| (ties[*k].point, ties[*k].image, *k));
    let mut ambiguous = vec![false; ties.len()];
    for group in order.chunk_by(|a, b| (ties[*a].point, ties[*a].image) == (ties[*b].point, ties[*b].image)) {
        let place = |k: usize| (ties[k].x, ties[k].y);
        let same = group.iter().all(|k| place(*k) == place(group[0]));
        group[usize::from(same)..].iter().filter(|_| group.len() > 1).for_each(|k| ambiguous[*k] = true);
    }
    ambiguous
}

/// A place in an image that was matched, px from the outer corner of the top-left pixel.
#[derive(Debug, Clone, Copy)]
pub struct Feature {
    /// Image.
    pub image: ImageId,
    /// Place, px.
    pub xy: [f64; 2],
}

/// Matches of two images each. Places of one image that are equal to the last bit are one feature.
#[derive(Debug, Clone, Default)]
pub struct Matches {
    features: Vec<Feature>,
    numbers: HashMap<(ImageId, [u64; 2]), u32>,
    /// Towards the feature that stands for the whole track.
    parents: Vec<u32>,
}

impl Matches {
    /// Adds a match.
    pub fn pair(&mut self, a: Feature, b: Feature) {
        let (a, b) = (self.number(a), self.number(b));
        let (a, b) = (self.root(a), self.root(b));
        // The earlier one stands for both: tracks keep the order in which they came.
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// The tracks, named by number. One with two places in an image holds a false match, and nobody knows which: it is
    /// left out, which is said.
    pub fn into_tracks(mut self, notes: &mut Vec<Note>) -> Tracks {
        let mut members: Vec<(u32, u32)> = (0..self.parents.len() as u32).map(|k| (self.root(k), k)).collect();
        members.sort_unstable();
        let mut tracks = Tracks::default();
        let mut contradictory = 0;
        for track in members.chunk_by(|a, b| a.0 == b.0) {
            let mut images: Vec<ImageId> = track.iter().map(|(_, k)| self.features[*k as usize].image).collect();
            images.sort_unstable();
            if images.windows(2).any(|pair| pair[0] == pair[1]) {
                contradictory += 1;
                continue;
            }
            let point = tracks.point((tracks.points.len() + 1).to_string(), None);
            for (_, k) in track {
                let Feature { image, xy } = self.features[*k as usize];
                tracks.measure(image, point, xy);
            }
        }
        if contradictory > 0 {
            notes.push(Note::loss(format!(
                "{contradictory} tracks are left out: their matches lead to two places of one image"
            )));
        }
        tracks
    }

    fn number(&mut self, feature: Feature) -> u32 {
        let next = self.features.len() as u32;
        let number = *self.numbers.entry((feature.image, feature.xy.map(f64::to_bits))).or_insert(next);
        if number == next {
            self.features.push(feature);
            self.parents.push(next);
        }
        number
    }

    /// The feature that stands for the track of `k`; ways that were gone are halved.
    fn root(&mut self, mut k: u32) -> u32 {
        while self.parents[k as usize] != k {
            self.parents[k as usize] = self.parents[self.parents[k as usize] as usize];
            k = self.parents[k as usize];
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(image: u32, x: f64) -> Feature {
        Feature { image: ImageId(image), xy: [x, 0.0] }
    }

    #[test]
    fn what_nobody_can_tell_apart_is_left_out_and_said() {
        let mut tracks = Tracks::default();
        let [a, b, c] = ["a", "b", "c"].map(|name| tracks.point(name, None));
        for (image, point, x) in [(0, a, 1.0), (1, a, 2.0), (2, a, 3.0), (2, a, 4.0), (0, b, 1.0), (0, c, 5.0)] {
            tracks.measure(ImageId(image), point, [x, 0.0]);
        }
        // The same once more is no contradiction.
        tracks.measure(ImageId(1), a, [2.0, 0.0]);
        tracks.measure(ImageId(1), c, [6.0, 0.0]);
        let mut notes = Vec::new();
        let (points, ties) = tracks.finish(&mut notes);
        let names: Vec<&str> = points.iter().map(|point| point.name.as_str()).collect();
        assert_eq!(names, ["a", "c"]);
        let seen: Vec<(u32, u32, f64)> = ties.iter().map(|tie| (tie.image.0, tie.point.0, tie.x)).collect();
        assert_eq!(seen, [(0, 0, 1.0), (1, 0, 2.0), (0, 1, 5.0), (1, 1, 6.0)]);
        assert_eq!(notes.len(), 2, "{notes:?}");
        assert!(notes[0].text.starts_with("3 measurements") && notes[1].text.starts_with("1 tie points"), "{notes:?}");
    }

    #[test]
    fn matches_that_share_a_place_are_one_track() {
        let mut matches = Matches::default();
        matches.pair(feature(0, 1.0), feature(1, 2.0));
        matches.pair(feature(2, 9.0), feature(3, 9.0));
        matches.pair(feature(2, 3.0), feature(1, 2.0));
        // Two places of image 5 by way of image 4.
        matches.pair(feature(4, 1.0), feature(5, 1.0));
        matches.pair(feature(4, 1.0), feature(5, 2.0));
        let mut notes = Vec::new();
        let (points, ties) = matches.into_tracks(&mut notes).finish(&mut notes);
        assert_eq!(points.len(), 2);
        let seen: Vec<(u32, u32)> = ties.iter().map(|tie| (tie.point.0, tie.image.0)).collect();
        assert_eq!(seen, [(0, 0), (0, 1), (0, 2), (1, 2), (1, 3)]);
        assert_eq!(notes.len(), 1, "{notes:?}");
    }
}
