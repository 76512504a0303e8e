// A plan on sliders. While a slider moves, the server plans a draft; where it rests, the whole block. One request is
// under way at a time, and then only the newest wish counts.

import { json, post, RequestError } from "./api.js";
import { button, fill, h, later } from "./dom.js";
import { startNotice } from "./notice.js";
import { count, significant } from "./numbers.js";
import { drawAnswer } from "./plan_answer.js";
import { drawDials } from "./plan_dials.js";

/** A slider that did not move for this long rests, ms. */
const REST = 350;

const part = (id) => document.getElementById(id);
const references = {};
let start = {};
let wanted = null;
let busy = false;

/** The answer to the scenario as it was opened, with which others are compared: a draft with a draft. */
function reference(draft) {
  references[draft] ??= post("plan", { ...start, draft }).catch((error) => {
    delete references[draft];
    throw error;
  });
  return references[draft];
}

const isStart = ({ values, datum }) => !Object.keys(values).length && datum === start.datum;

async function work() {
  busy = true;
  while (wanted) {
    const asked = wanted;
    wanted = null;
    part("state").classList.add("busy");
    try {
      const answer = await (isStart(asked) ? reference(asked.draft) : post("plan", asked));
      show(answer, await reference(asked.draft).catch(() => null));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      part("answer").classList.add("stale");
      fill(part("state"), h("span.error", {}, error.message));
    }
    part("state").classList.remove("busy");
  }
  busy = false;
}

function ask(turned) {
  wanted = turned;
  if (!busy) work();
}

function show(answer, first) {
  part("answer").classList.remove("stale");
  part("answer").classList.toggle("draft", answer.draft !== null);
  const said = answer.draft === null ? `The whole block, in ${significant(answer.seconds, 2)} s.`
    : `A draft: ${count(answer.draft)} tie points stand for ${count(answer.tie_points)}. Let the slider rest.`;
  fill(part("state"), h("span", {}, said), h("code", {}, answer.command),
    button("Copy", () => navigator.clipboard.writeText(answer.command), { title: "Copy the command" }));
  drawAnswer(part("summary"), part("effects"), answer, first);
  drawing("map", answer.map);
  if (answer.ellipses) drawing("ellipses", answer.ellipses);
  part("ellipses").classList.toggle("stale", answer.ellipses === null);
}

const reader = new DOMParser();

function drawing(id, text) {
  const root = reader.parseFromString(text, "image/svg+xml").documentElement;
  if (root.nodeName === "svg") fill(part(id), document.adoptNode(root));
}

async function open() {
  startNotice("misclosure lab --plan SCENARIO", "");
  fill(part("maps"), h("div.figure", { id: "map" }), h("div.figure", { id: "ellipses" }));
  try {
    const dials = await json("dials");
    document.title = `${dials.scenario} · plan`;
    start = { values: {}, datum: dials.datum };
    const rest = later(REST, (turned) => ask({ ...turned, draft: false }));
    const turned = (values, datum) => {
      const now = { values: { ...values }, datum };
      ask({ ...now, draft: true });
      rest(now);
    };
    drawDials(part("dials"), dials, turned);
    turned({}, dials.datum);
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    fill(part("state"), h("span.error", {}, error.message));
  }
}

open();
