// A parameter of a cause as a field: a slider, a number, a tick box, a drop-down or a text, each with its unit.
// `changed(value)` is called with
// null where the default holds.

import { choice, h } from "./dom.js";
import { unitText } from "./numbers.js";

/** The field of a parameter of the server's list of causes. `given`: what was chosen, or null. */
export function field(name, p, given, changed) {
  const kinds = { number, flag, choice: words, optional, name: names, list };
  return h(p.kind === "flag" ? "label.field" : "div.field",
    { title: `${p.about}${p.unit ? ` (${unitText(p.unit) || "no unit"})` : ""}` },
    h("span.name", {}, p.name), kinds[p.kind](name, p, given, changed), h("span.unit", {}, unitText(p.unit)));
}

const entry = (name, attributes) => h("input", { type: "number", step: "any", "aria-label": name, ...attributes });

/** A number that has a default: typed, or, where it has a range, by a slider beside it. */
function number(name, p, given, changed) {
  const typed = entry(name, { value: String(given ?? p.default), onchange: () => take(typed.value) });
  const ranged = p.min !== null && p.max !== null;
  const slider = ranged && h("input", { type: "range", min: String(p.min), max: String(p.max),
    step: String((p.max - p.min) / 200), value: String(given ?? p.default), "aria-label": `${name}, slider`,
    oninput: () => take(String(Number(Number(slider.value).toPrecision(4)))) });
  // An empty field is the default again.
  const take = (value) => {
    const shown = value === "" ? String(p.default) : value;
    typed.value = shown;
    if (slider) slider.value = shown;
    changed(Number(shown) === p.default ? null : shown);
  };
  return h("span.value", {}, slider, typed);
}

function flag(name, p, given, changed) {
  const box = h("input", { type: "checkbox", checked: String(given ?? p.default) === "1", "aria-label": name,
    onchange: () => changed(Number(box.checked) === p.default ? null : String(Number(box.checked))) });
  return h("span.value", {}, box, h("span.quiet", {}, p.about.replace(/^1: /, "")));
}

const named = (name, select) => {
  select.setAttribute("aria-label", name);
  return h("span.value", {}, select);
};

const words = (name, p, given, changed) => named(name,
  choice(p.about, p.choices.map((word) => [word, word === p.default ? `${word} (default)` : word]), given ?? p.default,
  (value) => changed(value === p.default ? null : value)));

const names = (name, p, given, changed) => named(name,
  choice(p.about, [["", `default: ${p.without}`], ...p.choices.map((one) => [one, one])], given ?? "",
  (value) => changed(value || null)));

/** A number that may be left out: ticked, the default holds. */
function optional(name, p, given, changed) {
  const typed = entry(name, { value: given ?? "", disabled: given === null,
    onchange: () => changed(typed.value === "" ? null : typed.value) });
  const box = h("input", { type: "checkbox", checked: given === null, "aria-label": `${name}, default`,
    onchange: () => {
    typed.disabled = box.checked;
    if (box.checked) typed.value = "";
    else typed.focus();
    changed(null);
  } });
  return h("span.value", {}, h("label.default", {}, box, `default: ${p.without}`), typed);
}

function list(name, p, given, changed) {
  const typed = h("input", { type: "text", value: given ?? "", placeholder: `default: ${p.without}`, "aria-label": name,
    onchange: () => changed(typed.value.trim() || null) });
  return h("span.value", {}, typed);
}
