// What is recorded wrongly, then what may be missing in the model: the candidates, strongest impact first. Hovering one
// shows the pictures
// that the null model predicts with it; a click adds it.

import { json } from "./api.js";
import { done } from "./done.js";
import { button, fill, h, later } from "./dom.js";
import { mistakes } from "./mistakes.js";
import { probability, significant, unitText, withSigma } from "./numbers.js";
import { chosen, on, set, state } from "./state.js";
import { change } from "./steps.js";

/** Findings that are read at a glance. */
const SHOWN = 4;
let answer = null;
let asked = null;
let open = null;
let drawn = null; // answer that the column shows
let quiet = false; // one has just been added: no preview until the pointer went elsewhere

export function startCandidates(body) {
  on(["predicted"], () => {
    for (const card of body.querySelectorAll(".candidate")) card.classList.toggle("shown",
      card.dataset.effect === state.predicted);
  });
}

/** Asks once per step; the answer of a step that was left meanwhile is dropped. */
export async function drawCandidates(body) {
  const node = chosen();
  if (!node || node.state !== "done") return fill(body,
    h("p.quiet", {}, "The candidates of a step are known when it is done."));
  if (asked === node.id && answer) return drawn === answer && body.querySelector(".candidates") ? undefined
    : draw(body);
  if (asked === node.id) return;
  asked = node.id;
  answer = null;
  fill(body, h("p.quiet.busy", {}, "Testing every effect of the catalogue …"));
  try {
    const found = await json(`nodes/${node.id}/candidates`);
    if (asked !== node.id) return;
    answer = found;
    if (state.tab === "missing") draw(body);
  } catch (error) {
    if (asked === node.id) asked = null;
    if (state.tab === "missing") fill(body, h("p.error", {}, error.message, " ",
      button("Try again", () => drawCandidates(body))));
  }
}

function draw(body) {
  const all = answer.candidates;
  const physical = (c) => c.kind === "physical";
  const tested = all.filter((c) => c.tested);
  const strong = tested.filter((c) => c.significant);
  const most = Math.max(...strong.map((c) => c.impact_mm ?? 0), 1e-9);
  const list = (candidates) => candidates.map((c) => card(c, most));
  drawn = answer;
  fill(body,
    answer.sentence && h("p.sentence", {}, answer.sentence),
    mistakes(answer.mistakes ?? []),
    next(),
    h("div.candidates", { onpointerleave: () => { quiet = false; preview(null); } },
      section("Causes", list(strong.filter(physical)),
        "No physical effect of the catalogue is significant at this step.",
        "mm: how far it moves the points, RMS. Hover over one to see the figures with it, click it for what it is."),
      strong.some((c) => !physical(c)) && section("Shapes", list(strong.filter((c) => !physical(c))), "",
        "Empirical fields: they show what shape is left, and name no cause.")),
    folded("Not significant", tested.filter((c) => !c.significant), (c) => card(c, most)),
    unseen(tested.filter((c) => !c.significant && c.detectable)),
    folded("Cannot be tested on this block", all.filter((c) => !c.tested), untested),
    left());
}

/**
 * What to do first: the list is ordered by harm, but what shows most makes the tests of the others clearer. Where
 * nothing is missing any more:
 * what came of the steps.
 */
function next() {
  const { next: effect, mistakes } = answer;
  if (!effect) return mistakes?.length ? null : done(chosen(), answer.verdict);
  return h("div.next", {}, button(`Add ${effect}`, () => add(effect),
    { title: "A step with it in the model; then look at what is left", kind: mistakes?.length ? undefined : "main" }),
    h("span.quiet", {}, "first, then look at what is left. Do all, above, goes on so to the end."));
}

function section(title, cards, none, remark) {
  return h("section", {}, h("h3", {}, title, cards.length ? h("small", {}, ` ${cards.length}`) : null),
    remark && h("p.quiet", {}, remark), cards.length ? cards : h("p.quiet", {}, none));
}

function folded(title, candidates, item) {
  return candidates.length > 0 && h("details", {}, h("summary", {}, title, h("small", {}, ` ${candidates.length}`)),
    candidates.map(item));
}

/** What this block could not have shown: below that size an effect stays hidden, and moves the check points by so much
 * all the same. */
function unseen(candidates) {
  const check = (c) => c.detectable.check_change_m;
  const hidden = [...candidates].sort((a, b) => Math.abs(check(b) ?? 0) - Math.abs(check(a) ?? 0));
  const row = (c) => h("tr", {}, h("th", { scope: "row" }, c.effect),
    h("td.number", {}, `${significant(Math.abs(c.detectable.size), 2)} ${unitText(c.detectable.unit)}`),
    h("td.number", {}, Number.isFinite(check(c)) ? `${significant(1000 * Math.abs(check(c)), 2)} mm` : "–"));
  return hidden.length > 0 && h("details.unseen", {}, h("summary", {}, "What this block could not have shown",
    h("small", {}, ` ${hidden.length}`)),
    h("p.quiet", {}, "An effect smaller than this stays hidden here. In the last column: how much one of that size "
      + "changes the error at check points."),
    h("table.values", {}, h("thead", {}, h("tr", {}, ["", "hidden below", "check points"]
      .map((name) => h("th", { scope: "col" }, name)))), h("tbody", {}, hidden.map(row))));
}

