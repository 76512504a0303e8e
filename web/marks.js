// The marks of a surveyed point side by side: a wrong one shows something else than the others.

import { dialog, fill, h } from "./dom.js";
import { fixed } from "./numbers.js";
import { pointWords } from "./names.js";
import { hasPhoto, hasPhotos, paintPatch } from "./photos.js";
import { state } from "./state.js";
import { showImage } from "./views.js";

/** Widths of a patch, px of the image. */
const SIDES = [24, 48, 96, 192, 384];
const SIZE = 180;
let side = 96;

/** Opens the marks of a point of `nodes/ID/points`. */
export function showMarks(point) {
  const grid = h("div.marks");
  const shown = h("output", {}, `${side} px`);
  const zoom = h("input", { type: "range", min: "0", max: String(SIDES.length - 1), step: "1",
    value: String(SIDES.indexOf(side)), "aria-label": "Width of the patches", oninput: () => {
    side = SIDES[Number(zoom.value)];
    shown.textContent = `${side} px`;
    draw();
  } });
  const box = dialog(`Marks of ${point.point}`, h("p", {}, pointWords(point), "."),
    hasPhotos()
      ? h("div.row", {}, h("span", {}, h("b", {}, "+"), " where it was marked, ", h("b", {}, "○"),
        " where the model expects it"), h("span.space"), h("label.row", {}, "Patches ", zoom, shown))
      : h("p.quiet", {}, "To see the patches of the images, open the laboratory with --images FOLDER."),
    grid);
  box.classList.add("wide");
  const marks = [...point.marks].sort((a, b) => size(b) - size(a));
  const draw = () => fill(grid, marks.map((mark) => patch(point, mark, box)));
  draw();
  return box;
}

const size = ({ rx, ry }) => (rx === null ? -1 : Math.hypot(rx, ry));

function patch(point, mark, box) {
  const { name } = state.block.images[mark.image];
  const canvas = h("canvas", { width: SIZE, height: SIZE });
  const says = h("p.quiet");
  const residual = mark.rx === null ? (mark.set_aside ? "set aside" : "no residual")
    : `${fixed(mark.rx, 2)}, ${fixed(mark.ry, 2)} px`;
  if (hasPhoto(mark.image)) {
    paintPatch(canvas, mark.image, [mark.x, mark.y], side)
      .then(() => cross(canvas, mark), (error) => { says.textContent = error.message; });
  } else if (hasPhotos()) {
    says.textContent = "no file of this image";
  }
  return h("figure.patch", { data: { image: mark.image, point: point.point } }, hasPhotos() && canvas,
    h("figcaption", {}, h("button.plain", { type: "button", title: "Show all residuals of this image",
    onclick: () => { box.close(); showImage(mark.image); } }, name), h("b", {}, residual)), says);
}

/** The mark in the middle, and where the model expects it; what lies beyond the patch is pointed at. */
function cross(canvas, mark) {
  const context = canvas.getContext("2d");
  const middle = SIZE / 2;
  const stroke = (draw) => {
    for (const [colour, width] of [["#ffffff", 4], ["#111111", 1.6]]) {
      [context.strokeStyle, context.lineWidth] = [colour, width];
      context.beginPath();
      draw();
      context.stroke();
    }
  };
  stroke(() => {
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(middle + 5 * dx, middle + 5 * dy);
      context.lineTo(middle + 16 * dx, middle + 16 * dy);
    }
  });
  if (mark.rx === null) return;
  const by = [-mark.rx, -mark.ry].map((value) => (value * SIZE) / side);
  const within = Math.min(1, (middle - 10) / Math.max(Math.abs(by[0]), Math.abs(by[1]), 1e-9));
  const [x, y] = by.map((value) => middle + within * value);
  stroke(() => {
    context.moveTo(x + 7, y);
    context.arc(x, y, 7, 0, 2 * Math.PI);
    if (within < 1) {
      context.moveTo(middle, middle);
      context.lineTo(x, y);
    }
  });
}
