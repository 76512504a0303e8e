//! Eight measurements through effects, side by side.

use super::eight_rays::{Eight, Seen};
use super::eight_rows::Rows;
use super::lanes::{Predictions, Straight, THETA, Views};
use super::matrices::{changes, fill_left_out};
use super::place::{ANSWERS_AHEAD, MOST_MOVES, Search, follow_place, is_near};
use super::ray::Ray;
use super::rays::Rays;
use super::through::{IMAGE_INPUTS, add_by_place, point_through_image, point_through_ray, through_image, through_ray};
use crate::effects::answer::{Answer, Inputs};
use crate::effects::{IMAGE_INTERIOR, Stage};
use crate::math::lane::{LANES, Lane};
use crate::math::{Several, Wide};
use pulp::{Simd, WithSimd};

/// Work space for what effects answer.
#[derive(Debug, Clone)]
pub struct Answers {
    ray: Ray<Lane>,
    d_in: [Lane; 2 * IMAGE_INPUTS],
    d_own: Vec<Lane>,
}

impl Default for Answers {
    fn default() -> Self {
        Self { ray: Ray::default(), d_in: [Lane::default(); 2 * IMAGE_INPUTS], d_own: Vec::new() }
    }
}

/// Derivatives that are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// None: image points alone.
    Nothing,
    /// Those by the object point.
    ByPoint,
    /// All of them.
    Everything,
}

/// A prediction of [`Seen`] to be carried out: inlined into the loop of a plain camera it would cost that loop the
/// registers.
pub struct Predict<'a, 'b> {
    /// What is predicted.
    pub seen: Seen<'b>,
    /// Straight rays, bent afterwards.
    pub views: &'a mut Views,
    /// What is predicted of them.
    pub out: &'a mut Predictions,
    /// Work space.
    pub answers: &'a mut Answers,
    /// Which derivatives.
    pub wanted: Wanted,
}

impl WithSimd for Predict<'_, '_> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { seen, views, out, answers, wanted } = self;
        match wanted {
            Wanted::Everything => seen.predict(simd, views, out, answers),
            // The derivatives that are wanted follow from those by the place, which come with all others.
            Wanted::ByPoint if seen.finds_place() => seen.predict(simd, views, out, answers),
            Wanted::Nothing if seen.finds_place() => seen.point_at_own_place(simd, views, out, answers),
            Wanted::ByPoint => seen.project(&Eight::new(simd, &seen), views, out, answers, true),
            Wanted::Nothing => seen.project(&Eight::new(simd, &seen), views, out, answers, false),
        }
    }
}

