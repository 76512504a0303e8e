//! Effects whose formula is one text for one measurement and for eight side by side, in vector registers of any width.

use super::answer::{Answer, FEW_PARAMETERS, Inputs, Thetas, fill_column};
use super::{Context, Descriptor, Effect, OutsideDomain, Stage, fill_identity};
use crate::math::lane::{LANES, Lane};
use crate::math::vectors::dispatch;
use crate::math::{Several, Wide};
use pulp::{Simd, WithSimd};
use smallvec::SmallVec;
use std::marker::PhantomData;

/// Numbers of what was observed that a formula has, at the most.
pub const OBSERVED: usize = 5;

/// What a formula adds to the identity. Whatever has one is an [`Effect`].
pub trait Formula: Send + Sync {
    /// Its stage.
    const STAGE: Stage;

    /// What it is.
    fn descriptor() -> &'static Descriptor;

    /// What the formula takes of what was observed.
    ///
    /// # Errors
    /// Something that is needed is not known.
    #[inline(always)]
    fn observe(_: &Context<'_>) -> Result<[f64; OBSERVED], OutsideDomain> {
        Ok([0.0; OBSERVED])
    }

    /// Adds to an answer that hands its input on. The formula holds where the number that it gives is above zero.
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T;
}

impl<F: Formula> Effect for F {
    fn descriptor(&self) -> &Descriptor {
        F::descriptor()
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        of_one::<F>(context, input, theta, &mut Answer { out, d_input, d_theta })
    }

    fn eval_eight(
        &self,
        contexts: &[Context<'_>; LANES],
        input: &[Lane],
        thetas: &Thetas<'_>,
        answer: &mut Answer<'_, Lane>,
    ) -> Result<Inputs, usize> {
        of_eight::<F>(contexts, input, thetas, answer)
    }
}

/// What a formula is given.
pub struct Given<'a, T: Several> {
    seed: T,
    observed: &'a [T::Kept; OBSERVED],
    input: &'a [T::Kept],
    theta: Values<'a, T>,
}

/// Values of the parameters.
#[derive(Clone, Copy)]
enum Values<'a, T: Several> {
    /// The same for each, put side by side in a register: of memory that was just written in parts, a processor waits
    /// to read the whole.
    Alike(&'a [f64]),
    /// Of each its own.
    Own(&'a [T::Kept]),
}

impl<T: Several> Values<'_, T> {
    /// How many parameters.
    #[inline(always)]
    fn count(&self) -> usize {
        match self {
            Values::Alike(values) => values.len(),
            Values::Own(values) => values.len(),
        }
    }
}

impl<T: Several> Given<'_, T> {
    /// Number `k` of [`Formula::observe`].
    #[inline(always)]
    pub fn observed(&self, k: usize) -> T {
        self.seed.of(self.observed[k])
    }

    /// Number `k` of the input.
    #[inline(always)]
    pub fn input(&self, k: usize) -> T {
        self.seed.of(self.input[k])
    }

    /// Parameter `p`.
    #[inline(always)]
    pub fn theta(&self, p: usize) -> T {
        match self.theta {
            Values::Alike(values) => self.seed.like(values[p]),
            Values::Own(values) => self.seed.of(values[p]),
        }
    }

    /// A constant.
    #[inline(always)]
    pub fn constant(&self, value: f64) -> T {
        self.seed.like(value)
    }
}

/// What a formula adds to.
pub struct Sum<'a, T: Several> {
    seed: T,
    columns: [usize; 2],
    offset: usize,
    inputs: Inputs,
    /// The sum of the absolute values of what was added to derivatives by the input.
    apart: T,
    answer: Answer<'a, T::Kept>,
}

impl<T: Several> Sum<'_, T> {
    /// Adds to output `i`.
    #[inline(always)]
    pub fn out(&mut self, i: usize, value: T) {
        self.answer.out[i] = (self.seed.of(self.answer.out[i]) + value).keep();
    }

    /// Are derivatives by the input asked for?
    #[inline(always)]
    pub fn wants_input(&self) -> bool {
        self.answer.d_input.is_some()
    }

    /// Adds to the derivative of output `i` by number `k` of the input.
    #[inline(always)]
    pub fn by_input(&mut self, i: usize, k: usize, value: T) {
        let Some(matrix) = &mut self.answer.d_input else { return };
        if !self.inputs.contains(k) {
            fill_column::<T>(matrix, self.columns[0], self.offset, k);
            self.inputs.insert(k);
        }
        self.apart = self.apart + value.abs();
        let place = &mut matrix[i * self.columns[0] + k];
        *place = (self.seed.of(*place) + value).keep();
    }

    /// Sets the derivative of output `i` by parameter `p`.
    #[inline(always)]
    pub fn by_theta(&mut self, i: usize, p: usize, value: T) {
        if let Some(matrix) = &mut self.answer.d_theta {
            matrix[i * self.columns[1] + p] = value.keep();
        }
    }
}

