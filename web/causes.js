// A simulated block: causes with their parameters, measured anew by a click, and the truth beside the estimate.

import { json, post, readTree } from "./api.js";
import { button, fill, h } from "./dom.js";
import { field } from "./fields.js";
import { significant, unitText, withSigma } from "./numbers.js";
import { chosen, set, state } from "./state.js";
import { say } from "./progress.js";

let causes = null;
const chosenCauses = new Map(); // id -> {parameter: value}; what is not in it has its default
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
  return [id, Object.fromEntries(rest.split(",").filter(Boolean).map((pair) => pair.split("=")))];
}

const write = ([id, values]) => {
  const rest = Object.entries(values).map(([name, value]) => `${name}=${value}`).join(",");
  return rest ? `${id}:${rest}` : id;
};

async function measure() {
  try {
    const { id } = await post("simulate", { errors: [...chosenCauses].map(write), seed });
    await readTree();
    set({ node: id });
  } catch (error) {
    say("error", error.message);
  }
}

function draw(body) {
  const seedInput = h("input", { type: "number", min: "0", step: "1", value: String(seed), "aria-label": "Seed",
    onchange: () => { seed = Number(seedInput.value); } });
  const truth = h("section.part");
  fill(body, h("p.quiet", {}, `The block ${causes.preset} is measured anew with the causes that are ticked.`),
    h("div.row", {}, h("label", {}, "Seed ", seedInput), h("span.space"),
      button("Measure anew", measure, { kind: "main", title: "A new block as a new first step" })), truth,
    [true, false].map((ticked) => causes.causes.filter((one) => chosenCauses.has(one.id) === ticked).map(cause))
      .flat());
  if (chosen()?.state === "done") compare(truth);
}

function cause(one) {
  const on = chosenCauses.has(one.id);
  const about = h("p.quiet", { hidden: !on }, one.about);
  const fields = h("div.fields", { hidden: !on });
  const show = () => {
    const values = chosenCauses.get(one.id) ?? {};
    const changed = (name) => (value) => {
      if (value === null) delete values[name];
      else values[name] = value;
    };
    fill(fields, one.parameters.map((p) => field(`${one.id} ${p.name}`, p, values[p.name] ?? null, changed(p.name))));
  };
  const box = h("input", { type: "checkbox", checked: on, "aria-label": one.id, onchange: () => {
    if (box.checked) chosenCauses.set(one.id, {});
    else chosenCauses.delete(one.id);
    about.hidden = fields.hidden = !box.checked;
    show();
  } });
  if (on) show();
  return h("div.cause", {}, h("label.row", { title: one.about }, box, h("b", {}, one.id)), about, fields);
}

async function compare(box) {
  const truth = await json(`truth/${state.node}`).catch((error) => ({ error: error.message }));
  if (truth.error) return fill(box, h("h3", {}, "Truth"), h("p.quiet", {}, truth.error));
  fill(box, h("h3", {}, "Truth beside the estimate"), h("p.quiet", {}, truth.errors.join("; ")),
    truth.point_rms_mm !== null && h("p", {}, h("b", {}, significant(truth.point_rms_mm)),
      " mm RMS of the points against the truth"),
    h("table.values.truth", {}, h("thead", {}, h("tr", {},
      ["", "truth", "estimate", ""].map((name) => h("th", {}, name)))),
      h("tbody", {}, truth.rows.map(beside).flat())));
}

/** A row of the table; where nothing can be true of a parameter, the line below says why. */
function beside(row) {
  const known = Number.isFinite(row.truth);
  const line = h("tr", {}, h("th", { scope: "row" }, row.what), h("td.number", {}, known ? exact(row.truth) : "–"),
    h("td.number", {}, row.sigma === 0 ? h("span.quiet",
    { title: "Not estimated: given, or this block cannot tell it from the others" },
    `held at ${significant(row.estimate)}`) : withSigma(row.estimate, row.sigma)),
    h("td.unit", {}, unitText(row.unit)));
  return known ? line : [line, h("tr", {}, h("td.reason", { colspan: "4" }, row.reason))];
}

/** As many digits as it takes, six at most. */
const exact = (value) => (value === 0 ? "0" : significant(Number(value.toPrecision(6)), 6)
  .replace(/(\.\d*?)0+(?=e|$)/, "$1").replace(/\.(?=e|$)/, ""));
