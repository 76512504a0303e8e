// Help: how to read the page, and its keys.

import { dialog, h } from "./dom.js";

const KEYS = [
  ["↑ ↓", "the step above, the step below"],
  ["hold B", "the step before, at the same scale"],
  ["S", "the step before and this one side by side"],
  ["L", "lock scales, or fit them to each picture"],
  ["1 … 9, 0, G", "show or hide a figure; 0 is 3D, G the GNSS positions"],
  ["N, P", "next candidate, candidate before: its predicted picture"],
  ["Enter", "add the candidate that is chosen"],
  ["Space", "what is known of that candidate"],
  ["W, M, C", "what may be missing, the model, the causes of a simulation"],
  ["[ ]", "show or hide the left, the right column"],
  [", .", "image before, next image"],
  ["R", "the brushed measurements one by one"],
  ["Esc", "clear the brush, close, back from a large figure"],
];

const READ = [
  ["Steps", "Each is a complete run, kept in a folder of its own, and never changed. A click goes to it; Ctrl+click compares the chosen step with it. Whatever you change on the right starts a new step under the one you look at."],
  ["Figures", "Drag a rectangle on any of them: the same measurements stand out in all others. Drag the rectangle on to sweep through time or over the sensor. Shift+drag takes what is in both. A double click on the head of a figure gives it all the room."],
  ["Missing?", "Effects that the model does not have, the one that does most to the points first. Hover over one: the figures show what the residuals would look like with it, before any adjustment. Add it: both solvers adjust anew."],
  ["Signs", "Residuals are observed minus computed, px. At control and check points it is computed minus surveyed: there the survey is the reference."],
];

export function help() {
  dialog("How to use this page", h("dl.help", {}, READ.flatMap(([name, text]) => [h("dt", {}, name), h("dd", {}, text)])),
    h("h3", {}, "Keys"), h("table.keys", {}, h("tbody", {}, KEYS.map(([key, what]) => h("tr", {}, h("th", { scope: "row" }, h("kbd", {}, key)), h("td", {}, what))))));
}
