// The figures in the middle: which are shown, how many side by side, and one that has all the room.

import { fill } from "./dom.js";
import { chosen, on, set, state } from "./state.js";
import { Panel } from "./panel.js";
import { SpacePanel } from "./space_panel.js";
import { fitScales } from "./scales.js";
import { shownViews } from "./views.js";

const panels = new Map();

export function startPanels() {
  on(["views", "large", "beside"], arrange);
  on(["locked"], () => {
    if (!state.locked) fitScales();
  });
  on(["node", "tree", "against", "peek", "beside", "predicted", "brush", "image", "against_quantity", "views", "large", "locked"], refresh);
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
  if (chosen()?.state !== "done") {
    document.getElementById("panels").classList.toggle("waiting", Boolean(chosen()));
    return;
  }
  document.getElementById("panels").classList.remove("waiting");
  for (const view of shown()) panelOf(view).refresh();
}

/** One figure takes all the room, or gives it back. */
export const enlarge = (view) => set({ large: state.large === view ? null : view });

/** The panels that are on the page, for export. */
export const visiblePanels = () => shown().map(panelOf);
