// A simulated block: causes with sliders, measured anew by a click, and the truth beside the estimate.

import { json, post } from "./api.js";
import { button, fill, h } from "./dom.js";
import { significant, unitText, withSigma } from "./numbers.js";
import { chosen, set, state } from "./state.js";
import { say } from "./progress.js";

let causes = null;
const chosenCauses = new Map(); // id -> {parameter: value}
let seed = 1;

export async function drawCauses(body) {
  try {
    if (!causes) {
      fill(body, h("p.quiet.busy", {}, "Reading the causes …"));
      causes = await json("causes");
      seed = causes.seed;
      for (const text of causes.errors) chosenCauses.set(...read(text));
    }
    if (state.tab === "causes") draw(body);
  } catch (error) {
    fill(body, h("p.error", {}, error.message));
  }
}

/** `rolling-shutter:readout=0.02,...` as id and values. */
function read(text) {
  const [id, rest = ""] = text.split(/:(.*)/s);
  return [id, Object.fromEntries(rest.split(",").filter(Boolean).map((pair) => pair.split("=")).map(([name, value]) => [name, Number.isNaN(Number(value)) ? value : Number(value)]))];
}

const write = ([id, values]) => {
  const rest = Object.entries(values).map(([name, value]) => `${name}=${value}`).join(",");
  return rest ? `${id}:${rest}` : id;
};

async function measure() {
  try {
    const { id } = await post("simulate", { errors: [...chosenCauses].map(write), seed });
    set({ tree: await json("tree"), node: id });
  } catch (error) {
    say("error", error.message);
  }
}

function draw(body) {
  const seedInput = h("input", { type: "number", min: "0", step: "1", value: String(seed), "aria-label": "Seed", onchange: () => { seed = Number(seedInput.value); } });
  const truth = h("section.part");
  fill(body, h("p.quiet", {}, `The block ${causes.preset} is measured anew with the causes that are ticked.`), 
    h("div.row", {}, h("label", {}, "Seed ", seedInput), h("span.space"), button("Measure anew", measure, { kind: "main", title: "A new block as a new first step" })), truth,
    [true, false].map((ticked) => causes.causes.filter((one) => chosenCauses.has(one.id) === ticked).map(cause)).flat());
  if (chosen()?.state === "done") compare(truth);
}

function cause(one) {
  const on = chosenCauses.has(one.id);
  const sliders = h("div.sliders", { hidden: !on }, one.parameters.map((p) => slider(one.id, p)));
  const about = h("p.quiet", { hidden: !on }, one.about);
  const box = h("input", { type: "checkbox", checked: on, onchange: () => {
    if (box.checked) chosenCauses.set(one.id, Object.fromEntries(one.parameters.filter((p) => Number.isFinite(p.default)).map((p) => [p.name, p.default])));
    else chosenCauses.delete(one.id);
    about.hidden = sliders.hidden = !box.checked;
    fill(sliders, one.parameters.map((p) => slider(one.id, p)));
  } });
  return h("div.cause", {}, h("label.row", { title: one.about }, box, h("b", {}, one.id)), about, sliders);
}

function slider(id, p) {
  const value = chosenCauses.get(id)?.[p.name] ?? p.default;
  const span = (p.max ?? 1) - (p.min ?? 0);
  const shown = h("output", {}, `${significant(Number(value))} ${unitText(p.unit)}`);
  const input = h("input", { type: "range", min: String(p.min ?? 0), max: String(p.max ?? 1), step: String(span / 200), value: String(value), "aria-label": `${id} ${p.name}`, title: p.about, oninput: () => {
    chosenCauses.set(id, { ...chosenCauses.get(id), [p.name]: Number(input.value) });
    shown.textContent = `${significant(Number(input.value))} ${unitText(p.unit)}`;
  } });
  return h("label.slider", {}, h("span", {}, p.name), input, shown);
}

async function compare(box) {
  const truth = await json(`truth/${state.node}`).catch((error) => ({ error: error.message }));
  if (truth.error) return fill(box, h("h3", {}, "Truth"), h("p.quiet", {}, truth.error));
  fill(box, h("h3", {}, "Truth beside the estimate"), h("p.quiet", {}, truth.errors.join("; ")),
    truth.point_rms_mm !== null && h("p", {}, h("b", {}, significant(truth.point_rms_mm)), " mm RMS of the points against the truth"),
    h("table.values", {}, h("thead", {}, h("tr", {}, ["", "truth", "estimate"].map((name) => h("th", {}, name)))),
      h("tbody", {}, truth.rows.map((row) => h("tr", {}, h("th", { scope: "row" }, row.what), h("td.number", {}, significant(row.truth, 6)), h("td.number", {}, withSigma(row.estimate, row.sigma)), h("td.unit", {}, unitText(row.unit)))))));
}
