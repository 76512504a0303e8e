//! Marks of surveyed points against the free network: where rays of marks do not meet and others do once a convention
//! is undone.
//!
//! Ties orient the images, so that marks have to agree with them alone. What a lens, a shutter or a sensor does, it
//! does to ties and marks alike.

use super::{BEYOND, KINDS, Mistake};
use crate::block::edit::{Change, Edit};
use crate::math::statistics::{f_ln_sf, median};
use nalgebra::{Matrix2, Vector2};

/// Points, each of marks in two images at least, that must agree: fewer meet by chance.
const FEWEST_POINTS: usize = 3;
/// An offset below is no convention, px: the smallest that people make is half a pixel.
const LEAST_OFFSET_PX: f64 = 0.25;
/// Centre of the pixel in place of its corner.
const HALF_PIXEL: f64 = 0.5;
/// Standard deviations within which an offset is taken for a known one.
const SIGMAS: f64 = 3.0;

/// What was done to all marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Recorded {
    /// Nothing.
    Rightly,
    /// y counts upwards from the lower edge.
    YUp,
    /// x counts from the right edge.
    Mirrored,
    /// x stands under y.
    ColumnsExchanged,
    /// Measured in images of another size: times this.
    Scaled(f64),
}

impl Recorded {
    /// All, the right one first. Sizes are those that programs make previews of.
    pub fn all() -> Vec<Self> {
        let sizes = [0.5, 0.25, 0.75, 2.0 / 3.0, 1.0 / 3.0, 0.2, 0.125, 2.0, 4.0];
        let mut all = vec![Self::Rightly, Self::YUp, Self::Mirrored, Self::ColumnsExchanged];
        all.extend(sizes.map(Self::Scaled));
        all
    }

    /// A mark as it should have been recorded, in an image of this width and height.
    pub fn undone(self, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Rightly => [x, y],
            Self::YUp => [x, height - y],
            Self::Mirrored => [width - x, y],
            Self::ColumnsExchanged => [y, x],
            Self::Scaled(factor) => [x / factor, y / factor],
        }
    }

    /// Edits of the marks of images of one size; `images`: their names, none: all.
    pub fn edits(self, [width, height]: [f64; 2], images: &[String]) -> Vec<Edit> {
        let affine = |column: &str, factor: f64, offset: f64| Change::Affine { column: column.into(), factor, offset };
        let changes = match self {
            Self::Rightly => Vec::new(),
            Self::YUp => vec![affine("y", -1.0, height)],
            Self::Mirrored => vec![affine("x", -1.0, width)],
            Self::ColumnsExchanged => vec![Change::ExchangeColumns { columns: ["x".into(), "y".into()] }],
            Self::Scaled(factor) => ["x", "y"].map(|column| Change::times(column, 1.0 / factor)).to_vec(),
        };
        let edit = |change| Edit::all("marks.csv", change);
        let of = |edit: Edit| if images.is_empty() { edit } else { edit.of("image", images) };
        changes.into_iter().map(edit).map(of).collect()
    }

    fn mistake(self) -> Option<Mistake> {
        let new = |kind: &str, what: String, remedy: &str| {
            let sentence = format!("Marks: {what}. The rays of each point meet once that is undone.");
            Mistake::new(kind, "marks", sentence, format!("{remedy} (marks.csv)."))
        };
        match self {
            Self::Rightly => None,
            Self::YUp => {
                Some(new("y-up", "y counts upwards from the lower edge".into(), "Take y from the height of the image"))
            }
            Self::Mirrored => {
                Some(new("mirrored", "x counts from the right edge".into(), "Take x from the width of the image"))
            }
            Self::ColumnsExchanged => {
                Some(new("columns-exchanged", "x and y are exchanged".into(), "Exchange the two columns"))
            }
            Self::Scaled(factor) => {
                let what = format!("they were measured in images of {factor:.3} times the size");
                let remedy = format!("Divide x and y by {factor:.3}");
                Some(new("image-scale", what, &remedy).sized(factor, None, "1"))
            }
        }
    }
}

