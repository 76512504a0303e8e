// The points with the largest errors by name, beneath a map of them. A click shows where a point was marked in the
// images.

import { fill, h } from "./dom.js";
import { showMarks } from "./marks.js";
import { significant } from "./numbers.js";
import { pointsOf, shownPoints } from "./points.js";

const ORDERS = { plan: (one) => Math.hypot(one.dx_mm, one.dy_mm), height: (one) => Math.abs(one.dz_mm) };

/** The list of a map, in `box`; it takes the room that the map leaves. */
export async function drawWorst(box, view, node) {
  const points = shownPoints(await pointsOf(node).catch(() => []));
  if (Number(box.dataset.node) === node && box.childElementCount) return;
  box.dataset.node = node;
  const size = ORDERS[view];
  const sorted = [...points].filter((one) => Number.isFinite(size(one))).sort((a, b) => size(b) - size(a));
  const number = (value) => h("td.number", {}, significant(value, 3));
  const row = (one) => h("tr", { tabindex: "0", title: `Show the marks of ${one.point} in the images`,
    onclick: () => showMarks(one), onkeydown: (event) => event.key === "Enter" && showMarks(one) },
    h("th", { scope: "row" }, one.point), number(one.dx_mm), number(one.dy_mm), number(one.dz_mm),
      h("td.number", {}, String(one.marks.length)));
  fill(box, sorted.length > 0 && h("table", {},
    h("thead", {}, h("tr", {}, ["largest errors, mm", "E", "N", "H", "images"]
      .map((name) => h("th", { scope: "col" }, name)))), h("tbody", {}, sorted.map(row))));
}
