//! Order of images along the block, so that points that are near each other in memory are near each other in space.

use nalgebra::{Matrix3, Vector3};

/// Rank of every image along the principal axis of the projection centres (ties by position in the list): in a corridor
/// the reduced system becomes a narrow band, whatever the order of flights.
pub fn ranks_along_block(centres: &[Vector3<f64>]) -> Vec<u32> {
    let n = centres.len().max(1) as f64;
    let mean = centres.iter().sum::<Vector3<f64>>() / n;
    let mut scatter = Matrix3::zeros();
    for centre in centres {
        let d = centre - mean;
        scatter += d * d.transpose();
    }
    let axis = scatter.symmetric_eigen();
    let axis: Vector3<f64> = axis.eigenvectors.column(axis.eigenvalues.imax()).into_owned();
    let mut order: Vec<usize> = (0..centres.len()).collect();
    order.sort_by(|a, b| axis.dot(&centres[*a]).total_cmp(&axis.dot(&centres[*b])).then(a.cmp(b)));
    let mut ranks = vec![0; centres.len()];
    for (rank, image) in order.into_iter().enumerate() {
        ranks[image] = rank as u32;
    }
    ranks
}