/// How well rays meet under one alternative: the typical residual (px) of each point, infinite where they do not.
#[derive(Debug, Clone)]
pub struct Meeting {
    /// Which.
    pub recorded: Recorded,
    /// Of each point with marks in two images at least.
    pub sizes: Vec<f64>,
}

impl Meeting {
    fn typical(&self) -> f64 {
        if self.sizes.len() < FEWEST_POINTS { f64::NAN } else { median(&self.sizes) }
    }
}

/// The convention that is wrong for all marks. `trials`: the right one first; `usual`: what measurements that fit
/// leave, px.
pub fn convention(trials: &[Meeting], usual: f64) -> Option<(Recorded, Mistake)> {
    let (own, others) = trials.split_first()?;
    let best = others.iter().min_by(|a, b| a.typical().total_cmp(&b.typical()))?;
    let (before, after) = (own.typical(), best.typical());
    // Not a number compares as false.
    let named = before >= BEYOND * after.max(usual) && after < BEYOND * usual;
    if named { Some((best.recorded, best.recorded.mistake()?)) } else { None }
}

/// Residuals of all marks, and what they change by where all marks move by one pixel in x, and in y.
#[derive(Debug, Clone, Default)]
pub struct Moved {
    /// Observed less projected, px.
    pub residuals: Vec<Vector2<f64>>,
    /// See above.
    pub by_x: Vec<Vector2<f64>>,
    /// See above.
    pub by_y: Vec<Vector2<f64>>,
    /// Points they belong to.
    pub points: usize,
}

