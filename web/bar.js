// The bar on top: what is open, what is shown, and how it is compared.

import { button, choice, fill, h } from "./dom.js";
import { before, chosen, on, set, state } from "./state.js";
import { change } from "./steps.js";
import { exportMenu } from "./export.js";
import { inOrder, isThere, shownViews, VIEWS } from "./views.js";
import { help } from "./help.js";

export function startBar() {
  on(["tree", "node", "against", "locked", "views", "peek", "beside", "theme", "steps", "side"], draw);
  draw();
}

function toggle(label, on, onclick, options) {
  return button(label, onclick, { ...options, kind: on ? "on" : undefined, "aria-pressed": String(on) });
}

function draw() {
  const bar = document.getElementById("bar");
  const earlier = before();
  const done = chosen()?.state === "done";
  const peek = toggle("Before", state.peek, () => {}, { title: earlier
    ? `Hold to see “${earlier.words}” at the same scale` : "The first step has nothing before it", key: "hold B",
    disabled: !earlier, id: "peek" });
  peek.addEventListener("pointerdown", () => set({ peek: true }));
  for (const over of ["pointerup", "pointerleave", "pointercancel"]) peek.addEventListener(over,
    () => set({ peek: false }));
  fill(bar,
    toggle("◧", state.steps, () => set({ steps: !state.steps }), { title: "Show or hide the steps", key: "[" }),
    h("h1", {}, h("span.program", {}, "misclosure"), state.block?.name ?? ""),
    h("div.group", { role: "group", "aria-label": "Figures shown" },
      VIEWS.map((view) => toggle(view.short, shownViews().includes(view.id), () => show(view.id),
        isThere(view.id) ? { title: view.title, key: view.key.toUpperCase() }
        : { title: `${view.title}: this block has none`, disabled: true }))),
    h("div.group", { role: "group", "aria-label": "Comparison" },
      peek,
      toggle("Beside", state.beside, () => set({ beside: !state.beside }),
        { title: "The step before and this one, side by side", key: "S", disabled: !earlier }),
      toggle("Lock scales", state.locked, () => set({ locked: !state.locked }),
        { title: "On: every step is drawn at the scale that fits the largest errors of all steps, so that pictures "
        + "can be compared. Off: each picture at its own", key: "L" })),
    h("div.group.end", {},
      button("Do all", () => change({ kind: "improve" }),
        { title: "Add what is missing, step by step, until nothing is left (misclosure improve)",
        kind: chosen()?.verdict === "missing" ? "main" : undefined, disabled: !done }),
      exportMenu(),
      choice("Colours", [["auto", "Auto"], ["light", "Light"], ["dark", "Dark"]], state.theme,
        (theme) => set({ theme })),
      toggle("◨", state.side, () => set({ side: !state.side }),
        { title: "Show or hide what may be missing and the model", key: "]" }),
      button("?", help, { title: "Help and keys", key: "?" })));
}

/** Shows a figure, or takes it away; one stays. */
export function show(view) {
  if (!isThere(view)) return;
  const now = shownViews();
  const views = now.includes(view) ? now.filter((id) => id !== view) : inOrder([...now, view]);
  if (state.large) set({ large: view, views: inOrder([...new Set([...now, view])]) });
  else if (views.length) set({ views });
}
