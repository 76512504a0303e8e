// Names in the figures: what the pointer is at. A figure in plan knows where its axes are, the page where points and
// images lie.

import { h } from "./dom.js";
import { fixed, significant } from "./numbers.js";
import { measurementsIn, pointsOf, shownPoints } from "./points.js";
import { plotsOf } from "./plots.js";
import { state } from "./state.js";

/** As near as this to the foot of an arrow, px of the screen. */
const NEAR = 12;

const mm = (value) => significant(value, 3);

/** `check point C1: dE 3.2, dN −1.0, dH 8.8 mm`. */
export const pointWords = (one) =>
  `${one.role} point ${one.point}: dE ${mm(one.dx_mm)}, dN ${mm(one.dy_mm)}, dH ${mm(one.dz_mm)} mm`;

const images = () => state.block.images.map((one, image) =>
  ({ at: { e: one.e, n: one.n }, image, words: `image ${one.name}` }));

/** What a figure shows by name: place by the keys of its axes, and words. */
const SHOWN = {
  plan: async (node) => shownPoints(await pointsOf(node))
    .map((one) => ({ at: { e: one.e, n: one.n }, point: one, words: pointWords(one) })),
  flights: async (node) => [...images(), ...(await pointsOf(node))
    .map((one) => ({ at: { e: one.e, n: one.n }, point: one, words: pointWords(one) }))],
  gnss: async () => images(),
  image: async (node, image) => (await measurementsIn(node, image)).map((one) => ({
    at: { x: one.x, y: one.y }, measurement: one, words: `${one.kind === "mark" ? "mark of" : "tie point"} `
      + `${one.point}: ${fixed(one.rx, 2)}, ${fixed(one.ry, 2)} px`,
  })),
};
SHOWN.height = SHOWN.plan;

/** The thing by name that is nearest to a pointer event in a figure; null where none is near. */
export async function nearest(figure, event) {
  const { view, drawing, asked } = figure;
  if (!drawing || !asked) return null;
  const bar = document.elementsFromPoint(event.clientX, event.clientY)
    .find((one) => one.dataset?.image !== undefined && drawing.contains(one) && !one.classList.contains("plot"));
  if (bar) return { image: Number(bar.dataset.image),
    words: `image ${state.block.images[Number(bar.dataset.image)].name}` };
  if (!SHOWN[view]) return null;
  const all = await SHOWN[view](asked.node, asked.options.image).catch(() => []);
  if (figure.drawing !== drawing) return null;
  const place = figure.place(event);
  const shrunk = drawing.getBoundingClientRect().width / Number(drawing.getAttribute("viewBox").split(" ")[2]);
  const plots = plotsOf(drawing).filter((plot) => plot.keys.x && plot.keys.y);
  let best = { distance: NEAR / shrunk };
  for (const plot of plots) {
    for (const one of all) {
      const distance = Math.hypot(plot.x.pixel(one.at[plot.keys.x]) - place[0],
        plot.y.pixel(one.at[plot.keys.y]) - place[1]);
      if (distance < best.distance) best = { distance, one };
    }
  }
  return best.one ?? null;
}

/** Shows names in a figure while the pointer moves over it. */
export function named(figure) {
  const tip = h("div.tip", { hidden: true });
  figure.element.append(tip);
  let latest = null;
  const hide = () => { latest = null; tip.hidden = true; };
  figure.element.addEventListener("pointerleave", hide);
  figure.element.addEventListener("pointerdown", hide);
  figure.element.addEventListener("pointermove", async (event) => {
    if (event.buttons) return;
    latest = event;
    const found = await nearest(figure, event);
    if (latest !== event) return;
    tip.hidden = !found;
    if (!found) return;
    const box = figure.element.getBoundingClientRect();
    // Errors are those of the step: a prediction has others.
    tip.textContent = state.predicted ? found.words.split(":")[0] : found.words;
    tip.style.left = `${Math.max(0, Math.min(event.clientX - box.left + 12, box.width - tip.offsetWidth - 4))}px`;
    tip.style.top = `${Math.min(event.clientY - box.top + 14, box.height - 26)}px`;
  });
}
