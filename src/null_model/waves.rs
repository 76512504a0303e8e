//! Points go through in waves of batches: while the batches of one wave are added up, the rows of the next are made.

use super::batch::Batch;
use super::source::Source;
use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::locked;
use std::ops::Range;
use std::sync::Mutex;

/// Image measurements of a batch, at the most.
const BATCH_MEASUREMENTS: usize = 400;
/// The least that it is worth to sum at a time.
const LEAST_BATCH: usize = 100;
/// Numbers in the dense columns of a batch, at the most: half a megabyte, which stays in the cache of one thread.
const BATCH_NUMBERS: usize = 1 << 16;
/// Batches of a wave: enough to keep some threads busy, few enough that the rows of two waves take some 50 MB.
const WAVE: usize = 12;

/// Adds the batches of a wave, in their order, to something of its own.
pub(super) type Task<'a> = Box<dyn FnMut(&[Batch]) + Send + 'a>;

/// What a thread takes next.
enum Job<'a, 'b> {
    Add(&'a mut Task<'b>),
    Make(Rows, &'a mut Option<Result<Batch, AdjustError>>),
}

/// What the rows of a batch are of.
#[derive(Clone)]
enum Rows {
    Points(Range<usize>),
    Antennas(Range<usize>),
}

/// Calls every task with the batches of each wave in turn, points first, then antennas, on the threads of the current
/// pool.
///
/// # Errors
/// A state that cannot be projected.
pub(super) fn waves(source: &Source<'_>, mut tasks: Vec<Task<'_>>) -> Result<(), AdjustError> {
    let mut ranges: Vec<Rows> = point_ranges(source).into_iter().map(Rows::Points).collect();
    ranges.extend(ranges_of(source.problem.gnss.len(), BATCH_MEASUREMENTS).map(Rows::Antennas));
    let spare = Mutex::new(Vec::new());
    let mut made: Vec<Batch> = Vec::new();
    for wave in ranges.chunks(WAVE).chain([&[][..]]) {
        let mut next: Vec<Option<Result<Batch, AdjustError>>> = wave.iter().map(|_| None).collect();
        // The large ones first: rows are made in small pieces, with which whoever is done early helps.
        let adding = tasks.iter_mut().map(Job::Add);
        let making = wave.iter().zip(&mut next).map(|(rows, to)| Job::Make(rows.clone(), to));
        let jobs = Mutex::new(adding.chain(making));
        let work = || {
            let take = || locked(&jobs).next();
            while let Some(job) = take() {
                match job {
                    Job::Add(task) => task(&made),
                    Job::Make(rows, to) => {
                        let again = locked(&spare).pop().unwrap_or_default();
                        *to = Some(match rows {
                            Rows::Points(range) => source.batch(range, again),
                            Rows::Antennas(range) => source.antennas(range, again),
                        });
                    }
                }
            }
        };
        rayon::scope(|scope| (0..rayon::current_num_threads()).for_each(|_| scope.spawn(|_| work())));
        locked(&spare).append(&mut made);
        made = next.into_iter().flatten().collect::<Result<_, _>>()?;
    }
    Ok(())
}

/// Ranges of points with about as many measurements each.
fn point_ranges(source: &Source<'_>) -> Vec<Range<usize>> {
    let starts = &source.problem.point_start;
    let points = starts.len() - 1;
    let measurements = (BATCH_NUMBERS / (2 * source.dense())).clamp(LEAST_BATCH, BATCH_MEASUREMENTS);
    let (mut ranges, mut first) = (Vec::new(), 0);
    while first < points {
        let end = starts.partition_point(|start| *start < starts[first] + measurements).min(points);
        ranges.push(first..end.max(first + 1));
        first = end.max(first + 1);
    }
    ranges
}

fn ranges_of(count: usize, size: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count.div_ceil(size)).map(move |k| k * size..((k + 1) * size).min(count))
}
