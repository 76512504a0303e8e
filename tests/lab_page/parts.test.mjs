// What of the page needs no browser: axes and brushes, numbers, the rows of the tree, the numbers in space.

import assert from "node:assert/strict";
import test from "node:test";
import { brushBetween, isOf, plotOf, rectangleOf } from "../../web/plots.js";
import { judged, verdictOf } from "../../web/judge.js";
import { expected, timeWords } from "../../web/timing.js";
import { editsInWords } from "../../web/edits.js";
import { change, rowsOf } from "../../web/plan_answer.js";
import { placeOf, valueAt, wordsOf } from "../../web/plan_dials.js";
import { mm, probability, significant, unitText, withSigma } from "../../web/numbers.js";
import { extent, quantile, readSpace, rectangle, roundBelow } from "../../web/space_data.js";
import { rows } from "../../web/lanes.js";

const sensor = plotOf({ dataset: { view: "sensor", camera: "0", x: "0 5000", px: "100 600", xkey: "x", y: "0 4000",
  py: "50 450", ykey: "y" } });
const profile = plotOf({ dataset: { view: "profile", against: "time", x: "1 1000", px: "0 300", xkey: "range",
  xlog: "1", y: "0.5 -0.5", py: "10 110" } });

test("a brush is what the axes say between two places, whichever way it was dragged", () => {
  const brush = brushBetween(sensor, [300, 250], [200, 150]);
  assert.deepEqual(brush, { view: "sensor", camera: 0, x: [1000, 2000], y: [1000, 2000] });
  assert.deepEqual(rectangleOf(sensor, brush), [200, 150, 300, 250]);
  assert.ok(isOf(brush, sensor) && !isOf(brush, profile) && !isOf({ ...brush, camera: 1 }, sensor));
});

test("beyond the area it ends at the area, without a key it takes the whole axis, and logarithmic axes are so", () => {
  assert.deepEqual(brushBetween(sensor, [0, 0], [900, 900]), { view: "sensor", camera: 0, x: [0, 5000], y: [0, 4000] });
  const band = brushBetween(profile, [100, 20], [200, 30]);
  assert.deepEqual(Object.keys(band), ["view", "against", "range"]);
  assert.ok(Math.abs(band.range[0] - 10) < 1e-9 && Math.abs(band.range[1] - 100) < 1e-9, String(band.range));
  assert.deepEqual(rectangleOf(profile, band).map(Math.round), [100, 10, 200, 110]);
});

test("numbers are rounded to what they mean", () => {
  assert.equal(mm(0.004384), "4.38");
  assert.equal(mm(null), "–");
  assert.equal(significant(-0.00001234), "−1.23e−5");
  assert.equal(significant(1234.4, 3), "1234");
  assert.equal(withSigma(0.019238, 0.00045372), "0.01924 ± 0.00045");
  assert.equal(withSigma(1.50044e-9, 1.3e-12), "(1.5004 ± 0.0013)e−9");
  assert.equal(withSigma(-5.06, 0.66), "−5.06 ± 0.66");
  assert.equal(probability(0), "p < 1e−300");
  assert.equal(probability(5e-43), "p = 5e−43");
  assert.equal(unitText("px^-2"), "px⁻²");
  assert.equal(unitText("1"), "");
});

test("what Mend does is told by file", () => {
  const affine = (column, factor, offset) => ({ file: "control.csv", affine: { column, factor, offset } });
  assert.equal(editsInWords([affine("x", 0.3048, 0), affine("z", 1, -47.3)]), "control.csv: x × 0.3048, z − 47.3");
  const exchange = { file: "images.csv", "exchange-columns": { columns: ["gnss_x", "gnss_y"] } };
  const shift = (by) => ({ file: "images.csv", shift: { columns: ["gnss_x"], by, within: "flight" } });
  assert.equal(editsInWords([shift(1)]), "images.csv: gnss_x moved down by 1 row");
  assert.equal(editsInWords([shift(-2)]), "images.csv: gnss_x moved up by 2 rows");
  assert.equal(editsInWords([exchange, { file: "ties.csv", remove: null }]),
    "images.csv: gnss_x and gnss_y exchanged; ties.csv: rows left out");
});

test("a first child goes on in its parent's lane, and branches stand below it, the newest last", () => {
  const nodes = [[1, null], [2, 1], [3, 1], [4, 2], [5, 3], [6, 1]].map(([id, parent]) => ({ id, parent }));
  assert.deepEqual(rows(nodes).map(({ node, lane, above }) => [node.id, lane, above]),
    [[1, 0, null], [2, 0, 0], [4, 0, 1], [3, 1, 0], [5, 1, 3], [6, 2, 0]]);
});

