// The right column: what may be missing, the model, and, of a simulated block, the causes.

import { button, fill, h } from "./dom.js";
import { on, set, state } from "./state.js";
import { drawCandidates, startCandidates } from "./candidates.js";
import { drawModel } from "./model.js";
import { drawCauses } from "./causes.js";

const TABS = [["missing", "Missing?", drawCandidates], ["model", "Model", drawModel], ["causes", "Causes", drawCauses]];
const body = h("div.body", { role: "tabpanel", id: "tab-body" });

export function startSide() {
  startCandidates(body);
  on(["tab", "node", "tree"], draw);
}

function draw() {
  const tabs = TABS.filter(([id]) => id !== "causes" || state.tree?.simulated);
  fill(document.getElementById("side"),
    h("div.tabs", { role: "tablist" }, tabs.map(([id, label], i) =>
      button(label, () => set({ tab: id }), { role: "tab", "aria-selected": String(id === state.tab),
      "aria-controls": "tab-body", title: label, key: "mc"[i - 1] ?? "w" }))),
    body);
  body.dataset.tab = state.tab;
  TABS.find(([id]) => id === state.tab)[2](body);
}
