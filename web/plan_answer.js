// What a plan would show: numbers beside those of the scenario as it was opened.

import { fill, h } from "./dom.js";
import { count, fixed, mm, significant, unitText } from "./numbers.js";

/** A ratio to the number before that is worth a word. */
const LEAST_CHANGE = 0.01;

/** How a number changed, in words and as `better` or `worse`; null where it hardly did. Less is better. */
export function change(value, before) {
  if (!Number.isFinite(value) || !Number.isFinite(before) || before === 0) return null;
  const part = value / before - 1;
  if (Math.abs(part) < LEAST_CHANGE) return null;
  const percent = `${part > 0 ? "+" : "−"}${Math.round(Math.abs(part) * 100)} %`;
  const text = part > 1 ? `× ${significant(1 + part, 2)}` : percent;
  return { text, kind: part < 0 ? "better" : "worse" };
}

const badge = (own) => (own ? h(`span.change.${own.kind}`, {}, own.text) : null);

/** Parameters of an effect that have a row each; of more, the one that moves points most. */
const ROWS = 3;

/** Every size of an answer by effect and parameter. */
export function sizesOf(plan) {
  const all = new Map();
  for (const { effect, sizes } of plan.effects) {
    for (const size of sizes) all.set(`${effect} ${size.parameter}`, { effect, ...size });
  }
  return all;
}

/** The sizes that have a row. */
export function rowsOf(plan) {
  return plan.effects.flatMap(({ effect, sizes }) => {
    if (sizes.length <= ROWS) return sizes.map((size) => ({ effect, ...size }));
    const most = sizes.reduce((a, b) => ((b.moves_m ?? 0) > (a.moves_m ?? 0) ? b : a));
    return [{ effect, more: sizes.length - 1, ...most }];
  });
}

/** Numbers of the whole block: `[label, text, change]`. */
function numbers(answer, first) {
  const { plan } = answer;
  const images = plan.images - plan.blind.length;
  const rows = [
    ["images", count(plan.images), images < plan.images ? `${plan.images - images} see too little` : ""],
    ["time in the air", `${significant(answer.minutes, 2)} min`, ""],
    ["tie points", count(answer.tie_points), ""],
    ["control points", count(plan.control), ""],
  ];
  const check = (label, of) => {
    const own = plan.precision.check;
    if (!own || of(own) === null) return;
    const before = first?.plan.precision.check;
    rows.push([label, `${mm(of(own))} mm`, badge(change(of(own), before ? of(before) : NaN))]);
  };
  check("check points, plan (RMS)", (own) => own.plan_m.rms);
  check("check points, height (RMS)", (own) => own.height_m.rms);
  check("height, with what stays unseen", (own) => own.height_unseen_m);
  check("height, with the worst that cannot be seen", (own) =>
    (mm(own.height_hidden_m) === mm(own.height_m.rms) ? null : own.height_hidden_m));
  check("bowl of the heights (1 sigma)", (own) => own.dome_m);
  return rows;
}

/** Draws an answer beside that to the scenario as it was opened, where there is one. */
export function drawAnswer(summary, effects, answer, first) {
  fill(summary, numbers(answer, first).map(([label, value, more]) =>
    h("div", {}, h("dt", {}, label), h("dd", {}, h("b", {}, value), " ", more))));
  const before = first ? sizesOf(first.plan) : null;
  const own = rowsOf(answer.plan);
  const most = Math.max(...own.map((size) => size.moves_m ?? 0), 0);
  const row = (size) => {
    const was = before?.get(`${size.effect} ${size.parameter}`);
    return h("tr", {}, h("td.effect", {}, size.effect),
      h("td", {}, size.parameter, size.more ? h("span.quiet", {}, ` and ${size.more} more`) : null),
      h("td.number", {}, significant(size.size)), h("td.unit", {}, unitText(size.unit)),
      h("td", {}, before && !was ? h("span.change.better", {}, "seen now") : badge(change(size.size, was?.size))),
      h("td.number", {}, mm(size.moves_m)), h("td.bar", {}, bar(size.moves_m, most)),
      h("td.quiet", {}, size.looks_like.join(", ")));
  };
  const now = new Set(answer.plan.effects.map((one) => one.effect));
  const gone = (first?.plan.effects ?? []).map((one) => one.effect).filter((effect) => !now.has(effect));
  const hidden = answer.plan.hidden.map(({ effect, typical }) => (typical.length
    ? `${effect} (typically moves points by ${mm(Math.max(...typical.map((own) => own.moves_m)))} mm)` : effect));
  fill(effects,
    h("table", {}, h("thead", {}, h("tr", {}, ["effect", "parameter", "seen from", "", "",
      "unseen it moves points by, mm", "", "till named it may be called"].map((text) => h("th", {}, text)))),
    h("tbody", {}, own.map(row))),
    gone.length ? h("p.change.worse", {}, `Not to be seen any more: ${gone.join(", ")}.`) : null,
    hidden.length ? h("p.quiet", {}, `Not to be seen, whatever their size: ${hidden.join(", ")}.`) : null,
    flights(answer.flights));
}

function bar(value, most) {
  const share = most > 0 ? (value ?? 0) / most : 0;
  const line = h("span", {});
  line.style.width = `${Math.round(100 * share)}%`;
  return line;
}

function flights(all) {
  const percent = (value) => (value === null ? "–" : `${Math.round(value * 100)} %`);
  return h("details", {}, h("summary", {}, "Flights"), h("table", {},
    h("thead", {}, h("tr", {}, ["flight", "images", "strips", "pixel on the ground, mm", "base, m", "forward", "side"]
      .map((text) => h("th", {}, text)))),
    h("tbody", {}, all.map((own) => h("tr", {}, h("td", {}, own.flight), h("td.number", {}, count(own.images)),
      h("td.number", {}, count(own.strips)), h("td.number", {}, mm(own.gsd_m)),
      h("td.number", {}, fixed(own.base_m, 1)), h("td.number", {}, percent(own.forward_overlap)),
      h("td.number", {}, percent(own.side_overlap)))))));
}
