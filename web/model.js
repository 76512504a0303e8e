// The model of the chosen step, and what can be changed in it: effects, camera parameters, datum, weights, loss,
// outliers. Every change is a
// step of its own.

import { json } from "./api.js";
import { button, choice, fill, h } from "./dom.js";
import { count, unitText, withSigma } from "./numbers.js";
import { chosen, state } from "./state.js";
import { change } from "./steps.js";

const DATUMS = { free: "free: tie points alone", control: "control points", gnss: "GNSS positions",
  all: "control and GNSS" };
const LOSSES = { none: "none: least squares", huber: "Huber", cauchy: "Cauchy" };
const WEIGHTS = { unit: "one for all", multi: "by number of images", pairs: "by pairs" };
const FACTORS = { image: "image measurements", control: "control, plan", control_z: "control, height",
  gnss: "GNSS, plan", gnss_z: "GNSS, height" };

let shown = null;

export async function drawModel(body) {
  const node = chosen();
  if (!node || node.state !== "done") return fill(body,
    h("p.quiet", {}, "The model of a step is known when it is done."));
  if (shown?.node === node.id) return draw(body, shown.model);
  fill(body, h("p.quiet.busy", {}, "Reading the model …"));
  try {
    const model = await json(`nodes/${node.id}/model`);
    if (state.node !== node.id || state.tab !== "model") return;
    shown = { node: node.id, model };
    draw(body, model);
  } catch (error) {
    fill(body, h("p.error", {}, error.message, " ", button("Try again", () => drawModel(body))));
  }
}

function draw(body, model) {
  fill(body, h("p.quiet", {}, "Every change here is a step of its own; the step that you look at stays as it is."),
    effects(model), cameras(model), datum(model), weights(model), outliers(model));
}

const part = (title, ...content) => h("section.part", {}, h("h3", {}, title), ...content);

function effects(model) {
  const within = new Set(model.effects.map((effect) => effect.id));
  const absent = state.block.effects.filter((effect) => !within.has(effect.id));
  const options = [["physical", "Causes"], ["empirical", "Shapes"]].map(([kind, label]) => h("optgroup", { label },
    absent.filter((effect) => (effect.kind === "physical") === (kind === "physical"))
      .map((effect) => h("option", { value: effect.id, title: effect.about }, effect.id))));
  const select = h("select", { "aria-label": "Effect to add" }, options);
  return part("Effects", model.effects.length ? model.effects.map(one)
    : h("p.quiet", {}, "None yet: the camera model alone."),
    h("div.row", {}, select, button("Add", () => change({ kind: "add", effect: select.value }),
      { title: "A step with this effect in the model" })));
}

function one(effect) {
  const parameters = effect.parameters ?? [];
  const few = parameters.length <= 6;
  return h("div.effect", {},
    h("div.row", {}, h("b", {}, effect.id), h("span.space"),
      button("Remove", () => change({ kind: "remove", effect: effect.id }), { title: `A step without ${effect.id}` })),
    few ? values(parameters) : h("details", {}, h("summary", {}, `${parameters.length} parameters`),
      values(parameters)));
}

function values(parameters) {
  return h("table.values", {}, h("tbody", {}, parameters.map((p) =>
    h("tr", {}, h("th", { scope: "row" }, p.name), h("td.number", {}, withSigma(p.value, p.sigma)),
    h("td.unit", {}, unitText(p.unit))))));
}

