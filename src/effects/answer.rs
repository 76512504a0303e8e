//! What an effect is asked of eight measurements side by side, and what it answers.

use super::{Context, Effect, Stage};
use crate::math::Several;
use crate::math::lane::{LANES, Lane};
use smallvec::{SmallVec, smallvec};

/// Parameters of eight measurements, handed on by reference: numbers that were just written one by one are waited for
/// when they are copied.
#[derive(Debug)]
pub enum Thetas<'a> {
    /// The same for each, as those of a whole block are.
    Alike(&'a [f64]),
    /// Of each its own, equally many.
    Own(&'a [&'a [f64]; LANES]),
}

impl<'a> Thetas<'a> {
    /// Those of one.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> &'a [f64] {
        match self {
            Self::Alike(values) => values,
            Self::Own(values) => values[lane],
        }
    }

    /// How many each has.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.of(0).len()
    }
}

/// What an effect answers, of one measurement or of eight. Shapes: `n = stage.inputs()`, `m = stage.outputs()`, `p =
/// parameters.len()`.
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

/// Column `k` of `columns` of the identity, which hands on the input from `offset` on.
#[inline(always)]
pub fn fill_column<T: Several>(matrix: &mut [T::Kept], columns: usize, offset: usize, k: usize) {
    for i in 0..matrix.len() / columns {
        matrix[i * columns + k] = T::splat(if k == offset + i { 1.0 } else { 0.0 });
    }
}

/// Parameters of an effect that are kept without an allocation; those of the empirical fields are more.
pub const FEW_PARAMETERS: usize = 12;

/// Asks an effect about eight measurements, one after the other.
pub fn one_by_one<E: Effect + ?Sized>(
    effect: &E,
    contexts: &[Context<'_>; LANES],
    input: &[Lane],
    thetas: &Thetas<'_>,
    answer: &mut Answer<'_, Lane>,
) -> Result<Inputs, usize> {
    /// The most inputs and outputs that any stage has.
    const INPUTS: usize = Stage::Interior.inputs();
    const OUTPUTS: usize = Stage::Interior.outputs();
    let Answer { out, d_input, d_theta } = answer;
    let (n, m, p) = (input.len(), out.len(), thetas.count());
    let (mut one_input, mut one_out, mut by_input) = ([0.0; INPUTS], [0.0; OUTPUTS], [0.0; INPUTS * OUTPUTS]);
    let mut by_theta: SmallVec<[f64; FEW_PARAMETERS * OUTPUTS]> = smallvec![0.0; m * p];
    for lane in 0..LANES {
        one_input.iter_mut().zip(input).for_each(|(to, from)| *to = from[lane]);
        let wanted = (d_input.is_some().then_some(&mut by_input[..m * n]), d_theta.is_some().then_some(&mut *by_theta));
        effect
            .eval(&contexts[lane], &one_input[..n], thetas.of(lane), &mut one_out[..m], wanted.0, wanted.1)
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