/// Answers of one measurement.
pub fn of_one<F: Formula>(
    context: &Context<'_>,
    input: &[f64],
    theta: &[f64],
    answer: &mut Answer<'_, f64>,
) -> Result<(), OutsideDomain> {
    let observed = F::observe(context)?;
    if let Some(matrix) = &mut answer.d_input {
        fill_identity(F::STAGE, matrix);
    }
    match answered::<F, f64>(0.0, &observed, input, Values::Own(theta), answer).0 > 0.0 {
        true => Ok(()),
        false => Err(OutsideDomain),
    }
}

/// Answers of eight measurements side by side, and the inputs that it depends on; `Err`: the place of the first outside
/// the domain.
pub fn of_eight<F: Formula>(
    contexts: &[Context<'_>; LANES],
    input: &[Lane],
    thetas: &Thetas<'_>,
    answer: &mut Answer<'_, Lane>,
) -> Result<Inputs, usize> {
    dispatch(SideBySide::<F> { contexts, input, thetas, answer, formula: PhantomData })
}

struct SideBySide<'a, 'b, F> {
    contexts: &'a [Context<'a>; LANES],
    input: &'a [Lane],
    thetas: &'a Thetas<'a>,
    answer: &'a mut Answer<'b, Lane>,
    formula: PhantomData<F>,
}

impl<F: Formula> WithSimd for SideBySide<'_, '_, F> {
    type Output = Result<Inputs, usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { contexts, input, thetas, answer, .. } = self;
        let mut observed = [Lane::default(); OBSERVED];
        for lane in 0..LANES {
            let numbers = F::observe(&contexts[lane]).map_err(|_| lane)?;
            for (to, value) in observed.iter_mut().zip(numbers) {
                to[lane] = value;
            }
        }
        let mut own: SmallVec<[Lane; FEW_PARAMETERS]> = SmallVec::new();
        let values = match thetas {
            Thetas::Alike(values) => Values::Alike(values),
            Thetas::Own(thetas) => {
                for p in 0..thetas[0].len() {
                    own.push(Lane(std::array::from_fn(|lane| thetas[lane][p])));
                }
                Values::Own(&own)
            }
        };
        let seed = Wide { simd, lane: Lane::default() };
        let (holds, inputs) = answered::<F, Wide<S>>(seed, &observed, input, values, answer);
        Wide::<S>::not_positive(&holds.keep()).map_or(Ok(inputs), Err)
    }
}

/// The number that [`Formula::add`] gives, and the inputs that the answer depends on.
#[inline(always)]
fn answered<F: Formula, T: Several>(
    seed: T,
    observed: &[T::Kept; OBSERVED],
    input: &[T::Kept],
    theta: Values<'_, T>,
    answer: &mut Answer<'_, T::Kept>,
) -> (T, Inputs) {
    let (columns, offset, outputs) = (F::STAGE.inputs(), F::STAGE.identity_offset(), F::STAGE.outputs());
    // Held here and asked once about their lengths: behind a reference both would be done again after each number that
    // is written.
    let (out, d_input) = (&mut *answer.out, answer.d_input.as_deref_mut());
    let mut d_theta = answer.d_theta.as_deref_mut();
    assert!(out.len() == outputs && d_input.as_ref().is_none_or(|matrix| matrix.len() == outputs * columns));
    out[..outputs].copy_from_slice(&input[offset..][..outputs]);
    if let Some(matrix) = &mut d_theta {
        matrix.fill(T::splat(0.0));
    }
    let answer = Answer { out, d_input, d_theta };
    let given = Given { seed, observed, input, theta };
    let apart = seed.like(0.0);
    let mut sum = Sum { seed, columns: [columns, theta.count()], offset, inputs: Inputs::NONE, apart, answer };
    let holds = F::add(&given, &mut sum);
    // At zero, where candidates are tested, an effect hands its input on.
    (holds, if sum.apart.is_zero() { Inputs::NONE } else { sum.inputs })
}