function untested(c) {
  const needs = c.needs?.length ? `needs ${c.needs.join(", ")}` : "no test of it is possible here";
  return h("div.untested", {}, h("b", {}, c.effect), h("span.quiet", {}, ` ${needs}`));
}

function left() {
  const shapes = answer.left ?? [];
  const items = (some) => h("ul", {}, some.map((text) => h("li", {}, text)));
  const [first, more] = [shapes.slice(0, SHOWN), shapes.slice(SHOWN)];
  return shapes.length > 0 && h("section.left", {}, h("h3", {}, "Left in the residuals"),
    h("p.quiet", {}, "What the tests still see at this step, clearest first."),
    items(first), more.length > 0 && h("details", {}, h("summary", {}, "More", h("small", {}, ` ${more.length}`)),
      items(more)));
}

const ask = later(120, (effect) => set({ predicted: effect }));

/** Shows the predicted picture of an effect after a moment's hover; null goes back at once. */
function preview(effect) {
  ask.cancel();
  if (!effect || state.connection !== "open") return set({ predicted: null });
  if (!quiet) ask(effect);
}

on(["predicted"], async () => {
  const effect = state.predicted;
  if (!effect || state.prediction?.effect === effect && state.prediction.node === state.node) return;
  const node = state.node;
  const words = await json(`nodes/${node}/predicted/${encodeURIComponent(effect)}`)
    .catch((error) => ({ effect, words: error.message }));
  set({ prediction: { ...words, node } });
});

function add(effect) {
  quiet = true;
  preview(null);
  change({ kind: "add", effect });
}

function card(c, most) {
  const bar = h("span.bar");
  bar.style.width = `${(100 * Math.min(c.impact_mm ?? 0, most)) / most}%`;
  const details = h("div.details", {}, ...facts(c), ...(c.sentences ?? []).slice(1).map((text) => h("p", {}, text)));
  const box = h("article.candidate", {
    tabindex: "0", data: { effect: c.effect }, "aria-expanded": String(open === c.effect),
    onpointerenter: () => preview(c.effect), onpointerleave: () => { quiet = false; }, onfocus: () => preview(c.effect),
      onblur: () => preview(null),
    onclick: (event) => event.target.closest("button") || unfold(box, c.effect),
    onkeydown: (event) => {
      if (event.target !== box) return;
      if (event.key === "Enter") add(c.effect);
      if (event.key === " ") { unfold(box, c.effect); event.preventDefault(); }
    },
  },
    h("div.top", {}, h("h4", {}, c.effect),
      h("span.impact", { title: impactTitle(c) }, c.impact_mm === null || c.impact_mm === undefined ? "–"
        : h("b", {}, significant(c.impact_mm)), h("span.unit", {}, " mm")),
      button("Add", () => add(c.effect), { title: `A step with ${c.effect} in the model`, key: "Enter", kind: "add" })),
    h("div.scale", { title: impactTitle(c) }, bar),
    c.sentences?.length > 0 && h("div.what", { title: c.sentences[0] }, c.sentences[0]),
    h("div.size", {}, sizes(c.estimate)),
    h("div.sure", {}, ...sure(c), c.effect === answer.next
      && h("span.flag.first",
      { title: "The diagnosis would add this one next; the list is ordered by what it does to the points" },
      "shows most"), c.plausible === false && h("span.flag",
      { title: "The estimate is beyond what physics allows of this effect: a shape that looks like it" },
      "beyond what is possible")),
    c.inseparable_from?.length > 0 && h("div.partners", { title: "This block cannot tell them apart" }, "or ",
      c.inseparable_from.map((name) => h("span.chip", {}, name))),
    details);
  return box;
}

/** Folds the details of a candidate out, and those of the others in. */
function unfold(box, effect) {
  open = open === effect ? null : effect;
  for (const other of box.parentElement.closest(".body")
    .querySelectorAll(".candidate")) other.setAttribute("aria-expanded", String(other.dataset.effect === open));
}

const impactTitle = (c) => `What it does to the `
  + `${c.impact_surveyed === false ? "points (a sample, after a similarity)" : "surveyed points"}: RMS in `
  + `space${c.impact_height_mm ? `, of which ${significant(c.impact_height_mm)} mm in height` : ""}`;

function sizes(estimate) {
  const entries = Object.entries(estimate ?? {});
  if (!entries.length) return "";
  if (entries.length > 3) return `${entries.length} parameters`;
  return entries.map(([name, e]) => `${name} = ${withSigma(e.value, e.sigma)} ${unitText(e.unit)}`).join(", ");
}

function sure(c) {
  const p = probability(c.p_value);
  if (!c.significant) return ["not significant, ", h("span.p", {}, p)];
  return [c.p_value < 1e-9 ? "beyond doubt, " : "significant, ",
    h("span.p", { title: "Probability that chance alone shows as much" }, p)];
}

function facts(c) {
  const rows = [
    ["In the images", c.size_px !== null && c.size_px !== undefined && `${significant(c.size_px, 2)} px RMS`],
    ["In height", c.impact_height_mm && `${significant(c.impact_height_mm)} mm`],
    ["Expected drop of v'Pv", c.predicted_drop && significant(c.predicted_drop, 4)],
    ["Detectable from", c.detectable && `${significant(c.detectable.size, 2)} ${unitText(c.detectable.unit)}`],
  ].filter(([, value]) => value);
  return [h("dl", {}, rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]))];
}
