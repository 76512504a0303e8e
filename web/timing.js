// How long a step takes: what steps like it took in this laboratory.

/** Steps that begin with the raw block search outliers and starting values; the others go on from a fit. */
const BEGINNINGS = ["base", "simulate", "mend"];
const isBeginning = (node) => BEGINNINGS.includes(node.change?.kind);

function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}

/** Seconds that a step will take: the median of those of its kind, else of those like it; null where none is known. */
export function expected(node, nodes) {
  const done = nodes.filter((other) => other.state === "done" && other.seconds > 0);
  const same = done.filter((other) => other.change?.kind === node.change?.kind);
  const alike = done.filter((other) => isBeginning(other) === isBeginning(node));
  const known = same.length ? same : alike;
  return known.length ? median(known.map((other) => other.seconds)) : null;
}

const clock = (seconds) => (seconds < 90 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`);

/** `12 s, about 20 s left`. */
export function timeWords(elapsed, expected) {
  const so = clock(elapsed);
  if (expected === null) return `${so}; no step like it was timed yet`;
  const left = expected - elapsed;
  return left > 0.5 ? `${so}, about ${clock(Math.max(1, left))} left` : `${so}, expected ${clock(expected)}`;
}
