// The block in space as the server sends it: a JSON header, then numbers row by row (src/lab/api.rs).

/** Arrays by name: `{rows, ids, of(column)}`, a column being a function of the row. `all` counts the tie points, those
 * that are not sent too. */
export function readSpace(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const arrays = {};
  for (const { name, columns, rows, ids = [] } of header.arrays) {
    const values = new Float32Array(buffer.slice(at, at + 4 * rows * columns.length));
    at += values.byteLength;
    const of = (column) => {
      const k = columns.indexOf(column);
      return k < 0 ? null : (row) => values[row * columns.length + k];
    };
    const triple = (a, b, c) => {
      const [x, y, z] = [of(a), of(b), of(c)];
      return (row) => [x(row), y(row), z(row)];
    };
    arrays[name] = { rows, ids, of, place: triple(...columns.slice(0, 3)), triple };
  }
  for (const name of ["stations", "ties", "checks", "control"]) {
    arrays[name] ??= { rows: 0, ids: [], of: () => null, place: () => [NaN, NaN, NaN],
      triple: () => () => [NaN, NaN, NaN] };
  }
  arrays.all = header.ties;
  return arrays;
}

/** Value below which a part `q` of the finite ones lies. */
export function quantile(values, q) {
  const sorted = Float64Array.from(values.filter(Number.isFinite)).sort();
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))] : NaN;
}

/** The round number (1, 2 or 5 times a power of ten) at or below `value`. */
export function roundBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (value / power >= 5 ? 5 : value / power >= 2 ? 2 : 1);
}

/** Centre, radius and box of what there is: stations, surveyed points and tie points, without the outermost. */
export function extent({ stations, ties, checks, control }) {
  const known = (...arrays) => arrays.flatMap((array) =>
    Array.from({ length: array.rows }, (_, row) => array.place(row))).filter((place) => place.every(Number.isFinite));
  const measured = known(stations, checks, control);
  const points = known(ties);
  const inner = [0, 1, 2].map((k) => [quantile(points.map((p) => p[k]), 0.002),
    quantile(points.map((p) => p[k]), 0.998)]);
  const places = [...measured, ...points.filter((p) =>
    p.every((value, k) => value >= inner[k][0] && value <= inner[k][1]))];
  if (!places.length) return { centre: [0, 0, 0], radius: 1, ends: [[-1, 1], [-1, 1], [0, 1]], places };
  const ends = [0, 1, 2].map((k) => [quantile(places.map((p) => p[k]), 0), quantile(places.map((p) => p[k]), 1)]);
  const centre = ends.map(([low, high]) => (low + high) / 2);
  const radius = Math.hypot(...ends.map(([low, high]) => high - low)) / 2 || 1;
  return { centre, radius, ends, places };
}

/** A rectangle of the screen in the coordinates of the picture: -1 to 1, upwards. */
export function rectangle([x0, y0], [x1, y1], [width, height]) {
  const sorted = (a, b) => (a <= b ? [a, b] : [b, a]);
  return { x: sorted((2 * x0) / width - 1, (2 * x1) / width - 1),
    y: sorted(1 - (2 * y0) / height, 1 - (2 * y1) / height) };
}
