// Scales of figures. Two pictures can be compared only at one scale: what is drawn beside, over or after another takes the scale of that one.

import { query } from "./api.js";
import { state } from "./state.js";

/** Scale of arrows and range of the vertical axis by kind of figure, as the server answered them. */
const held = new Map();

const keyOf = (view, { camera, against, component } = {}) => [view, camera, against, component].join("|");

/** Whether a figure must take the scale that is held, rather than its own. */
const bound = ({ predicted, earlier, brush }) => Boolean(state.locked || predicted || earlier || brush);

/**
 * Path of a figure. `options`: camera, against, component, image, width, brush, `predicted` (effect) and `earlier` (drawn to be compared
 * with the chosen step).
 */
export function figureQuery(node, view, options = {}) {
  const { predicted, earlier, ...parameters } = options;
  const path = predicted ? `nodes/${node}/predicted/${encodeURIComponent(predicted)}/figures/${view}.svg` : `nodes/${node}/figures/${view}.svg`;
  const scale = bound(options) ? held.get(keyOf(view, options)) : null;
  return query(path, { ...parameters, scale: scale?.arrows, y: scale?.range });
}

/** Keeps the scale of a drawing for those that are to be compared with it; one that is held stays until scales are fitted again. */
export function holdScale(view, options, drawing) {
  const key = keyOf(view, options);
  if (bound(options) && held.has(key)) return;
  const plots = [...drawing.querySelectorAll("rect.plot[data-y]")].filter((plot) => plot.dataset.ylog !== "1");
  const values = plots.flatMap((plot) => plot.dataset.y.split(" ").map(Number)).filter(Number.isFinite);
  const chart = view === "profile" || view === "images" || view === "histogram";
  held.set(key, {
    arrows: drawing.dataset.scale ?? null,
    range: chart && values.length ? `${Math.min(...values)},${Math.max(...values)}` : null,
  });
}

/** Figures are drawn at their own scale from now on; the next that is drawn is held. */
export const fitScales = () => held.clear();
