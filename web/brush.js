// Brushing: a rectangle dragged on any figure; all figures show the same measurements. A rectangle can be dragged on;
// Shift adds one
// that has to hold as well.

import { fill, svg } from "./dom.js";
import { on, set, state } from "./state.js";
import { brushBetween, isOf, plotsOf, rectangleOf } from "./plots.js";

/** Less than this is a click, not a drag, in pixels of the screen. */
const CLICK = 4;

/** Makes a figure one that can be brushed. `clicked(event, plot)` is called for a click that is no drag. */
export function brushable(figure, clicked = () => {}) {
  figure.element.addEventListener("pointerdown", (event) => begin(figure, event, clicked));
  on(["brush"], () => mark(figure));
}

/** Draws the brushes that were made in this figure. */
export function mark(figure) {
  if (!figure.drawing) return;
  const marks = plotsOf(figure.drawing).flatMap((plot) => (state.brush ?? []).filter((brush) => isOf(brush, plot))
    .map((brush) => rectangleOf(plot, brush)));
  fill(figure.overlay, marks.map(([left, top, right, bottom]) =>
    svg("rect", { class: "brush", x: left, y: top, width: right - left, height: bottom - top })));
}

function begin(figure, event, clicked) {
  if (event.button !== 0 || !figure.drawing) return;
  const start = figure.place(event);
  const plot = plotsOf(figure.drawing).find((one) => one.x.inside(start[0]) && one.y.inside(start[1]));
  if (!plot) return;
  event.preventDefault();
  figure.element.setPointerCapture(event.pointerId);
  const own = (state.brush ?? []).find((brush) => isOf(brush, plot) && holds(rectangleOf(plot, brush), start));
  const others = event.shiftKey ? state.brush ?? [] : [];
  const rest = (state.brush ?? []).filter((brush) => brush !== own);
  let dragged = false;
  const move = (now) => {
    dragged ||= Math.hypot(now.clientX - event.clientX, now.clientY - event.clientY) > CLICK;
    if (!dragged) return;
    const place = figure.place(now);
    if (own && !event.shiftKey) set({ brush: [...rest, moved(plot, own, start, place)] });
    else set({ brush: [...others, brushBetween(plot, start, place)] });
  };
  const end = (now) => {
    figure.element.removeEventListener("pointermove", move);
    if (dragged) return;
    if (now.type === "pointerup" && !clicked(now, plot)) clearBrush();
  };
  figure.element.addEventListener("pointermove", move);
  figure.element.addEventListener("pointerup", end, { once: true });
  figure.element.addEventListener("pointercancel", end, { once: true });
}

const holds = ([left, top, right, bottom], [x, y]) => x >= left && x <= right && y >= top && y <= bottom;

/** The brush dragged from one place to another, held within the area. */
function moved(plot, brush, from, to) {
  const [left, top, right, bottom] = rectangleOf(plot, brush);
  const by = (which, low, high, i) => {
    const [first, last] = plot[which].ends;
    return Math.min(last - high, Math.max(first - low, to[i] - from[i]));
  };
  const [dx, dy] = [by("x", left, right, 0), by("y", top, bottom, 1)];
  return brushBetween(plot, [left + dx, top + dy], [right + dx, bottom + dy]);
}

export const clearBrush = () => set({ brush: null });

/** Images from one to another, as the server takes them: those whose bars a rectangle touches. */
function imageRange([low, high]) {
  const [first, last] = [Math.max(1, Math.ceil(low - 0.4)), Math.floor(high + 0.4)];
  return first === last ? `image ${first}` : `images ${first} … ${last}`;
}

/** A brush in words. */
export function brushWords(brush, block) {
  const round = (value) => String(Number(value.toPrecision(4))).replace("-", "−");
  const range = ([low, high], unit = "") => `${round(low)} … ${round(high)}${unit && ` ${unit}`}`;
  const quantity = block.quantities.find((one) => one.id === brush.against);
  const camera = block.cameras.length > 1 ? ` of ${block.cameras[brush.camera]?.id}` : "";
  switch (brush.view) {
    case "sensor": return `sensor${camera}: x ${range(brush.x)}, y ${range(brush.y, "px")}`;
    case "image": return `${block.images[brush.image]?.name}: x ${range(brush.x)}, y ${range(brush.y, "px")}`;
    case "images": return brush.ids ? `${brush.ids.length} images` : imageRange(brush.range);
    case "profile": return `${quantity?.label ?? brush.against} ${range(brush.range, quantity?.unit)}`;
    case "plan": case "height": return `points: E ${range(brush.e)}, N ${range(brush.n, "m")}`;
    case "flights": return `cameras: E ${range(brush.e)}, N ${range(brush.n, "m")}`;
    case "space": return "points as seen in 3D";
    case "histogram": return `residual in ${brush.component} ${range(brush.range, "px")}`;
    default: return brush.view;
  }
}
