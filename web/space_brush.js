// Brushing in space: a rectangle over the picture chooses the measurements of the points that lie in it as one looks at
// them now.

import { fill, svg } from "./dom.js";
import { set, state } from "./state.js";
import { clearBrush } from "./brush.js";
import { rectangle } from "./space_data.js";

/** Less than this is a click, not a drag, in pixels of the screen. */
const CLICK = 4;

export class SpaceBrush {
  /** `matrix()` tells how one looks at the block; `wanted()` whether a drag brushes rather than turns. */
  constructor(room, canvas, matrix, wanted) {
    this.canvas = canvas;
    this.matrix = matrix;
    this.overlay = svg("svg", { class: "overlay", "aria-hidden": "true" });
    room.append(this.overlay);
    // Before the canvas turns the view.
    room.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || event.target !== canvas || !(wanted() || event.ctrlKey)) return;
      event.stopPropagation();
      event.preventDefault();
      this.begin(event);
    }, { capture: true });
  }

  begin(event) {
    const { canvas } = this;
    const box = canvas.getBoundingClientRect();
    const place = ({ clientX, clientY }) => [clientX - box.left, clientY - box.top];
    const start = place(event);
    const others = event.shiftKey ? state.brush ?? [] : [];
    const matrix = this.matrix();
    let dragged = false;
    canvas.setPointerCapture(event.pointerId);
    const move = (now) => {
      const end = place(now);
      dragged ||= Math.hypot(end[0] - start[0], end[1] - start[1]) > CLICK;
      if (!dragged) return;
      this.draw(start, end);
      set({ brush: [...others, { view: "space", matrix, ...rectangle(start, end, [box.width, box.height]) }] });
    };
    const end = () => {
      canvas.removeEventListener("pointermove", move);
      // The rectangle says nothing any more as soon as one looks from elsewhere; what it chose stands out.
      fill(this.overlay);
      if (!dragged) clearBrush();
    };
    canvas.addEventListener("pointermove", move);
    canvas.addEventListener("pointerup", end, { once: true });
    canvas.addEventListener("pointercancel", end, { once: true });
  }

  draw([x0, y0], [x1, y1]) {
    fill(this.overlay, svg("rect", { class: "brush", x: Math.min(x0, x1), y: Math.min(y0, y1), width: Math.abs(x1 - x0),
      height: Math.abs(y1 - y0) }));
  }
}
