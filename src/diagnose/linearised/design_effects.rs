//! Design effects: by how much measurements that err together, in an image or about a point, make an estimate less sure
//! than it says.

use super::super::select::{Known, Nature, Set};
use super::super::settings::Settings;
use super::Linearised;
use crate::adjust::AdjustError;
use crate::null_model::{GROUPINGS, ImageCell, ImageCells, NullModel, Parts};
use crate::run::RunError;
use crate::score::design_effect::{ClusterOfValues, Clusters, Share, of_values, shares_of};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::sync::Arc;

/// Laws of more columns are fields, of which no part by image is asked: each would have thousands of numbers.
const MOST_COLUMNS: usize = 64;

impl Linearised {
    /// Design effects, which make a p-value larger and never smaller: of what would be significant without, and of what
    /// is in.
    pub(super) fn widen(&mut self, laws: bool, settings: &Settings<'_>) -> Result<(), RunError> {
        let situation = self.situation(settings);
        let beside = situation.beside();
        let asked = |set: &usize| {
            situation.has(&self.sets[*set].id)
                || situation.judge(*set, &beside).is_some_and(|judged| judged.ln_p < situation.ln_level)
        };
        let wanted = |nature: Nature| -> Vec<usize> {
            let of_nature = (0..self.sets.len()).into_par_iter().filter(|set| self.sets[*set].nature == nature);
            of_nature.filter(asked).collect()
        };
        let values = (laws || self.extra_columns.is_empty()) && !wanted(Nature::Chance).is_empty();
        let laws = if laws { wanted(Nature::Law) } else { Vec::new() };
        let own = laws.into_iter().map(|set| &self.sets[set].columns).filter(|columns| columns.len() <= MOST_COLUMNS);
        let columns: Vec<usize> = own.flatten().copied().collect();
        if values {
            self.design_effects =
                design_effects(&self.null, &self.sets, self.null.chi_square() / self.system.redundancy)?;
        }
        if columns.is_empty() {
            return Ok(());
        }
        // Let go, so that what is changed need not be copied.
        drop(beside);
        (self.system.information, self.known) = (Arc::default(), Known::default());
        let Parts { columns, of_images, of_sensor } = self.null.parts(&mut self.scores, &columns)?;
        columns.iter().enumerate().for_each(|(position, column)| self.clustered[*column] = Some(position));
        // Surveyed coordinates are no cluster: each is a measurement of its own.
        let mut groupings: Vec<_> = [of_images].into_iter().chain(of_sensor).collect();
        groupings.iter_mut().for_each(|parts| drop(parts.pop()));
        self.clusters = Clusters { groupings };
        self.system = self.zero.of(&self.scores, &self.values);
        Ok(())
    }
}

/// Design effect of every set of values per image; one for laws.
fn design_effects(null: &NullModel, sets: &[Set], variance: f64) -> Result<Vec<f64>, AdjustError> {
    let images = null.image_cells()?;
    let of = |set: &Set| {
        if set.nature == Nature::Law {
            return 1.0;
        }
        let grouped = |grouping| {
            let shares = |image: &ImageCells| shares_of(&clusters_of(set, image, grouping), variance);
            let of_images: Vec<Vec<Share>> = null.pool().install(|| images.par_iter().map(shares).collect());
            of_values(of_images.iter().flatten())
        };
        (0..GROUPINGS).map(grouped).fold(1.0, f64::max)
    };
    Ok(sets.iter().map(of).collect())
}

/// The cells of an image over its values in a set.
fn clusters_of(set: &Set, image: &ImageCells, grouping: usize) -> Vec<ClusterOfValues> {
    let is_own = |position: &usize| set.columns.binary_search(&image.columns[*position]).is_ok();
    let rows: Vec<usize> = (0..image.columns.len()).filter(is_own).collect();
    let among = |matrix: &DMatrix<f64>| matrix.select_rows(&rows).select_columns(&rows);
    let own = |cell: &ImageCell| ClusterOfValues {
        score: cell.score.select_rows(&rows),
        information: among(&cell.information),
        covariance: among(&cell.covariance),
    };
    if rows.is_empty() { Vec::new() } else { image.groupings[grouping].iter().map(own).collect() }
}
