//! Effects whose formula is one text for one measurement and for eight side by side, in vector registers of any width.

use super::{Context, Descriptor, Effect, OutsideDomain, Stage, fill_identity};
use crate::math::lane::{LANES, Lane};
use crate::math::vectors::dispatch;
use crate::math::{Several, Wide};
use pulp::{Simd, WithSimd};
use smallvec::{SmallVec, smallvec};
use std::marker::PhantomData;

/// What an effect answers, of one measurement or of eight. Shapes: `n = stage.inputs()`, `m = stage.outputs()`, `p = parameters.len()`.
#[derive(Debug)]
pub struct Answer<'a, K> {
    /// `e(input, theta)`, m.
    pub out: &'a mut [K],
    /// Derivatives by the input, m x n, row-major; where they are asked for.
    pub d_input: Option<&'a mut [K]>,
    /// Derivatives by the parameters, m x p, row-major; where they are asked for.
    pub d_theta: Option<&'a mut [K]>,
}

/// Inputs on which an answer depends otherwise than by handing them on. Bit `k` stands for input `k`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inputs(u32);

impl Inputs {
    /// It hands on what it gets.
    pub const NONE: Self = Self(0);
    /// Any of them: its derivatives tell.
    pub const ANY: Self = Self(u32::MAX);

    /// Adds input `k`.
    #[inline(always)]
    pub fn insert(&mut self, k: usize) {
        self.0 |= 1 << k;
    }

    /// Is input `k` among them?
    #[inline(always)]
    pub fn contains(self, k: usize) -> bool {
        self.0 & (1 << k) != 0
    }

    /// Is none among them?
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self == Self::NONE
    }
}

/// Numbers of what was observed that a formula has, at the most.
pub const OBSERVED: usize = 5;
/// Parameters of an effect that are kept without an allocation; those of the empirical fields are more.
pub const FEW_PARAMETERS: usize = 12;

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
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, '_, T>) -> T;
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
        thetas: &[&[f64]; LANES],
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
    /// The same for each, put side by side in a register: of memory that was just written in parts, a processor waits to read the whole.
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
pub struct Sum<'s, 'a, T: Several> {
    seed: T,
    columns: [usize; 2],
    offset: usize,
    inputs: Inputs,
    /// The sum of the absolute values of what was added to derivatives by the input.
    apart: T,
    answer: &'s mut Answer<'a, T::Kept>,
}

impl<T: Several> Sum<'_, '_, T> {
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

/// Answers of eight measurements side by side, and the inputs that it depends on; `Err`: the place of the first outside the domain.
pub fn of_eight<F: Formula>(
    contexts: &[Context<'_>; LANES],
    input: &[Lane],
    thetas: &[&[f64]; LANES],
    answer: &mut Answer<'_, Lane>,
) -> Result<Inputs, usize> {
    dispatch(SideBySide::<F> { contexts, input, thetas, answer, formula: PhantomData })
}

struct SideBySide<'a, 'b, F> {
    contexts: &'a [Context<'a>; LANES],
    input: &'a [Lane],
    thetas: &'a [&'a [f64]; LANES],
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
        // The values of a block stand in one place; eight that are put together cannot be read at once.
        let alike = thetas.iter().all(|values| std::ptr::eq(*values, thetas[0]));
        if !alike {
            for p in 0..thetas[0].len() {
                own.push(Lane(std::array::from_fn(|lane| thetas[lane][p])));
            }
        }
        let values = if alike { Values::Alike(thetas[0]) } else { Values::Own(&own) };
        let seed = Wide { simd, lane: Lane::default() };
        let (holds, inputs) = answered::<F, Wide<S>>(seed, &observed, input, values, answer);
        Wide::<S>::not_positive(&holds.keep()).map_or(Ok(inputs), Err)
    }
}

/// Column `k` of `columns` of the identity, which hands on the input from `offset` on.
#[inline(always)]
pub fn fill_column<T: Several>(matrix: &mut [T::Kept], columns: usize, offset: usize, k: usize) {
    for i in 0..matrix.len() / columns {
        matrix[i * columns + k] = T::splat(if k == offset + i { 1.0 } else { 0.0 });
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
    let (columns, offset) = (F::STAGE.inputs(), F::STAGE.identity_offset());
    answer.out.copy_from_slice(&input[offset..offset + F::STAGE.outputs()]);
    if let Some(matrix) = &mut answer.d_theta {
        matrix.fill(T::splat(0.0));
    }
    let given = Given { seed, observed, input, theta };
    let apart = seed.like(0.0);
    let mut sum = Sum { seed, columns: [columns, theta.count()], offset, inputs: Inputs::NONE, apart, answer };
    let holds = F::add(&given, &mut sum);
    // At zero, where candidates are tested, an effect hands its input on.
    (holds, if sum.apart.is_zero() { Inputs::NONE } else { sum.inputs })
}

/// Asks an effect about eight measurements, one after the other.
pub fn one_by_one<E: Effect + ?Sized>(
    effect: &E,
    contexts: &[Context<'_>; LANES],
    input: &[Lane],
    thetas: &[&[f64]; LANES],
    answer: &mut Answer<'_, Lane>,
) -> Result<Inputs, usize> {
    /// The most inputs and outputs that any stage has.
    const INPUTS: usize = Stage::Interior.inputs();
    const OUTPUTS: usize = Stage::Interior.outputs();
    let Answer { out, d_input, d_theta } = answer;
    let (n, m, p) = (input.len(), out.len(), thetas[0].len());
    let (mut one_input, mut one_out, mut by_input) = ([0.0; INPUTS], [0.0; OUTPUTS], [0.0; INPUTS * OUTPUTS]);
    let mut by_theta: SmallVec<[f64; FEW_PARAMETERS * OUTPUTS]> = smallvec![0.0; m * p];
    for lane in 0..LANES {
        one_input.iter_mut().zip(input).for_each(|(to, from)| *to = from[lane]);
        let wanted = (d_input.is_some().then_some(&mut by_input[..m * n]), d_theta.is_some().then_some(&mut *by_theta));
        effect
            .eval(&contexts[lane], &one_input[..n], thetas[lane], &mut one_out[..m], wanted.0, wanted.1)
            .map_err(|_| lane)?;
        out.iter_mut().zip(one_out).for_each(|(to, value)| to[lane] = value);
        if let Some(matrix) = d_input {
            matrix.iter_mut().zip(by_input).for_each(|(to, value)| to[lane] = value);
        }
        if let Some(matrix) = d_theta {
            matrix.iter_mut().zip(&*by_theta).for_each(|(to, value)| to[lane] = *value);
        }
    }
    Ok(Inputs::ANY)
}
