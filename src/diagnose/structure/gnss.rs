//! GNSS residuals along, across and up: mean and slope in time per flight. They have a variance factor of their own: the a-priori
//! precision of image measurements and of positions is wrong independently.

use super::columns::Columns;
use super::score::Noise;
use super::{Context, Found};
use nalgebra::Vector3;

/// Rows over which the redundancy of the positions is added up; of more, an even sample.
const SAMPLE: usize = 900;
/// Most columns.
const MOST_COLUMNS: usize = 600;

pub(super) fn test(context: &Context<'_>, found: &mut Found) {
    let base = context.base;
    let problem = base.problem;
    if problem.gnss.is_empty() {
        return;
    }
    let first = 2 * problem.observations.len() + 3 * problem.control.len();
    let rows = first..first + 3 * problem.gnss.len();
    let noise = Noise {
        sum_of_squares: rows.clone().map(|row| base.standardised(row).powi(2)).sum(),
        degrees: base.redundancy_of(rows, SAMPLE),
    };
    let flights = problem.block_context.counts[1] as usize;
    for (name, what) in [("gnss-along", "along the track"), ("gnss-across", "across the track"), ("gnss-up", "up")] {
        let direction = |image: usize| -> Option<Vector3<f64>> {
            if name == "gnss-up" {
                return Some(Vector3::z());
            }
            let velocity = problem.image_contexts[image].velocity;
            let along = Vector3::new(velocity.x, velocity.y, 0.0).try_normalize(f64::MIN_POSITIVE)?;
            along.x.is_finite().then(|| if name == "gnss-along" { along } else { Vector3::new(along.y, -along.x, 0.0) })
        };
        let mut columns = Vec::new();
        let (mut sums, mut known) = (vec![(0usize, 0.0); flights], 0);
        for (g, position) in problem.gnss.iter().enumerate() {
            let image = position.index as usize;
            let constants = &problem.image_contexts[image];
            let Some(direction) = direction(image) else { continue };
            known += 1;
            let flight = constants.flight as usize;
            let share = constants.flight_time_s / constants.flight_span_s - 0.5;
            for k in 0..3 {
                let row = first + 3 * g + k;
                let value = direction[k] / position.sigma[k];
                let mut entries = vec![(2 * flight, value)];
                if share.is_finite() {
                    entries.push((2 * flight + 1, value * share));
                }
                columns.push((row, entries));
                sums[flight].1 += direction[k] * base.standardised(row) * position.sigma[k];
            }
            sums[flight].0 += 1;
        }
        if known == 0 || 2 * flights > MOST_COLUMNS {
            found.skip(name, "no velocities, or too many flights");
            continue;
        }
        let score = base.score(&Columns::on_rows(2 * flights, problem.observations.len(), columns));
        let all: Vec<usize> = (0..2 * flights).collect();
        let worst = sums.iter().filter(|(n, _)| *n > 0).map(|(n, sum)| sum / *n as f64);
        let worst = worst.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        let description =
            format!("mean and slope in time of {flights} flights {what}; largest mean residual {:.1} mm", 1e3 * worst);
        found.push(name, score.test(&all, noise, 1.0), description);
    }
}
