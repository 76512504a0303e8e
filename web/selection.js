// The brushed measurements: how many, how they differ from all, in which images, and each one with a way to set it
// aside.

import { json, query } from "./api.js";
import { button, fill, h } from "./dom.js";
import { count, fixed, px } from "./numbers.js";
import { chosen, on, set, state } from "./state.js";
import { brushWords, clearBrush } from "./brush.js";
import { change } from "./steps.js";
import { showImage } from "./views.js";

const PAGE = 50;
let answer = null;
let all = null; // the summary of the step without a brush, by step
let open = false;
let order = "size";
let busy = false;
let wanted = null;

export function startSelection() {
  on(["node", "brush", "tree"], refresh);
}

const single = () => (state.brush?.length === 1 ? state.brush[0] : state.brush);

/** Asks for the newest brush only: while one answer is awaited the others in between are left out. */
async function refresh() {
  if (chosen()?.state !== "done") return fill(document.getElementById("selection"));
  wanted = query(`nodes/${state.node}/measurements`, { brush: single(), limit: open ? PAGE : 0, sort: order });
  if (busy) return;
  busy = true;
  try {
    for (let path = null; path !== wanted; ) {
      path = wanted;
      const node = state.node;
      if (all?.node !== node) all = { node, ...(await json(query(`nodes/${node}/measurements`, { limit: 0 }))) };
      answer = await json(path);
      set({ brushedImages: state.brush ? answer.images : null });
      draw();
    }
  } catch (error) {
    fill(document.getElementById("selection"), h("p.error", {}, error.message));
  } finally {
    busy = false;
  }
}

function draw() {
  const box = document.getElementById("selection");
  const drawer = h("div.drawer", {}, open && table());
  box.classList.toggle("open", open);
  fill(box, h("div.strip", {}, state.brush ? brushed() : idle(),
    button(open ? "Hide rows" : "Show rows", () => { open = !open; refresh(); },
      { title: "The measurements one by one", key: "R", id: "rows" })), drawer);
}

/** Opens the rows, or closes them. */
export function toggleRows() {
  open = !open;
  refresh();
}

function idle() {
  return [h("b", {}, `${count(answer.total)} measurements`), h("span", {}, `${px(answer.rms_px)} px RMS`),
    h("span.where", {}, "Drag over any figure: the same measurements stand out in all the others.")];
}

function brushed() {
  const images = answer.images.length;
  const where = state.brush.map((brush) => brushWords(brush, state.block)).join(", and ");
  return [h("b.mark", {}, `${count(answer.n)} of ${count(answer.total)}`),
    h("span", {}, h("b", {}, px(answer.rms_px)), " px RMS ", h("span.quiet", {}, `(all: ${px(all?.rms_px)})`)),
    answer.n > 0 && h("span.mean", {}, "mean ", h("b", {},
      `${fixed(answer.mean_px[0], 3)}, ${fixed(answer.mean_px[1], 3)}`), " px"),
    h("span", {}, `${images} image${images === 1 ? "" : "s"}`),
    h("span.where", { title: where }, where),
    button("Set aside", () => change({ kind: "set_aside_brush", brush: single() }),
      { title: "A step without the brushed measurements", disabled: !answer.n }),
    button("Clear", clearBrush, { title: "No measurement stands out", key: "Esc" })];
}

function table() {
  const head = ["image", "point", "kind", "x", "y", "rx", "ry", "residual / σ", ""];
  const sorts = { image: "image", "residual / σ": "size" };
  return h("table", {},
    h("thead", {}, h("tr", {}, head.map((name) => h("th", { scope: "col" },
      sorts[name] ? button(name + (order === sorts[name] ? " ▾" : ""), () => { order = sorts[name]; refresh(); },
      { kind: "plain", title: `Sort by ${name}` }) : name)))),
    h("tbody", {}, answer.rows.map(row)),
    h("caption", {}, answer.rows.length < answer.n ? `The first ${answer.rows.length} of ${count(answer.n)}; x, y, `
      + `rx, ry in px, residuals observed minus computed` : "x, y, rx, ry in px, residuals observed minus computed"));
}

function row(one) {
  const which = [{ image: one.image_name, point: one.point, kind: one.kind }];
  return h(one.set_aside ? "tr.aside" : "tr", { title: one.reason },
    h("td", {}, button(one.image_name, () => showImage(one.image), { kind: "plain", title: "Show this image" })),
    h("td", {}, one.point), h("td", {}, one.kind),
    ...(one.set_aside ? [h("td.reason", { colspan: "5" }, one.reason)]
      : [[one.x, 1], [one.y, 1], [one.rx, 3], [one.ry, 3], [one.normalised, 1]]
      .map(([value, decimals]) => h("td.number", {}, fixed(value, decimals)))),
    h("td", {}, one.set_aside
      ? button("Take back", () => change({ kind: "take_back", measurements: which }), { title: one.reason })
      : button("Set aside", () => change({ kind: "set_aside", measurements: which }),
        { title: "A step without this measurement" })));
}
