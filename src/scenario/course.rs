//! The way along places where images are taken: strips, and the direction of flight at each place.

use nalgebra::Vector3;

/// Cosine of the largest turn within a strip, 45 degrees.
const TURN: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Places that are nearer than this are one place, m.
const STEP_M: f64 = 1e-6;

/// Of a place on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Leg {
    /// Strip, from 0.
    pub strip: usize,
    /// Unit vector; `None` where nothing moves.
    pub direction: Option<Vector3<f64>>,
}

/// The way along places. The direction at a place is that in which it was reached; where a strip begins, that in which
/// it goes on.
pub(super) fn course(places: &[Vector3<f64>]) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::with_capacity(places.len());
    let mut reached = vec![None; places.len()];
    let (mut strip, mut direction) = (0, None::<Vector3<f64>>);
    for (k, place) in places.iter().enumerate() {
        reached[k] = k.checked_sub(1).and_then(|last| (place - places[last]).try_normalize(STEP_M));
        match (direction, reached[k]) {
            (Some(last), Some(step)) if last.dot(&step) < TURN => {
                strip += 1;
                direction = None;
            }
            (_, Some(step)) => direction = Some(step),
            (_, None) => {}
        }
        legs.push(Leg { strip, direction });
    }
    for k in (1..legs.len()).rev() {
        let next = legs[k];
        if legs[k - 1].strip == next.strip {
            legs[k - 1].direction = legs[k - 1].direction.or(next.direction);
        }
    }
    // A strip of one image.
    for (leg, reached) in legs.iter_mut().zip(reached) {
        leg.direction = leg.direction.or(reached);
    }
    legs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_ends_where_the_path_turns() {
        let (north, east) = (Vector3::y(), Vector3::x());
        let places = [[0.0, 0.0], [0.0, 10.0], [1.0, 20.0], [30.0, 20.0], [30.0, 10.0], [30.0, 10.0], [30.0, 0.0]];
        let legs = course(&places.map(|[x, y]| Vector3::new(x, y, 50.0)));
        assert_eq!(legs.iter().map(|leg| leg.strip).collect::<Vec<_>>(), [0, 0, 0, 1, 1, 1, 1]);
        let along = |k: usize, direction: Vector3<f64>| legs[k].direction.is_some_and(|own| own.dot(&direction) > 0.99);
        assert!((0..3).all(|k| along(k, north)), "{legs:?}");
        assert!((3..7).all(|k| along(k, -north)), "{legs:?}");
        let turned = course(&[Vector3::zeros(), north, north + east]);
        assert_eq!([turned[2].strip, 1], [1, turned[2].strip]);
        assert_eq!(turned[2].direction, Some(east));
        assert_eq!(course(&[north])[0], Leg { strip: 0, direction: None });
        assert_eq!(course(&[]), []);
    }
}
