// The sliders of a plan: one for each number of the scenario that can be turned.

import { button, choice, h } from "./dom.js";

/** Steps of a slider. */
const STEPS = 400;
/** A slider whose greatest value is this many times its least one moves by ratios. */
const WIDE = 50;

const DATUMS = [["", "all that the block has"], ["control", "control points"], ["gnss", "GNSS"],
  ["free", "tie points alone"]];

/** A slider is even in this function of its value: in the logarithm, where it has far to go. From zero there is no
 * ratio: counts begin at one more. */
function scaleOf({ min, max }) {
  if (min > 0 && max / min > WIDE) return [Math.log, Math.exp];
  if (min === 0 && max > WIDE) return [Math.log1p, Math.expm1];
  return [(value) => value, (value) => value];
}

/** Where a value stands on its slider, from 0 to 1. */
export function placeOf(dial, value) {
  const [scale] = scaleOf(dial);
  return (scale(value) - scale(dial.min)) / (scale(dial.max) - scale(dial.min));
}

/** The value at a place of a slider, in two digits; a whole number where it has to be one. */
export function valueAt(dial, place) {
  const { min, max, whole } = dial;
  const [scale, inverse] = scaleOf(dial);
  const exact = inverse(scale(min) + place * (scale(max) - scale(min)));
  const step = Math.max(whole ? 1 : 0, 10 ** (Math.floor(Math.log10(Math.abs(exact) || 1)) - 1));
  const rounded = Math.round(exact / step) * step;
  return Math.min(max, Math.max(min, Number(rounded.toPrecision(12))));
}

/** The name of a parameter as words; its unit apart. */
export function wordsOf(name) {
  const units = { m: "m", deg: "°", m2: "m²", s: "s", px: "px" };
  const parts = name.split("_");
  const unit = parts.length > 1 ? units[parts.at(-1)] : undefined;
  if (unit) parts.pop();
  return [parts.join(" ").replace("gnss", "GNSS"), unit ?? ""];
}

/** Draws the dials; `turned(values, datum)` is called with every value that is not the scenario's. */
export function drawDials(place, { scenario, dials, datum }, turned) {
  const values = {};
  let chosen = datum ?? "";
  // Where the command line says another datum, the default has to be said.
  const tell = () => turned(values, chosen || (datum ? "all" : null));
  const rows = dials.map((dial) => slider(dial, (value) => {
    if (value === null || value === dial.value) delete values[dial.name];
    else values[dial.name] = value;
    tell();
  }));
  const datums = choice("What defines position, orientation and scale", DATUMS, chosen, (value) => {
    chosen = value;
    tell();
  });
  const reset = button("As the scenario says", () => {
    rows.forEach((row) => row.reset());
    Object.keys(values).forEach((name) => delete values[name]);
    tell();
  }, { title: "Put every slider back" });
  const none = h("p.quiet", {}, "The scenario has no [parameters]: docs/planning.md says how to give it some.");
  place.append(h("h2", {}, scenario), reset, h("label.dial", {}, h("span.name", {}, "datum"), datums),
    ...(dials.length ? rows.map((row) => row.element) : [none]));
}

function slider(dial, turn) {
  const [words, unit] = wordsOf(dial.name);
  const start = dial.value ?? dial.min;
  const shown = h("input", { type: "number", min: dial.min, max: dial.max, step: dial.whole ? "1" : "any",
    "aria-label": `${words} ${unit}`.trim(), value: dial.value ?? "", placeholder: "–" });
  const range = h("input", { type: "range", min: "0", max: "1", step: String(1 / STEPS),
    "aria-label": dial.about, value: placeOf(dial, start) });
  const take = (value) => {
    range.value = String(placeOf(dial, value ?? start));
    shown.value = value === null ? "" : String(value);
  };
  range.addEventListener("input", () => {
    const value = valueAt(dial, Number(range.value));
    shown.value = String(value);
    turn(value);
  });
  shown.addEventListener("change", () => {
    // A value beyond the limits is the server's to refuse, which says them.
    const value = shown.value === "" ? dial.value : Number(shown.value);
    take(value);
    turn(value);
  });
  const element = h("div.dial", { title: dial.about }, h("span.name", {}, words),
    h("span.value", {}, shown, h("span.unit", {}, ` ${unit}`)), range);
  return { element, reset: () => take(dial.value) };
}