test("the block in space is read as it was written", () => {
  const header = JSON.stringify({ origin: [0, 0, 0], ties: { rows: 7, brushed: 3 },
    arrays: [{ name: "ties", columns: ["x", "y", "z", "rms_px"], rows: 2 },
    { name: "checks", columns: ["x", "y", "z", "dx", "dy", "dz"], rows: 1, ids: ["c1"] }] });
  const padded = header.padEnd(Math.ceil(header.length / 4) * 4);
  const values = [1, 2, 3, 0.25, 4, 5, 6, 0.5, 7, 8, 9, 0.125, NaN, -0.5];
  const buffer = new ArrayBuffer(4 + padded.length + 4 * values.length);
  new DataView(buffer).setUint32(0, padded.length, true);
  new Uint8Array(buffer, 4).set(new TextEncoder().encode(padded));
  new Float32Array(buffer, 4 + padded.length).set(values);
  const { ties, checks, control, all } = readSpace(buffer);
  assert.deepEqual(all, { rows: 7, brushed: 3 });
  assert.deepEqual(ties.place(1), [4, 5, 6]);
  assert.equal(ties.of("rms_px")(1), 0.5);
  assert.equal(ties.of("brushed"), null);
  assert.deepEqual(checks.triple("dx", "dy", "dz")(0), [0.125, NaN, -0.5]);
  assert.equal(control.rows, 0);
  assert.deepEqual(extent({ stations: control, ties, checks, control }).centre, [4, 5, 6]);
});

test("a rectangle of the screen is one of the picture, upwards", () => {
  assert.deepEqual(rectangle([400, 0], [100, 150], [400, 200]), { x: [-0.5, 1], y: [-0.5, 1] });
});

test("round numbers and quantiles", () => {
  assert.deepEqual([0.0234, 7, 1999, 0.5].map(roundBelow), [0.02, 5, 1000, 0.5]);
  assert.equal(quantile([3, 1, NaN, 2], 0.5), 2);
  assert.ok(Number.isNaN(quantile([], 0.5)));
});

test("a step is judged by its check points, whatever fits better", () => {
  assert.equal(judged(17.1, 3.4), "better");
  assert.equal(judged(17.1, 17.15), "same");
  assert.equal(judged(3.4, 17.1), "worse");
  const before = { check_rms_m: 0.0034, heldout_px: 0.33, gnss_rms_m: 0.05 };
  assert.equal(verdictOf(before, { check_rms_m: 0.0171, heldout_px: 0.2, gnss_rms_m: 0.01 }), "worse");
  assert.equal(verdictOf({ ...before, check_rms_m: null }, { check_rms_m: null, heldout_px: 0.2, gnss_rms_m: 0.5 }),
    "better");
  assert.equal(verdictOf(null, before), "same");
});

test("the end of a step is estimated from those of its kind, else from those like it", () => {
  const node = (kind, seconds, state = "done") => ({ state, seconds, change: { kind } });
  const nodes = [node("base", 40), node("add", 10), node("add", 14), node("add", 12), node("add", 99, "failed")];
  assert.equal(expected(node("add", 3, "running"), nodes), 12);
  assert.equal(expected(node("datum", 3, "running"), nodes), 12);
  assert.equal(expected(node("mend", 3, "running"), nodes), 40);
  assert.equal(expected(node("base", 3, "running"), nodes.slice(1)), null);
  assert.equal(timeWords(4, 12), "4 s, about 8 s left");
  assert.equal(timeWords(15, 12), "15 s, expected 12 s");
  assert.match(timeWords(200, null), /^3 min; no step/);
});

test("a slider and its value agree, whole numbers stay whole, and the ends are the ends", () => {
  const dials = [{ min: 20, max: 500, whole: false }, { min: 0, max: 10_000, whole: true },
    { min: 0.005, max: 5, whole: false }, { min: 0, max: 10, whole: true }, { min: 0, max: 45, whole: false }];
  for (const dial of dials) {
    assert.deepEqual([valueAt(dial, 0), valueAt(dial, 1)], [dial.min, dial.max]);
    for (const place of [0.1, 0.35, 0.5, 0.8]) {
      const value = valueAt(dial, place);
      assert.ok(!dial.whole || Number.isInteger(value), `${value}`);
      assert.ok(Math.abs(placeOf(dial, value) - place) < 0.06, `${value} at ${placeOf(dial, value)}, not ${place}`);
    }
  }
  assert.deepEqual(wordsOf("gnss_xy_m"), ["GNSS xy", "m"]);
  assert.deepEqual(wordsOf("cross_strips"), ["cross strips", ""]);
});

test("a number that fell is better, one that hardly moved is no change, and one that was not there is none", () => {
  assert.deepEqual(change(0.9, 1), { text: "−10 %", kind: "better" });
  assert.deepEqual(change(3, 1), { text: "× 3.0", kind: "worse" });
  assert.deepEqual([change(1.001, 1), change(1, NaN), change(null, 1)], [null, null, null]);
});

test("effects of many parameters have one row: what moves points most", () => {
  const size = (parameter, moves_m) => ({ parameter, size: 1, moves_m });
  const plan = { effects: [{ effect: "few", sizes: [size("a", 1), size("b", 2)] },
    { effect: "many", sizes: [size("a", 1), size("b", 9), size("c", null), size("d", 2)] }] };
  assert.deepEqual(rowsOf(plan).map((row) => [row.effect, row.parameter, row.more ?? 0]),
    [["few", "a", 0], ["few", "b", 0], ["many", "b", 3]]);
});
