//! Points in chunks: what threads take, one after the other.

use std::ops::Range;

/// Measurements per chunk: below this the overhead of a private system shows.
const CHUNK_MEASUREMENTS: usize = 16_384;
/// Chunks of the full size at most: each costs one pass over the touched part of the reduced system.
const MAX_CHUNKS: usize = 64;
/// A chunk takes no more than this share of what is left, so that no thread works long on the last one while others
/// wait. Source: Polychronopoulos and Kuck (1987), guided self-scheduling.
const SHARE_OF_REST: usize = 4;
/// The smallest chunk, as a share of a full one.
const SHARE_OF_FULL: usize = 4;

/// Splits points, of which number `j` has the measurements `starts[j]..starts[j + 1]`, into chunks, the last of them
/// smaller. They depend on the problem alone, so that results do not depend on the number of threads.
pub fn chunks(starts: &[usize]) -> Vec<Range<usize>> {
    let (points, measurements) = (starts.len() - 1, starts[starts.len() - 1]);
    let full = measurements.div_ceil(MAX_CHUNKS).max(CHUNK_MEASUREMENTS);
    let least = if measurements <= full { full } else { full / SHARE_OF_FULL };
    let (mut chunks, mut first) = (Vec::new(), 0);
    while first < points {
        let rest = measurements - starts[first];
        let size = (rest / SHARE_OF_REST).clamp(least, full).min(rest);
        let end = match size == rest {
            true => points,
            false => starts.partition_point(|start| *start < starts[first] + size).clamp(first + 1, points),
        };
        chunks.push(first..end);
        first = end;
    }
    chunks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_have_every_point_once_and_get_smaller() {
        for points in [0, 1, 3000, 30_000, 3_000_000] {
            let starts: Vec<usize> = (0..=points).map(|j| 5 * j + j % 3).collect();
            let chunks = chunks(&starts);
            assert!(chunks.iter().flat_map(Clone::clone).eq(0..points), "{points}");
            let sizes: Vec<usize> = chunks.iter().map(|c| starts[c.end] - starts[c.start]).collect();
            match starts[points] {
                small if small <= CHUNK_MEASUREMENTS => assert!(sizes.len() <= 1, "{points}"),
                _ => assert!(sizes[sizes.len() - 1] <= 2 * sizes[0] / SHARE_OF_FULL, "{points}: {sizes:?}"),
            }
            // A point more than the full size, at the most.
            assert!(sizes.iter().all(|size| *size <= CHUNK_MEASUREMENTS.max(starts[points].div_ceil(MAX_CHUNKS)) + 7));
        }
    }

    #[test]
    fn points_without_measurements_are_in_a_chunk_too() {
        assert_eq!(chunks(&[0, 0, 0]), std::slice::from_ref(&(0..2)));
        assert_eq!(chunks(&[0, 4, 4, 4]), std::slice::from_ref(&(0..3)));
    }
}
