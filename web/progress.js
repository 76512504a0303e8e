// What is being computed: both solvers with iteration and cost, and a word when it is done, failed or was refused.

import { post, readTree } from "./api.js";
import { button, fill, h, svg } from "./dom.js";
import { verdictOf } from "./judge.js";
import { significant } from "./numbers.js";
import { nodeOf, on, set, state } from "./state.js";
import { expected, timeWords } from "./timing.js";

/** News goes by itself after this, ms; errors stay. */
const READ = 12_000;
let message = null;

/** A sentence above the figures, until it is closed or another takes its place. */
export function say(kind, text) {
  const own = text && { kind, text };
  message = own;
  draw();
  if (kind !== "error") setTimeout(() => message === own && say(null, null), READ);
}

/** When a step began, by its id, in the time of this page. */
const began = new Map();

export function startProgress() {
  setInterval(tick, 1000);
  on(["running", "tree"], draw);
}

/** Handlers of the server's events. */
export const progressEvents = {
  progress(event) {
    const run = state.running[event.node] ?? { solvers: {} };
    const solvers = { ...run.solvers };
    if (event.solver) {
      const past = solvers[event.solver]?.costs ?? [];
      // A solver that starts anew has a new curve.
      const costs = event.iteration <= (solvers[event.solver]?.iteration ?? -1) ? [] : past;
      solvers[event.solver] = { iteration: event.iteration, cost: event.cost, costs: [...costs, event.cost] };
    }
    set({ running: { ...state.running, [event.node]: { text: event.text || event.phase || run.text, solvers } } });
  },
  failed(event) {
    finish(event.node);
    say("error", `${nodeOf(event.node)?.words ?? "The step"}: ${event.error}`);
  },
  nothing(event) {
    finish(event.node);
    say("note", event.text);
  },
  async done(event) {
    finish(event.node);
    await readTree();
  },
};

async function cancel(id) {
  try {
    await post(`steps/${id}/cancel`);
  } catch (error) {
    say("error", error.message);
  }
}

function finish(id) {
  began.delete(id);
  const { [id]: over, ...others } = state.running;
  set({ running: others });
}

function draw() {
  const busy = (state.tree?.nodes ?? []).filter((node) => node.state === "running" || node.state === "waiting");
  fill(document.getElementById("progress"),
    busy.map((node) => run(node, state.running[node.id])),
    message && h(`div.say.${message.kind}`, { role: message.kind === "error" ? "alert" : "status" },
      h("span", {}, message.text),
      button("×", () => say(null, null), { title: "Close", kind: "plain" })));
}

function run(node, progress) {
  const waits = node.state === "waiting";
  return h("div.run", { data: { node: node.id } },
    h("div.what", {}, !waits && h("span.pulse", {}), h("b", {}, node.words), " ",
      node.delta_words && h(`b.result.${verdictOf(nodeOf(node.parent)?.figures, node.figures)}`, {},
      `${node.delta_words} `), h("span.quiet", {}, waits ? "waits for its turn" : progress?.text ?? "starts")),
    ["native", "ceres"].map((name) => solver(name, progress?.solvers[name])),
    !waits && h("span.time", { data: { node: node.id },
      title: "Time so far, and what steps like it took in this laboratory" }, timeOf(node)),
    button("Cancel", () => cancel(node.id), { title: "Stop this step at the next iteration" }));
}

const timeOf = (node) => timeWords(elapsed(node), expected(node, state.tree.nodes));

/** Seconds since a step began: what the server said, and since then. */
function elapsed(node) {
  if (began.get(node.id) === undefined) began.set(node.id, performance.now() - 1000 * (node.seconds ?? 0));
  return (performance.now() - began.get(node.id)) / 1000;
}

/** Every second, without drawing anything else anew. */
function tick() {
  for (const box of document.querySelectorAll("#progress .time")) {
    const node = nodeOf(Number(box.dataset.node));
    if (node) box.textContent = timeOf(node);
  }
}

function solver(name, at) {
  return h("div.solver", {}, h("span.name", {}, name),
    at ? [curve(at.costs), h("span.number", {}, `iteration ${at.iteration}`),
      h("span.number", {}, `cost ${significant(at.cost, 6)}`)] : h("span.quiet", {}, "not yet"));
}

/** The falling cost, logarithmic, in the size of a word. */
function curve(costs) {
  const logs = costs.filter((cost) => cost > 0).map(Math.log10);
  const [low, high] = [Math.min(...logs), Math.max(...logs)];
  const at = (value, i) => `${(4 + (i * 62) / Math.max(1, logs.length - 1)).toFixed(1)} `
    + `${(18 - (14 * (value - low)) / (high - low || 1)).toFixed(1)}`;
  return svg("svg", { class: "curve", width: 70, height: 22, "aria-hidden": "true" },
    svg("path", { d: logs.length > 1 ? `M${logs.map(at).join("L")}` : "" }),
    svg("circle", { cx: logs.length > 1 ? 66 : 4, cy: logs.length ? at(logs.at(-1), 0).split(" ")[1] : 18, r: 2.4 }));
}
