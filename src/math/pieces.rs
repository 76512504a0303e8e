//! A matrix in pieces that do not depend on the number of threads, worked on side by side.

use faer::MatMut;
use rayon::prelude::*;

/// Works on numbered pieces. Only in a pool side by side: that of the whole program has more threads than were asked
/// for.
pub fn each<T: Send>(pieces: Vec<T>, work: impl Fn(usize, T) + Sync + Send) {
    match rayon::current_thread_index() {
        Some(_) => pieces.into_par_iter().enumerate().for_each(|(number, piece)| work(number, piece)),
        None => pieces.into_iter().enumerate().for_each(|(number, piece)| work(number, piece)),
    }
}

/// Does both, side by side where [`each`] would be.
pub fn both<A: Send, B: Send>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B + Send) -> (A, B) {
    match rayon::current_thread_index() {
        Some(_) => rayon::join(one, other),
        None => (one(), other()),
    }
}

/// A matrix split into pieces of `size` rows or columns; the last one may have fewer.
pub fn pieces<'a>(
    matrix: MatMut<'a, f64>,
    size: usize,
    split: impl Fn(MatMut<'a, f64>, usize) -> (MatMut<'a, f64>, MatMut<'a, f64>),
    count: impl Fn(&MatMut<'a, f64>) -> usize,
) -> Vec<MatMut<'a, f64>> {
    let (mut pieces, mut rest) = (Vec::new(), matrix);
    while count(&rest) > size {
        let (piece, others) = split(rest, size);
        pieces.push(piece);
        rest = others;
    }
    pieces.push(rest);
    pieces
}