/// An offset that all marks share: the centre of a pixel for its corner, a template that is off. `most`: what marks
/// without it leave at most, px.
pub fn offset(moved: &Moved, most: f64, alpha: f64) -> Option<Mistake> {
    if moved.points < FEWEST_POINTS {
        return None;
    }
    let dof = (2 * moved.residuals.len()).checked_sub(3 * moved.points + 2).filter(|dof| *dof > 0)? as f64;
    let (mut normal, mut right, mut before) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for ((v, x), y) in moved.residuals.iter().zip(&moved.by_x).zip(&moved.by_y) {
        normal += Matrix2::new(x.dot(x), x.dot(y), x.dot(y), y.dot(y));
        right += Vector2::new(x.dot(v), y.dot(v));
        before += v.norm_squared();
    }
    let inverse = normal.try_inverse()?;
    let value = inverse * right;
    let drop = right.dot(&value);
    let variance = (before - drop) / dof;
    let statistic = drop / 2.0 / variance;
    let ln_p = f_ln_sf(statistic, 2.0, dof) + KINDS.ln();
    // Of its length, and of each coordinate.
    let along = value.try_normalize(0.0)?;
    let sigma = (variance * along.dot(&(inverse * along))).sqrt();
    let sigmas = (inverse.diagonal() * variance).map(f64::sqrt);
    // What a lens does at the places of few marks looks like an offset, too, and is no chance.
    let explains = variance.sqrt() < most;
    if !(explains && ln_p < alpha.ln() && value.norm() >= LEAST_OFFSET_PX && value.norm() >= BEYOND * sigma) {
        return None;
    }
    let near_half = |(own, sigma): (&f64, &f64)| (own.abs() - HALF_PIXEL).abs() <= SIGMAS * sigma;
    let is_half = value.iter().zip(&sigmas).all(near_half);
    let value = if is_half { value.map(|own| HALF_PIXEL.copysign(own)) } else { value };
    let why = if is_half {
        "half a pixel: the centre of a pixel was counted as its corner, or the corner as its centre"
    } else {
        "a template or a tool that is off"
    };
    let sentence =
        format!("Marks: all are off by {:.2}, {:.2} px (x, y) against the tie points, {why}.", value.x, value.y);
    let remedy = "Take this off x and y in marks.csv, or look at the tool that measured the marks.".to_string();
    let edits =
        [("x", value.x), ("y", value.y)].map(|(column, own)| Edit::all("marks.csv", Change::plus(column, -own)));
    let known = if is_half { None } else { Some(sigma) };
    Some(
        Mistake::new("offset", "marks", sentence, remedy)
            .sized(value.norm(), known, "px")
            .tested(drop / variance, ln_p.min(0.0))
            .undone_by(edits.to_vec()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [f64; 2] = [4000.0, 3000.0];

    #[test]
    fn what_is_undone_is_what_was_done() {
        assert_eq!(Recorded::YUp.undone([10.0, 2900.0], SIZE), [10.0, 100.0]);
        assert_eq!(Recorded::Scaled(0.5).undone([10.0, 20.0], SIZE), [20.0, 40.0]);
        assert_eq!(Recorded::YUp.edits(SIZE, &[]).len(), 1);
        assert_eq!(Recorded::Scaled(0.5).edits(SIZE, &["a".into()])[1].rows[0].values, ["a"]);
    }

    #[test]
    fn the_alternative_under_which_rays_meet_is_named_and_none_where_they_meet() {
        let meeting = |recorded, size: f64| Meeting { recorded, sizes: vec![size; 5] };
        let trials =
            [meeting(Recorded::Rightly, 300.0), meeting(Recorded::YUp, 0.4), meeting(Recorded::Mirrored, 500.0)];
        let (recorded, mistake) = convention(&trials, 0.3).expect("a mistake");
        assert_eq!((recorded, mistake.kind.as_str()), (Recorded::YUp, "y-up"));
        assert!(convention(&[meeting(Recorded::Rightly, 0.5), meeting(Recorded::YUp, 0.01)], 0.3).is_none());
        assert!(convention(&[meeting(Recorded::Rightly, 300.0), meeting(Recorded::YUp, 9.0)], 0.3).is_none());
        let few = Meeting { recorded: Recorded::Rightly, sizes: vec![300.0; 2] };
        assert!(convention(&[few, meeting(Recorded::YUp, 0.4)], 0.3).is_none());
    }

    #[test]
    fn half_a_pixel_is_known_and_noise_is_none() {
        let noise = |k: usize| 0.1 * Vector2::new((1.3 * (k * k) as f64).sin(), (2.1 * (k * k) as f64).cos());
        let turn = |k: usize| nalgebra::Rotation2::new(k as f64);
        let all = |offset: Vector2<f64>| {
            let by = |axis: Vector2<f64>| (0..60).map(|k| 0.5 * (turn(k) * axis)).collect::<Vec<_>>();
            let (by_x, by_y) = (by(Vector2::x()), by(Vector2::y()));
            let residuals = (0..60).map(|k| by_x[k] * offset.x + by_y[k] * offset.y + noise(k)).collect();
            Moved { residuals, by_x, by_y, points: 10 }
        };
        let found = offset(&all(Vector2::new(0.5, -0.5)), 3.0, 1e-3).expect("an offset");
        assert!(found.sentence.contains("half a pixel") && found.sigma.is_none(), "{}", found.sentence);
        let template = offset(&all(Vector2::new(1.5, 0.0)), 3.0, 1e-3).expect("an offset");
        assert!((template.value.expect("a size") - 1.5).abs() < 3.0 * template.sigma.expect("a sigma"));
        // The length is along x here, and y is known half as well: by its own standard deviation alone.
        let mut uneven = all(Vector2::new(1.5, 0.0));
        uneven.by_y.iter_mut().for_each(|own| *own *= 0.5);
        let uneven = offset(&uneven, 3.0, 1e-3).expect("an offset").sigma.expect("a sigma");
        assert!((uneven / template.sigma.expect("a sigma") - 1.0).abs() < 0.2, "{uneven}");
        assert!(offset(&all(Vector2::zeros()), 3.0, 1e-3).is_none());
        let few = Moved { points: 2, ..all(Vector2::new(1.5, 0.0)) };
        assert!(offset(&few, 3.0, 1e-3).is_none(), "two points say nothing of all marks");
        assert!(offset(&all(Vector2::new(1.5, 0.0)), 0.01, 1e-3).is_none(), "the rest is not explained");
    }
}