impl Seen<'_> {
    /// Does an effect read the place at which the chain ends?
    #[inline(always)]
    fn finds_place(&self) -> bool {
        !self.stages.place_axes.is_empty()
    }

    /// Predicts them, given the `views` of straight rays. `Err`: the place of one that lies behind its camera, or
    /// outside an effect's domain.
    #[inline(always)]
    fn predict<S: Simd>(
        &self,
        simd: S,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
    ) -> Result<(), usize> {
        let mut eight = Eight::new(simd, self);
        match self.finds_place() {
            true => self.predict_at_own_place(&mut eight, views, out, answers)?,
            false => self.predict_there(&eight, views, out, answers)?,
        }
        if self.problem.tie_dc_to_pp {
            out.tie_centre();
        }
        Ok(())
    }

    /// The same at the places of the contexts, with the centre of distortion an unknown of its own.
    #[inline(always)]
    fn predict_there<S: Simd>(
        &self,
        eight: &Eight<'_, S>,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
    ) -> Result<(), usize> {
        let (Self { problem, stages, .. }, simd) = (self, eight.simd);
        for row in &mut out.rows {
            row[THETA..].fill(Lane::default());
        }
        let straight = stages.straight();
        if !straight {
            answers.ray.bend(eight, stages, &views.pose(), &views.object())?;
            eight.see(views, &answers.ray);
        }
        views.predict(simd, out);
        eight.in_front(&out.depth)?;
        if !straight {
            through_ray(&mut Rows::new(simd, &mut out.rows), &answers.ray, &stages.ray_locals);
        }
        for (position, &e) in stages.of(Stage::Image).iter().enumerate() {
            let (own, before) = (stages.locals(problem, e), stages.before(problem, position));
            answers.d_own.resize(answers.d_own.len().max(2 * own.len()), Lane::default());
            let (d_in, d_own) = (&mut answers.d_in, &mut answers.d_own[..2 * own.len()]);
            let input = image_input(&out.point, views);
            let answer = &mut Answer { out: &mut out.point, d_input: Some(&mut *d_in), d_theta: Some(&mut *d_own) };
            let mut inputs = eight.ask(e, &input, answer)?;
            match changes(eight.seed(), d_in, 2, 0, inputs) {
                // Of the rest those alone are read that were written.
                true => fill_left_out::<Wide<S>>(d_in, 2, 0, 0..IMAGE_INTERIOR, inputs),
                false => inputs = Inputs::NONE,
            }
            let rows = &mut Rows::new(simd, &mut out.rows);
            through_image(rows, (&*d_in, &*d_own), own, before, inputs);
            add_by_place(rows, eight, stages, e, &input)?;
        }
        eight.through_interiors(views, &mut out.rows);
        Ok(())
    }

    /// Predicts at the places at which the chain ends; see [`super::place`]. A measurement whose place is near stays
    /// there while others move, so that it has the numbers that it has alone.
    #[inline(always)]
    fn predict_at_own_place<S: Simd>(
        &self,
        eight: &mut Eight<'_, S>,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
    ) -> Result<(), usize> {
        let (stages, simd, seed) = (self.stages, eight.simd, eight.seed());
        let straight = views.straight();
        let searches = self.search(eight, &straight, views, out, answers, ANSWERS_AHEAD)?;
        let (mut at, mut far) = (places(&searches, Search::place), None);
        for _ in 0..MOST_MOVES {
            views.straighten(&straight);
            eight.be_at(&at);
            self.predict_there(eight, views, out, answers)?;
            let end = out.point;
            let rows = &mut Rows::new(simd, &mut out.rows);
            let own = follow_place(rows, stages, &at.map(|lane| seed.of(lane)), &end.map(|lane| seed.of(lane)))?;
            let own = own.map(|number| number.keep());
            far = None;
            for lane in 0..LANES {
                if !is_near(stages, at.map(|k| k[lane]), end.map(|k| k[lane])) {
                    far = far.or(Some(lane));
                    for (at, own) in at.iter_mut().zip(&own) {
                        at[lane] = own[lane];
                    }
                }
            }
            if far.is_none() {
                out.point = own;
                break;
            }
        }
        far.map_or(Ok(()), Err)
    }

    /// The image points alone, at the places at which the chain ends.
    #[inline(always)]
    fn point_at_own_place<S: Simd>(
        &self,
        simd: S,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
    ) -> Result<(), usize> {
        let mut eight = Eight::new(simd, self);
        let straight = views.straight();
        let searches = self.search(&mut eight, &straight, views, out, answers, MOST_MOVES)?;
        out.point = places(&searches, Search::place);
        searches.iter().position(|search| search.found.is_none()).map_or(Ok(()), Err)
    }

    /// Looks for the places from those where the plain camera sees the points: until all are found, or so many
    /// answers were heard.
    #[inline(always)]
    fn search<S: Simd>(
        &self,
        eight: &mut Eight<'_, S>,
        straight: &Straight,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
        most: usize,
    ) -> Result<[Search; LANES], usize> {
        views.project(eight.simd, out);
        eight.in_front(&out.depth)?;
        let mut searches: [Search; LANES] =
            std::array::from_fn(|lane| Search::from([out.point[0][lane], out.point[1][lane]]));
        for _ in 0..most {
            eight.be_at(&places(&searches, |search| search.at));
            views.straighten(straight);
            self.project(eight, views, out, answers, false)?;
            for (lane, search) in searches.iter_mut().enumerate() {
                search.tell(self.stages, [out.point[0][lane], out.point[1][lane]]);
            }
            if searches.iter().all(|search| search.found.is_some()) {
                break;
            }
        }
        Ok(searches)
    }

    /// Predicts image points as [`Self::predict_there`] does, alone or with their derivatives by the object point.
    #[inline(always)]
    fn project<S: Simd>(
        &self,
        eight: &Eight<'_, S>,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
        by_point: bool,
    ) -> Result<(), usize> {
        let simd = eight.simd;
        let straight = self.stages.straight();
        if !straight {
            answers.ray.shift(eight, self.stages, (&views.pose(), &views.object()), by_point)?;
            eight.see(views, &answers.ray);
        }
        match by_point {
            true => views.predict_by_point(simd, out),
            false => views.project(simd, out),
        }
        eight.in_front(&out.depth)?;
        if by_point && !straight && answers.ray.bends {
            point_through_ray(&mut Rows::new(simd, &mut out.rows), &answers.ray);
        }
        for &e in self.stages.of(Stage::Image) {
            let (input, d_in) = (image_input(&out.point, views), &mut answers.d_in);
            let d_input = by_point.then_some(&mut d_in[..]);
            let inputs = eight.ask(e, &input, &mut Answer { out: &mut out.point, d_input, d_theta: None })?;
            if by_point && changes(eight.seed(), d_in, 2, 0, inputs) {
                fill_left_out::<Wide<S>>(d_in, 2, 0, 0..IMAGE_INTERIOR, inputs);
                point_through_image(&mut Rows::new(simd, &mut out.rows), d_in);
            }
        }
        Ok(())
    }
}

/// A place of each search.
fn places(searches: &[Search; LANES], place: impl Fn(&Search) -> [f64; 2]) -> [Lane; 2] {
    let mut places = [Lane::default(); 2];
    for (lane, search) in searches.iter().enumerate() {
        [places[0][lane], places[1][lane]] = place(search);
    }
    places
}

/// What an image effect gets.
#[inline(always)]
fn image_input(point: &[Lane; 2], views: &Views) -> [Lane; IMAGE_INPUTS] {
    let mut input = [Lane::default(); IMAGE_INPUTS];
    input[..IMAGE_INTERIOR].copy_from_slice(point);
    input[IMAGE_INTERIOR..].copy_from_slice(views.interior());
    input
}
