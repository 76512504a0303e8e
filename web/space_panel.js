// The panel of the 3D view: asks for the block in space, says what its colours and vectors mean, and names what the
// pointer is at.

import { binary, query } from "./api.js";
import { button, choice, fill, h } from "./dom.js";
import { count, mm, significant } from "./numbers.js";
import { before, chosen, on, state } from "./state.js";
import { savePicture } from "./save.js";
import { enlarge, showImage } from "./views.js";
import { SpaceBrush } from "./space_brush.js";

const NEAR = 10;
const night = matchMedia("(prefers-color-scheme: dark)");
const dark = () => (state.theme === "auto" ? night.matches : state.theme === "dark");

export class SpacePanel {
  constructor() {
    this.view = "space";
    this.canvas = h("canvas", { tabindex: "0", "aria-label": "The block in space: drag turns, Shift and drag shifts, "
      + "Ctrl and drag brushes, the wheel comes closer" });
    this.legend = h("div.legend");
    this.tip = h("div.tip", { hidden: true });
    this.room = h("div.room", {}, this.canvas, this.legend, this.tip);
    this.factors = h("span");
    this.brushing = false;
    this.brushes = button("Brush", () => this.toggleBrushing(),
      { title: "A drag brushes points instead of turning the view", key: "Ctrl+drag", "aria-pressed": "false" });
    this.element = h("section.panel.space", { data: { view: "space" }, "aria-label": "The block in space" },
      h("header", { ondblclick: (event) => event.target.closest("button, select") || enlarge("space") },
        h("h3", {}, "3D"),
        h("div.controls", {}, this.brushes, this.factors,
          button("Fit", () => this.space?.orbit.look(...this.space.orbit.home),
          { title: "All of the block", key: "double click" }), h("span.space"),
          button("PNG", () => savePicture(this, "png"), { title: "Save this view as PNG", kind: "plain" }),
          button("⤢", () => enlarge("space"), { title: "All the room for this view, or back", kind: "plain" }))),
      this.room);
    new SpaceBrush(this.room, this.canvas, () => this.space.matrix(), () => this.brushing);
    this.factor = null;
    this.canvas.addEventListener("pointermove", (event) => this.point(event));
    this.canvas.addEventListener("pointerdown", (event) => { this.pressed = [event.clientX, event.clientY]; });
    this.canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    this.canvas.addEventListener("click", (event) => this.under && !this.dragged(event) && showImage(this.under.image));
    new ResizeObserver(() => this.space?.resize(this.room.clientWidth, this.room.clientHeight)).observe(this.room);
    night.addEventListener("change", () => this.draw());
    on(["theme", "brushedImages"], () => this.draw());
  }

  toggleBrushing() {
    this.brushing = !this.brushing;
    this.brushes.setAttribute("aria-pressed", String(this.brushing));
    this.brushes.classList.toggle("on", this.brushing);
    this.canvas.classList.toggle("brushing", this.brushing);
  }

  /** three.js is read when the view is first asked for. */
  async refresh() {
    const node = state.peek && before() ? before() : chosen();
    const path = query(`nodes/${node.id}/space`, { brush: state.brush?.length === 1 ? state.brush[0] : state.brush });
    this.wanted = path;
    if (this.busy) return;
    this.busy = true;
    try {
      const [{ Space }, { readSpace }] = await Promise.all([import("./space.js"), import("./space_data.js")]);
      this.space ??= this.begin(Space);
      while (this.path !== this.wanted) {
        const next = this.wanted;
        this.data = readSpace(await binary(next));
        this.path = next;
        this.draw();
      }
    } catch (error) {
      const text = this.space ? error.message : `The 3D view cannot be drawn by this browser (WebGL): ${error.message}`;
      fill(this.legend, h("p.error", {}, text));
    } finally {
      this.busy = false;
    }
  }

  begin(Space) {
    const space = new Space(this.canvas);
    space.resize(this.room.clientWidth, this.room.clientHeight);
    return space;
  }

