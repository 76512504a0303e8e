// Scales of figures. Two pictures can be compared only at one scale: what is drawn beside, over or after another takes
// the scale of that one.

import { query } from "./api.js";
import { on, state } from "./state.js";

/** Scale of arrows and range of the vertical axis by kind of figure, as the server answered them. */
const held = new Map();
const CHARTS = ["profile", "images", "histogram", "gnss"];

/** A brush has a range of its own: it would not do to leave the axes wide when it is gone. */
const keyOf = (view, { camera, against, component, show, brush } = {}) =>
  [view, camera, against, component, show, brush ? "brush" : ""].join("|");
const heldFor = (view, options) => held.get(keyOf(view, options)) ?? held.get(keyOf(view, { ...options, brush: null }));

/** Length of the longest arrow of all steps in such a figure; null where the server does not know it. */
function longestOf(view, { camera, show } = {}) {
  const all = JSON.parse(state.longest);
  const length = { sensor: all.sensor?.[camera ?? 0], plan: all.plan, height: all.height,
    gnss: all[`gnss_${show}`] }[view];
  return length > 0 ? length : null;
}

// A step with longer arrows than any before: the scales that are held do not fit it.
on(["longest"], () => {
  for (const [key, scale] of held) if (scale.arrows) held.delete(key);
});

on(["brush"], () => {
  if (!state.brush) for (const key of held.keys()) if (key.endsWith("|brush")) held.delete(key);
});

/** Whether a figure must take the scale that is held, rather than its own. */
const bound = ({ predicted, earlier, brush }) => Boolean(state.locked || predicted || earlier || brush);

/**
 * Path of a figure. `options`: camera, against, component, show, image, width, brush, `predicted` (effect) and
 * `earlier` (drawn to be compared
 * with the chosen step).
 */
export function figureQuery(node, view, options = {}) {
  const { predicted, earlier, ...parameters } = options;
  const path = predicted ? `nodes/${node}/predicted/${encodeURIComponent(predicted)}/figures/${view}.svg`
    : `nodes/${node}/figures/${view}.svg`;
  const scale = bound(options) ? heldFor(view, options) : null;
  const longest = scale?.arrows || !state.locked ? null : longestOf(view, options);
  return query(path, { ...parameters, scale: scale?.arrows, longest, y: scale?.range?.join(",") });
}

/** Range of the vertical axes of a chart; null of what has arrows. */
function rangeOf(view, drawing) {
  if (!CHARTS.includes(view) || drawing.dataset.scale) return null;
  const plots = [...drawing.querySelectorAll("rect.plot[data-y]")].filter((plot) => plot.dataset.ylog !== "1");
  const values = plots.flatMap((plot) => plot.dataset.y.split(" ").map(Number)).filter(Number.isFinite);
  return values.length ? [Math.min(...values), Math.max(...values)] : null;
}

/**
 * Keeps the scale of a drawing for those that are to be compared with it. One that is held stays until scales are
 * fitted again, except that
 * an axis becomes longer where a picture needs it; says whether it did, so that the others are drawn anew.
 */
export function holdScale(view, options, drawing) {
  const known = bound(options) ? heldFor(view, options) : null;
  const range = rangeOf(view, drawing);
  if (!known) {
    held.set(keyOf(view, options), { arrows: drawing.dataset.scale ?? null, range });
    return false;
  }
  const wider = range && known.range ? [Math.min(range[0], known.range[0]), Math.max(range[1], known.range[1])]
    : known.range;
  held.set(keyOf(view, options), { ...known, range: wider });
  return String(wider) !== String(known.range) && !options.brush;
}

/** Figures are drawn at their own scale from now on; the next that is drawn is held. */
export const fitScales = () => held.clear();
