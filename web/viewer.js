// One image close up: the wheel comes closer, a drag shifts, and the residuals stand at their places.

import { dialog, h } from "./dom.js";
import { fixed } from "./numbers.js";
import { whole } from "./photos.js";
import { measurementsIn } from "./points.js";
import { state } from "./state.js";

/** Residuals are drawn so many times their size, in pixels of the image. */
const ENLARGED = 40;

/** Opens an image at a place (px of the block); without one, all of it. */
export function showPhoto(node, image, place = null) {
  const canvas = h("canvas.photo", { width: 1, height: 1, tabindex: "0",
    "aria-label": "The image: the wheel comes closer, a drag shifts" });
  const says = h("p.quiet", {}, "Reading the image …");
  const box = dialog(`Image ${state.block.images[image].name}`, canvas, says);
  box.classList.add("wide");
  open(canvas, says, node, image, place).catch((error) => { says.textContent = error.message; });
  return box;
}

async function open(canvas, says, node, image, place) {
  const [{ bitmap, scale }, rows] = await Promise.all([whole(image), measurementsIn(node, image)]);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const more = Math.min(2, devicePixelRatio);
  [canvas.width, canvas.height] = [width * more, height * more];
  const size = [bitmap.width / scale, bitmap.height / scale];
  const fit = Math.min(width / size[0], height / size[1]);
  const view = { at: place ?? size.map((side) => side / 2), zoom: place ? Math.max(1, fit) : fit };
  const draw = () => paint(canvas.getContext("2d"), { bitmap, scale, rows, view, width, height, more, says });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const [x, y] = [event.offsetX - width / 2, event.offsetY - height / 2];
    const zoom = Math.min(16, Math.max(fit / 2, view.zoom * 1.2 ** (-event.deltaY / 100)));
    // What is under the pointer stays there.
    view.at = [view.at[0] + x / view.zoom - x / zoom, view.at[1] + y / view.zoom - y / zoom];
    view.zoom = zoom;
    draw();
  }, { passive: false });
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    view.at = [view.at[0] - event.movementX / view.zoom, view.at[1] - event.movementY / view.zoom];
    draw();
  });
  draw();
}

function paint(context, { bitmap, scale, rows, view, width, height, more, says }) {
  const { at, zoom } = view;
  const place = (x, y) => [(x - at[0]) * zoom + width / 2, (y - at[1]) * zoom + height / 2];
  context.setTransform(more, 0, 0, more, 0, 0);
  context.clearRect(0, 0, width, height);
  context.imageSmoothingEnabled = zoom / scale < 2;
  context.drawImage(bitmap, ...place(0, 0), (bitmap.width / scale) * zoom, (bitmap.height / scale) * zoom);
  // Closer up the arrows grow less than the image, so that they do not hide it.
  const enlarged = ENLARGED / Math.sqrt(Math.max(1, zoom));
  for (const one of rows) {
    const [x, y] = place(one.x, one.y);
    if (x < 0 || y < 0 || x > width || y > height) continue;
    const [tx, ty] = [x + one.rx * enlarged, y + one.ry * enlarged];
    for (const [colour, thick] of [["#ffffff", 3.4], [one.kind === "mark" ? "#009e73" : "#0072b2", 1.6]]) {
      [context.strokeStyle, context.lineWidth] = [colour, thick];
      context.beginPath();
      context.arc(x, y, one.kind === "mark" ? 6 : 2.5, 0, 2 * Math.PI);
      context.moveTo(x, y);
      context.lineTo(tx, ty);
      context.stroke();
    }
  }
  says.textContent = `${fixed(zoom, 2)} px of the screen per px of the image; residuals of tie points blue, of marks `
    + `green, ${Math.round(enlarged)} px of the screen per px. The wheel comes closer, a drag shifts.`;
}
