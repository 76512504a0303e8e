//! Do columns predict measurements that their estimate did not see? Images are left out in turn.

use super::design_effect::Clusters;
use nalgebra::{DMatrix, DVector};

/// Parts that are left out in turn.
const FOLDS: usize = 5;
/// Share of the information that has to come from images: surveyed coordinates cannot be left out by image.
const LEAST_SHARE: f64 = 0.9;

impl Clusters {
    /// How much of `v'Pv` the directions (columns x dof, of unit information together) take away in images that the estimate of their sizes did
    /// not see. `change`: what the columns change by when everything is fitted. Not above zero: nothing is predicted. `None` where it cannot be
    /// told: what is known of the directions does not come from images, or from too few of them.
    pub fn predicted_drop(&self, directions: &DMatrix<f64>, change: &DVector<f64>) -> Option<f64> {
        let dof = directions.ncols();
        let (touched, directions, change) = &self.touched(directions, change);
        // Sizes that the change has along the directions, by their information together.
        let total = |change: &DVector<f64>| -> DVector<f64> {
            touched.parts.iter().map(|(_, information)| information * change).sum()
        };
        let sizes = directions.transpose() * total(change);
        let part = |(score, information): &(DVector<f64>, DMatrix<f64>)| {
            let information_d = information * directions;
            let own = directions.transpose() * &information_d;
            // Scores at zero along the directions, the rest as fitted.
            (directions.transpose() * (score - information * change) + &own * &sizes, own)
        };
        let parts: Vec<(DVector<f64>, DMatrix<f64>)> = touched.parts.iter().map(part).collect();
        let known: f64 = parts.iter().map(|(_, own)| own.trace()).sum();
        if known < LEAST_SHARE * dof as f64 {
            return None;
        }
        let sum = |keep: &dyn Fn(usize) -> bool| {
            parts
                .iter()
                .enumerate()
                .filter(|(k, _)| keep(*k))
                .fold((DVector::zeros(dof), DMatrix::zeros(dof, dof)), |(score, information), (_, (s, m))| {
                    (score + s, information + m)
                })
        };
        let mut drop = 0.0;
        for fold in 0..FOLDS {
            let (score, information) = sum(&|k| k % FOLDS != fold);
            let estimate = information.cholesky()?.solve(&score);
            let (score, information) = sum(&|k| k % FOLDS == fold);
            drop += 2.0 * estimate.dot(&score) - estimate.dot(&(information * &estimate));
        }
        Some(drop)
    }
}