/** Free and held parameters: boxes by group and by parameter, and one button for the step. */
function cameras(model) {
  const free = new Set(model.free);
  const boxes = new Map();
  const go = button("Adjust with these", () => change({ kind: "free",
    parameters: [...boxes].filter(([, box]) => box.checked).map(([name]) => name) }),
    { title: "A step with the ticked parameters free and the others held", disabled: true });
  const changed = () => { go.disabled = [...boxes].every(([name, box]) => box.checked === free.has(name)); };
  const box = (name) => {
    const input = h("input", { type: "checkbox", checked: free.has(name), "aria-label": `${name} is free`,
      onchange: changed });
    boxes.set(name, input);
    return input;
  };
  const camera = (one, first) => h("table.values", {}, h("caption", {}, one.id),
    h("tbody", {}, one.parameters.map((p) => h("tr", {}, h("td", {}, first && h("label", {}, box(p.name))),
      h("th", { scope: "row" }, p.name), h("td.number", {}, withSigma(p.value, p.free ? p.sigma : 0)),
      h("td.unit", {}, p.free ? unitText(p.unit) : h("span.quiet", {}, "held"))))));
  const groups = state.block.groups.map((group) => button(group.name, () => {
    const on = group.parameters.some((name) => !boxes.get(name)?.checked);
    for (const name of group.parameters) if (boxes.has(name)) boxes.get(name).checked = on;
    changed();
  }, { title: `Free or hold ${group.parameters.join(", ")} together` }));
  const tied = h("input", { type: "checkbox", checked: model.tied,
    onchange: () => change({ kind: "tie_centre", tied: tied.checked }) });
  return part("Camera", h("p.quiet", {}, "Ticked is estimated, the others are held."),
    ...model.cameras.map((one, i) => camera(one, i === 0)),
    h("div.row.groups", {}, groups), h("div.row", {}, go),
      h("label.row", {}, tied, "Centre of distortion is the principal point (a step at once)"));
}

/** A choice that becomes a step with its button, once it differs from the model's. */
function chosenStep(label, options, current, step) {
  const go = button("Adjust so", () => change(step(select.value)),
    { title: "A step with this choice", disabled: true });
  const select = choice(label, options, current, (value) => { go.disabled = value === current; });
  return h("div.row.choice", {}, h("span", {}, label), select, go);
}

const named = (ids, words) => ids.map((id) => [id, words[id] ?? id]);

function datum(model) {
  const { datums, losses } = state.block;
  return part("Datum and loss",
    chosenStep("Datum", named(datums, DATUMS), model.datum, (value) => ({ kind: "datum", datum: value })),
    chosenStep("Loss", named(losses, LOSSES), model.loss, (value) => ({ kind: "loss", loss: value })));
}

function weights(model) {
  const inputs = Object.entries(model.sigma_factors ?? {})
    .map(([name, value]) => [name, value, h("input", { type: "number", min: "0.001", step: "any",
    value: String(Number(value.toPrecision(4))), "aria-label": FACTORS[name] ?? name })]);
  const factors = () => Object.fromEntries(inputs.filter(([, value, input]) =>
    Number(input.value) !== Number(value.toPrecision(4))).map(([name, , input]) => [name, Number(input.value)]));
  return part("Weights",
    chosenStep("Tie points", named(state.block.tie_weights, WEIGHTS), model.tie_weights,
      (value) => ({ kind: "weights", tie_weights: value })),
    h("p.quiet", {}, "Stated standard deviations times:"),
    h("table.values", {}, h("tbody", {}, inputs.map(([name, , input]) =>
      h("tr", {}, h("th", { scope: "row" }, FACTORS[name] ?? name), h("td", {}, input))))),
    h("div.row", {}, button("Adjust with these", () => change({ kind: "weights", factors: factors() }),
      { title: "A step with these factors" }),
      button("Estimate them", () => change({ kind: "estimate_weights" }),
        { title: "A step with factors estimated from the residuals" })));
}

function outliers(model) {
  const { n = 0, rows = [] } = model.outliers ?? {};
  const back = (row) => button("Take back", () => change(
    { kind: "take_back", measurements: [{ image: row.image, point: row.point, kind: row.kind }] }),
    { title: "A step with this measurement" });
  return part("Outliers", h("div.row", {}, h("span", {}, `${count(n)} set aside`), h("span.space"),
    button("Search", () => change({ kind: "search_outliers" }), { title: "A step that searches for outliers anew" })),
    n > 0 && h("details", {}, h("summary", {}, "Which, and why"),
      h("ul.outliers", {}, rows.map((row) => h("li", {},
      h("div.row", {}, h("b", {}, `${row.image} · ${row.point}`), h("span.space"), back(row)),
      h("span.quiet", {}, row.reason))))));
}