  draw() {
    if (!this.data) return;
    const fixed = state.locked ? this.held : null;
    const brushed = state.brush && state.brushedImages ? new Set(state.brushedImages.map((one) => one.image)) : null;
    const shown = this.space.show(this.data, { dark: dark(), brushed, factor: this.factor ?? fixed?.factor,
      end: fixed?.end });
    this.held = { factor: fixed?.factor ?? shown.factor, end: shown.end };
    const steps = [1, 10, 100, 1000, 10000, 100000].flatMap((k) => [k, 2 * k, 5 * k]);
    fill(this.factors, choice("Error vectors enlarged",
      [["", `errors × ${count(shown.factor)}`], ...steps.map((k) => [k, `errors × ${count(k)}`])], this.factor ?? "",
      (value) => { this.factor = value ? Number(value) : null; this.draw(); }));
    this.legend.dataset.dark = String(dark());
    const { ties, all } = this.data;
    const held = brushed && ties.of("brushed");
    const thinned = ties.rows < all.rows && ` (${count(ties.rows)} of ${count(all.rows)} are drawn)`;
    const surveyed = this.data.checks.rows + this.data.control.rows > 0;
    this.factors.hidden = !surveyed;
    fill(this.legend,
      surveyed && h("div", {}, h("i.check"), "check points, ", h("i.control"),
        `control points, errors enlarged ${count(shown.factor)} times`),
      h("div", {}, h(held ? "i.brushed" : "i.ramp"), held
        ? `${count(all.brushed)} of ${count(all.rows)} tie points brushed`
        : `tie points, residual RMS 0 to ${significant(shown.end, 2)} px and more`, thinned),
      h("div.quiet", {}, `grid ${significant(shown.spacing, 1)} m; cameras `
        + `${brushed ? "of brushed measurements stand out" : "by flight"}`));
  }

  /** Whether a click is the end of a drag. */
  dragged(event) {
    return Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > 4;
  }

  /** The nearest station or surveyed point under the pointer. */
  point(event) {
    if (!this.data || event.buttons) return;
    const { stations, checks, control } = this.data;
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    let best = { distance: NEAR };
    for (const [kind, array] of [["image", stations], ["check point", checks], ["control point", control]]) {
      for (let row = 0; row < array.rows; row++) {
        const [px, py, depth] = this.space.project(array.place(row));
        const distance = Math.hypot(px - x, py - y);
        if (depth < 1 && distance < best.distance) best = { distance, kind, array, row, at: [px, py] };
      }
    }
    this.under = best.kind === "image" ? { image: best.row } : null;
    this.tip.hidden = !best.kind;
    if (!best.kind) return;
    const error = best.kind === "image" ? null : best.array.triple("dx", "dy", "dz")(best.row);
    const words = error?.every(Number.isFinite) ? `: dE ${mm(error[0])}, dN ${mm(error[1])}, dH ${mm(error[2])} mm`
      : "";
    this.tip.textContent = `${best.kind} ${best.array.ids[best.row] ?? best.row}${words}`;
    this.tip.style.left = `${Math.min(best.at[0] + 12, box.width - 180)}px`;
    this.tip.style.top = `${best.at[1] + 12}px`;
  }

  /** The view as PNG, with the legend under it. */
  async picture() {
    const scale = this.canvas.width / this.canvas.clientWidth;
    const texts = [...this.legend.children].map((line) => line.textContent);
    const canvas = h("canvas", { width: this.canvas.width,
      height: this.canvas.height + (16 * texts.length + 12) * scale });
    const context = canvas.getContext("2d");
    context.fillStyle = dark() ? "#14181c" : "#ffffff";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.canvas, 0, 0);
    context.fillStyle = dark() ? "#d8dde2" : "#222222";
    context.font = `${12 * scale}px sans-serif`;
    texts.forEach((text, i) => context.fillText(text, 8 * scale, this.canvas.height + (16 * (i + 1)) * scale));
    return new Promise((done) => canvas.toBlob(done, "image/png"));
  }
}
