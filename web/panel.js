// A panel: one figure of the chosen step (two, where steps are compared side by side), with what the figure can be
// asked.

import { button, choice, fill, h } from "./dom.js";
import { before, chosen, set, state } from "./state.js";
import { brushable, clearBrush, mark } from "./brush.js";
import { figureQuery, holdScale } from "./scales.js";
import { Figure } from "./figure.js";
import { plotsOf } from "./plots.js";
import { savePicture } from "./save.js";
import { drawWorst } from "./worst.js";
import { named, nearest } from "./names.js";
import { showMarks } from "./marks.js";
import { hasPhoto } from "./photos.js";
import { layPhoto } from "./underlay.js";
import { showPhoto } from "./viewer.js";
import { enlarge, showImage, VIEWS } from "./views.js";

const COMPONENTS = [["x,y", "x and y"], ["radial,tangential", "radial and tangential"],
  ["along,across", "along and across the motion"]];
const GNSS = [["plan", "in plan"], ["height", "in height"], ["time", "against time"], ["heading", "against heading"]];

export class Panel {
  constructor(view) {
    this.view = view;
    this.about = VIEWS.find((one) => one.id === view);
    this.own = { camera: view === "sensor" ? 0 : null, component: view === "profile" ? "x,y" : null,
      show: view === "gnss" ? "plan" : null };
    this.node = null; // step that the figure was last drawn for
    this.figure = this.make();
    this.earlier = this.make(); // the step before, side by side
    this.caption = [h("span.caption"), h("span.caption")];
    this.controls = h("div.controls");
    this.worst = ["plan", "height"].includes(view) && h("div.worst",
      { "aria-label": "Points with the largest errors" });
    this.pair = h("div.pair", {}, h("div.side", {}, this.caption[0], this.earlier.element),
      h("div.side", {}, this.caption[1], this.figure.element));
    this.element = h("section.panel", { data: { view }, "aria-label": this.about.title },
      h("header", { ondblclick: (event) => event.target.closest("button, select") || enlarge(view) },
      h("h3", {}, this.about.short), this.controls), this.pair, this.worst);
    this.drawControls();
  }

  make() {
    const figure = new Figure(this.view, (drawing) => {
      mark(figure);
      if (this.view === "image") layPhoto(drawing, figure.asked.options.image);
      if (figure.path !== figure.wanted) return;
      const { node, options } = figure.asked;
      const longer = holdScale(this.view, options, drawing);
      figure.alias(figureQuery(node, this.view, options));
      if (longer) this.refresh();
    });
    brushable(figure, (event) => this.clicked(event, figure));
    named(figure);
    return figure;
  }

  /** A click on what has a name: on an image shows it, on a surveyed point its marks; in an image it comes closer. */
  clicked(event, figure) {
    if (this.view === "image" && hasPhoto(state.image)) {
      const plot = plotsOf(figure.drawing)[0];
      const [x, y] = figure.place(event);
      showPhoto(figure.asked.node, state.image, [plot.x.value(x), plot.y.value(y)]);
      return true;
    }
    nearest(figure, event).then((found) => {
      if (found?.point) showMarks(found.point);
      else if (found?.image !== undefined) showImage(found.image);
      else if (!found) clearBrush();
    });
    return true;
  }

  drawControls() {
    const block = state.block;
    const redraw = () => this.refresh();
    const parts = [];
    if (this.view === "sensor" && block.cameras.length > 1) {
      parts.push(choice("Camera", block.cameras.map((camera, i) => [i, camera.id]), this.own.camera,
        (value) => { this.own.camera = Number(value); redraw(); }));
    }
    if (this.view === "profile") {
      const quantities = block.quantities.map((one) => [one.id, `against ${one.label}`]);
      parts.push(choice("Against", quantities, quantity(), (value) => set({ against_quantity: value })));
      parts.push(choice("Component", COMPONENTS, this.own.component,
        (value) => { this.own.component = value; redraw(); }));
    }
    if (this.view === "gnss") {
      const recorded = GNSS.filter(([id]) => !["time", "heading"].includes(id)
        || block.quantities.some((one) => one.id === id));
      parts.push(choice("Shown", recorded, this.own.show, (value) => { this.own.show = value; redraw(); }));
    }
    if (this.view === "image") {
      const go = (by) => set({ image: (state.image + by + block.images.length) % block.images.length });
      this.imageChoice = choice("Image", block.images.map((image, i) => [i, image.name]), state.image,
        (value) => set({ image: Number(value) }));
      parts.push(button("‹", () => go(-1), { title: "Image before", key: "," }), this.imageChoice,
        button("›", () => go(1), { title: "Next image", key: "." }),
        block.images.some((image) => image.photo) && button("Zoom",
          () => hasPhoto(state.image) && showPhoto(state.node, state.image),
          { title: "The image close up, with its residuals; a click into the figure opens it there" }));
    }
    fill(this.controls, parts, h("span.space"),
      button("SVG", () => savePicture(this, "svg"), { title: "Save this figure as SVG", kind: "plain" }),
      button("PNG", () => savePicture(this, "png"), { title: "Save this figure as PNG", kind: "plain" }),
      button("⤢", () => enlarge(this.view), { title: "All the room for this figure, or back", key: "double click",
        kind: "plain" }));
  }

  options() {
    return {
      ...this.own,
      against: this.view === "profile" ? quantity() : null,
      image: this.view === "image" ? state.image : null,
      brush: state.brush && state.brush.length === 1 ? state.brush[0] : state.brush,
      width: this.width(),
    };
  }

  /** Width of the drawing, in steps, so that a drawing is not asked for anew with every pixel of the window. */
  width() {
    const room = this.element.clientWidth - 24;
    const each = state.beside && before() ? room / 2 - 6 : room;
    return Math.max(320, Math.round(each / 20) * 20);
  }

  refresh() {
    if (!this.element.isConnected) return;
    const node = chosen();
    const earlier = before();
    const peek = state.peek && earlier?.state === "done";
    const beside = state.beside && earlier?.state === "done" && !peek;
    const options = this.options();
    if (this.imageChoice) this.imageChoice.value = String(state.image);
    const predicted = peek ? null : state.predicted;
    this.ask(this.figure, peek ? earlier.id : node.id, { ...options, predicted, earlier: peek },
      { fade: this.node !== null && this.node !== node.id });
    this.node = node.id;
    if (this.worst) drawWorst(this.worst, this.view, node.id);
    this.pair.classList.toggle("two", beside);
    this.element.classList.toggle("predicted", Boolean(predicted));
    this.element.classList.toggle("peek", peek);
    if (beside) this.ask(this.earlier, earlier.id, { ...options, earlier: true });
    this.caption[0].textContent = beside ? `Before: ${earlier.words}` : "";
    this.caption[1].textContent = beside ? (predicted ? `Predicted with ${predicted}` : node.words) : "";
    this.element.querySelector("header").dataset.note = peek ? `before: ${earlier.words}` : predicted
      ? `predicted with ${predicted}` : "";
  }

  /** Draws the figure of a step, remembering what was asked so that its scale can be held. */
  ask(figure, node, options, how) {
    figure.asked = { node, options };
    figure.show(figureQuery(node, this.view, options), how);
  }

  /** Path of what is drawn. */
  path() {
    return this.figure.path;
  }
}

const quantity = () => (state.block.quantities.some((one) => one.id === state.against_quantity) ? state.against_quantity
  : state.block.quantities[0]?.id);
