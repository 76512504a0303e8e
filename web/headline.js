// What the chosen step did, in figures: before and after, and the words for it.

import { button, fill, h } from "./dom.js";
import { judged, verdictOf } from "./judge.js";
import { count, fixed, mm, px, significant } from "./numbers.js";
import { before, chosen, nodeOf, on, set, state } from "./state.js";
import { canDismiss, dismiss } from "./steps.js";

const FIGURES = [
  ["check points", "mm", (f) => f.check_rms_m, mm, "3D RMS of the check points, which no adjustment uses"],
  ["in height", "mm", (f) => f.check_height_rms_m, mm, "RMS of the check points in height"],
  ["tie points", "px", (f) => f.tie_rms_px, px, "RMS per coordinate of the tie points' residuals"],
  ["GNSS", "m", (f) => f.gnss_rms_m, (v) => significant(v, 3), "3D RMS of the GNSS positions: computed minus measured"],
  ["held-out", "px", (f) => f.heldout_px, px, "RMS per coordinate in images that the estimate did not see"],
  ["sigma0", "", (f) => f.sigma0, (v) => fixed(v, 3),
    "A-posteriori standard deviation of unit weight: one where the stated precisions fit"],
  ["set aside", "", (f) => f.outliers, count, "Measurements set aside as outliers"],
];

const VERDICTS = {
  missing: ["something is missing", "A candidate on the right is significant"],
  unexplained: ["something is left without a name", "Structure is left that no effect of the catalogue explains"],
  mistake: ["something is recorded wrongly", "The card on the right says what it is and what to do"],
  adequate: ["nothing is left that this block shows", "No candidate is significant and no structure is left"],
};

export function startHeadline() {
  on(["node", "tree", "against", "predicted", "prediction", "peek"], draw);
}

function draw() {
  const box = document.getElementById("headline");
  const node = chosen();
  if (!node) return fill(box, h("p.quiet", {}, "No step yet."));
  if (!node.figures) {
    const parent = nodeOf(node.parent);
    return fill(box, h("h2", {}, node.words), h("p", { class: node.error ? "error" : "quiet" },
      node.error ?? "Not computed yet: it has no figures."),
      h("div.row", {}, parent && button(`Back to “${parent.words}”`, () => set({ node: parent.id })),
        canDismiss(node) && button("Dismiss", () => dismiss(node.id),
          { title: "Take this step out of the list", key: "Del" })));
  }
  const peeked = state.peek ? before() : null;
  const earlier = peeked ? null : before();
  const figures = (peeked ?? node).figures;
  box.classList.toggle("fresh", state.fresh === node.id);
  const [verdict, why] = VERDICTS[node.verdict] ?? ["", ""];
  const picked = earlier && earlier.id === state.against;
  fill(box,
    h("div.says", {},
      h("h2", {}, node.words || "as given", picked && h("small", {}, ` against “${earlier.words}”`)),
      verdict && h(`span.verdict.${node.verdict}`, { title: why }, verdict),
      node.agree && h("span.agree", { title: node.one_derivation ?? "Both solvers give the same result" },
        node.one_derivation ? "solvers agree; one derivation" : "solvers agree"),
      node.agree === false && h("span.disagree", { title: "The two solvers give different results: see the report" },
        "solvers disagree"),
      node.verdict && node.agree == null
        && h("span.alone", { title: "One solver found a solution: nothing was compared" }, "one solver")),
    node.mistake && h("p.wrong", { title: node.mistake }, node.mistake),
    predictionLine() ?? h(`p.delta.${verdictOf(earlier?.figures, node.figures)}`, { title: node.delta_words },
      (!picked && node.delta_words) || size(node.figures)),
    !peeked && node.moved && h("p.moved", { title: node.moved }, node.moved),
    h("dl.numbers", {}, FIGURES.filter(([, , of]) => known(of(figures)))
      .map(([name, unit, of, write, title]) => figure(name, unit, write, title,
      earlier?.figures ? of(earlier.figures) : null, of(figures)))));
}

const known = (value) => value !== null && value !== undefined;
const size = (figures) => `${count(figures.observations)} observations, ${count(figures.unknowns)} unknowns`;

function predictionLine() {
  if (state.peek) return h("p.delta.peek", {}, `Before: ${before()?.words}`);
  if (!state.predicted) return null;
  const words = state.prediction?.effect === state.predicted ? state.prediction.words : "…";
  return h("p.delta.predicted", { title: words }, h("b", {}, `With ${state.predicted}, predicted: `), words);
}

function figure(name, unit, write, title, was, is) {
  const same = was === null || was === undefined || write(was) === write(is);
  const better = same || ["set aside", "sigma0"].includes(name) ? "same" : judged(was, is);
  return h("div", { title },
    h("dt", {}, name),
    h("dd", {}, !same && h("span.was", {}, write(was), h("span.arrow", {}, " → ")), h(`b.${better}`, {}, write(is)),
      unit && h("span.unit", {}, ` ${unit}`)));
}
