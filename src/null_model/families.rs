//! Families of columns: those of a family are multiplied with each other, and with those of none. Of two families no
//! products are made; in a system of many questions they would be most of the work, and nobody reads them.

use super::ColumnPlace;
use std::ops::Range;

/// The columns that each is multiplied with, by their numbers in the sums: all that are asked for, and a few more where
/// these are in between.
pub(super) struct Families {
    /// Family of each column of the system; `None`: it goes with all.
    of: Vec<Option<usize>>,
    /// A dense column is multiplied with those from itself up to here.
    pub dense: Vec<usize>,
    /// The same of local columns.
    pub local: Vec<usize>,
    /// A local column is multiplied with the dense ones up to here.
    pub dense_of_local: Vec<usize>,
}

impl Families {
    /// Of columns of the system, which have `places` in the sums: of `dense` dense columns, the base's `border` first,
    /// and `local` local ones.
    pub fn new(
        families: &[Range<usize>],
        places: &[ColumnPlace],
        (border, dense): (usize, usize),
        local: usize,
    ) -> Self {
        let mut of = vec![None; places.len()];
        for (family, columns) in families.iter().enumerate() {
            of[columns.clone()].fill(Some(family));
        }
        // The base's own columns, which are dense, go with all.
        let mut common = [border, 0];
        let mut ends = vec![[0; 2]; families.len()];
        for (place, family) in places.iter().zip(&of) {
            let (kind, number) = match *place {
                ColumnPlace::Dense(number) => (0, number),
                ColumnPlace::Local(number) => (1, number),
            };
            let end = family.map_or(&mut common[kind], |family| &mut ends[family][kind]);
            *end = (*end).max(number + 1);
        }
        let mut this =
            Self { of, dense: vec![dense; dense], local: vec![local; local], dense_of_local: vec![dense; local] };
        for (place, family) in places.iter().zip(&this.of) {
            let Some(family) = *family else { continue };
            let [of_dense, of_local] = ends[family];
            match *place {
                ColumnPlace::Dense(number) => this.dense[number] = of_dense.max(common[0]),
                ColumnPlace::Local(number) => {
                    this.local[number] = of_local.max(common[1]);
                    this.dense_of_local[number] = of_dense.max(common[0]);
                }
            }
        }
        this
    }

    /// Are two columns of the system of different families?
    pub fn apart(&self, a: usize, b: usize) -> bool {
        matches!((self.of[a], self.of[b]), (Some(a), Some(b)) if a != b)
    }
}
