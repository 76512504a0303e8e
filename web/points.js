// Surveyed points and measurements of a step by name: asked for once, and kept, since steps never change.

import { json, query } from "./api.js";
import { state } from "./state.js";

const REMEMBERED = 12;
const known = new Map();

/** The answer to a path, or the promise of it; a refusal is asked for again. */
function once(path) {
  if (!known.has(path)) {
    known.set(path, json(path).catch((error) => {
      known.delete(path);
      throw error;
    }));
    if (known.size > REMEMBERED) known.delete(known.keys().next().value);
  }
  return known.get(path);
}

/** Surveyed points of a step with errors (mm) and marks, the largest error first. */
export const pointsOf = async (node) => (await once(`nodes/${node}/points`)).points;

/** Those of a role; of none, the ones that the figures show: check points where there are any. */
export const shownPoints = (points) => (points.some((one) => one.role === "check")
  ? points.filter((one) => one.role === "check") : points);

/** The measurements in an image of a step, with residuals. */
export async function measurementsIn(node, image) {
  const { width_px, height_px } = state.block.cameras[state.block.images[image].camera];
  const brush = { view: "image", image, x: [0, width_px], y: [0, height_px] };
  return (await once(query(`nodes/${node}/measurements`, { brush, limit: 10_000, sort: "image" }))).rows;
}
