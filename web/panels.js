// The figures in the middle: which are shown, how many side by side, and one that has all the room.

import { fill, h } from "./dom.js";
import { chosen, on, state } from "./state.js";
import { Panel } from "./panel.js";
import { SpacePanel } from "./space_panel.js";
import { fitScales } from "./scales.js";
import { shownViews } from "./views.js";

const panels = new Map();

/** What one waits for in an empty middle. */
const WAITS = [
  "The figures of this step appear here when it is done; the line above says what is being computed.",
  "Outliers are searched, both solvers adjust the block, and every effect of the catalogue is tested on what is "
    + "left: some seconds with a hundred images, minutes with a thousand. The steps that are done can be looked at "
    + "meanwhile.",
];

export function startPanels() {
  on(["views", "large", "beside"], arrange);
  on(["locked"], () => {
    if (!state.locked) fitScales();
  });
  on(["node", "tree", "against", "peek", "beside", "predicted", "brush", "image", "against_quantity", "views", "large",
    "locked", "longest"], refresh);
  new ResizeObserver(refresh).observe(document.getElementById("panels"));
  arrange();
}

function panelOf(view) {
  if (!panels.has(view)) panels.set(view, view === "space" ? new SpacePanel() : new Panel(view));
  return panels.get(view);
}

const shown = () => (state.large ? [state.large] : shownViews());

function arrange() {
  const box = document.getElementById("panels");
  box.classList.toggle("large", Boolean(state.large));
  box.classList.toggle("beside", state.beside);
  box.dataset.count = shown().length;
  fill(box, shown().map((view) => panelOf(view).element));
}

function refresh() {
  const now = chosen()?.state;
  document.getElementById("panels").classList.toggle("waiting", Boolean(now) && now !== "done");
  const waits = document.getElementById("waiting");
  waits.hidden = !["waiting", "running"].includes(now);
  if (!waits.hidden) fill(waits, h("p", {}, WAITS[0]), h("p.quiet", {}, WAITS[1]));
  if (now !== "done") return;
  for (const view of shown()) panelOf(view).refresh();
}

/** The panels that are on the page, for export. */
export const visiblePanels = () => shown().map(panelOf);
