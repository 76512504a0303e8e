// The tree of steps, with the figures of each. A first child goes on in its parent's lane; what branches off stands
// below it in a lane of its own.

import { button, fill, h, svg } from "./dom.js";
import { rows } from "./lanes.js";
import { fixed, mm, px } from "./numbers.js";
import { chosen, on, set, state } from "./state.js";
import { Figure } from "./figure.js";
import { figureQuery } from "./scales.js";
import { canDismiss, dismiss } from "./steps.js";

const ROW = 46;
const LANE = 12;

const COLUMNS = [
  ["check", "mm", (f) => mm(f.check_rms_m), "3D RMS of the check points, which no adjustment uses"],
  ["held", "px", (f) => px(f.heldout_px), "RMS of measurements that the estimate did not see (held out)"],
  ["tie", "px", (f) => px(f.tie_rms_px), "RMS of the tie points' residuals, per coordinate"],
  ["σ₀", "", (f) => fixed(f.sigma0, 3), "Standard deviation of unit weight: one where the stated precisions fit"],
];

/** Check points come first, what nothing was fitted to; a block without any has no column of them. A wrong control
 * point becomes one. */
const columns = () => (state.block.surveyed.some((point) => point.role === "check")
  || state.tree.nodes.some((node) => Number.isFinite(node.figures?.check_rms_m)) ? COLUMNS : COLUMNS.slice(1));

const ledger = new Figure("ledger");

export function startTree() {
  on(["tree", "node", "against"], draw);
  on(["tree", "node"], drawLedger);
  fill(document.getElementById("steps"), h("p.quiet", {}, "Reading the steps …"));
}

function draw() {
  const lines = rows(state.tree.nodes);
  const lanes = Math.max(...lines.map((line) => line.lane), 0) + 1;
  const tree = h("div.tree", { role: "tree", "aria-label": "Steps", tabindex: "0" },
    graph(lines, lanes),
    lines.map((line) => item(line, lanes)));
  const focused = document.activeElement?.classList.contains("tree");
  fill(document.getElementById("steps"),
    h("h2", {}, "Steps"),
    h("div.columns", {}, columns().map(([name, unit, , title]) => h("span", { title }, name, h("br"), unit))),
    tree,
    h("div.ledger", {}, ledger.element),
    h("p.folder", { title: "Every step is a run folder; misclosure report opens it as well" }, state.tree.folder));
  if (focused) tree.focus({ preventScroll: true });
  tree.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest" });
}

function item({ node, lane }, lanes) {
  const figures = node.figures;
  const states = { running: "computing …", waiting: "waits for its turn", failed: "failed", cancelled: "cancelled" };
  const classes = ["item", node.state, node.id === state.node && "chosen", node.id === state.against && "against"]
    .filter(Boolean);
  const row = h(`div.${classes.join(".")}`, {
    role: "treeitem", "aria-selected": String(node.id === state.node), "aria-level": String(lane + 1),
      data: { node: node.id },
    title: [node.words, node.delta_words, node.error].filter(Boolean).join("\n"),
    onclick: (event) => (event.shiftKey || event.ctrlKey ? set({ against: node.id }) : set({ node: node.id })),
  },
    h("div.words", {}, node.words || "as given", node.agree === false
      && h("span.flag", { title: "The two solvers disagree on this step" }, "solvers differ"),
      node.id === state.against && h("span.flag", {}, "compared")),
    figures && !["failed", "cancelled"].includes(node.state)
      ? h("div.figures", {}, columns().map(([, , write], i) => h(i === 0 ? "b" : "span", {}, write(figures))))
      : h("div.figures.state", {}, states[node.state] ?? node.state, canDismiss(node) && dismissing(node)));
  row.style.paddingLeft = `${lanes * LANE + 10}px`;
  return row;
}

const dismissing = (node) => button("×", (event) => { event.stopPropagation(); dismiss(node.id); },
  { title: "Dismiss this step", key: "Del", kind: "plain", "aria-label": `Dismiss ${node.words}` });

/** The lines between the steps and a mark for each: full where nothing is missing any more, crossed where it failed. */
function graph(lines, lanes) {
  const at = (i) => [lines[i].lane * LANE + 11, i * ROW + 15];
  const drawing = svg("svg", { class: "graph", width: lanes * LANE + 10, height: lines.length * ROW,
    "aria-hidden": "true" });
  lines.forEach(({ above }, i) => {
    if (above === null) return;
    const [[x0, y0], [x, y]] = [at(above), at(i)];
    // A branch leaves its parent at once and runs down in its own lane, beside the rows between.
    drawing.append(svg("path", { d: x === x0 ? `M${x0} ${y0}V${y}`
      : `M${x0} ${y0}H${x - 8}Q${x} ${y0} ${x} ${y0 + 8}V${y}`, class: "branch" }));
  });
  lines.forEach(({ node }, i) => {
    const [x, y] = at(i);
    const kind = `knot ${node.state} ${node.verdict ?? ""} ${node.id === state.node ? "chosen" : ""}`;
    if (node.state === "failed" || node.state === "cancelled") drawing.append(
      svg("path", { d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`, class: kind }));
    else drawing.append(svg("circle", { cx: x, cy: y, r: 5, class: kind }));
  });
  return drawing;
}

function drawLedger() {
  if (chosen()?.state !== "done") return;
  ledger.show(figureQuery(state.node, "ledger", { width: 300 }));
}

/** The step `by` rows further down. */
export function stepThroughTree(by) {
  const all = rows(state.tree?.nodes ?? []);
  const at = all.findIndex((line) => line.node.id === state.node);
  const next = all[Math.min(all.length - 1, Math.max(0, at + by))];
  if (next) set({ node: next.node.id });
}
