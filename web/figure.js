// One figure: the server's SVG, put into the page. While a request is under way only the newest wish is kept, so that a
// brush
// that moves faster than figures come never makes a queue.

import { text } from "./api.js";
import { button, fill, h, svg } from "./dom.js";

const REMEMBERED = 80;
const drawn = new Map();

/** Text of the SVG at `path`. Steps never change: the last drawings are remembered, so that holding a key to see the
 * step before is at once. */
export async function drawingText(path, signal) {
  const known = drawn.get(path);
  if (known) return known;
  const answer = await text(path, { signal });
  drawn.set(path, answer);
  if (drawn.size > REMEMBERED) drawn.delete(drawn.keys().next().value);
  return answer;
}

const reader = new DOMParser();

function parse(answer) {
  const root = reader.parseFromString(answer, "image/svg+xml").documentElement;
  if (root.nodeName !== "svg") throw new Error("The server's answer is no drawing.");
  return document.adoptNode(root);
}

export class Figure {
  /** `shown(drawing)` is called after every change of the drawing. */
  constructor(view, shown = () => {}) {
    this.view = view;
    this.shown = shown;
    this.path = null; // what is drawn
    this.wanted = null; // what is to be drawn
    this.busy = false;
    this.drawing = null;
    this.paper = h("div.paper");
    this.overlay = svg("svg", { class: "overlay", "aria-hidden": "true" });
    this.element = h("div.figure", { data: { view } }, this.paper, this.overlay);
  }

  /** Draws `path`; `fade`: the old drawing fades out over the new one. */
  show(path, { fade = false } = {}) {
    this.fade = fade || (this.fade && this.busy);
    this.wanted = path;
    // A prediction may take seconds: it is given up when it is not wanted any more. What is quick is waited for.
    if (this.busy && path !== this.asking && this.asking.includes("/predicted/")) this.stop.abort();
    if (!this.busy && path !== this.path) this.load();
  }

  async load() {
    this.busy = true;
    const slow = setTimeout(() => this.element.classList.add("loading"), 150);
    try {
      while (this.wanted !== this.path) {
        const path = this.wanted;
        try {
          this.asking = path;
          this.stop = new AbortController();
          const drawing = parse(await drawingText(path, this.stop.signal));
          this.path = path;
          this.put(drawing);
        } catch (error) {
          if (error.name === "AbortError") continue;
          this.path = path;
          this.fail(error);
        }
      }
    } finally {
      clearTimeout(slow);
      this.element.classList.remove("loading");
      this.busy = false;
      this.fade = false;
    }
  }

  put(drawing) {
    const old = this.drawing;
    this.drawing = drawing;
    fill(this.paper, drawing);
    if (old && this.fade && !matchMedia("(prefers-reduced-motion: reduce)").matches) {
      old.classList.add("fading");
      old.addEventListener("animationend", () => old.remove());
      this.paper.append(old);
    }
    this.overlay.setAttribute("viewBox", drawing.getAttribute("viewBox") ?? "0 0 1 1");
    this.element.classList.remove("failed");
    this.shown(drawing);
  }

  /** What is drawn is what `path` would be: now that its scale is held, asking with that scale gives the same. */
  alias(path) {
    if (drawn.has(this.path)) drawn.set(path, drawn.get(this.path));
    this.path = this.wanted = path;
  }

  fail(error) {
    this.drawing = null;
    this.element.classList.add("failed");
    const again = () => {
      const path = this.wanted;
      this.path = null;
      this.show(path);
    };
    // A refusal stays one, however often it is asked for.
    const refused = [400, 404].includes(error.status);
    fill(this.paper, h("p.nothing", {}, error.message, " ", !refused && button("Try again", again)));
    fill(this.overlay);
  }

  /** Place of a pointer event in the drawing's own pixels. */
  place(event) {
    const box = this.drawing.getBoundingClientRect();
    const [, , width, height] = this.drawing.getAttribute("viewBox").split(" ").map(Number);
    return [((event.clientX - box.left) / box.width) * width, ((event.clientY - box.top) / box.height) * height];
  }
}
