// Help: how to read the page, and its keys.

import { dialog, h } from "./dom.js";

const KEYS = [
  ["↑ ↓", "the step above, the step below"],
  ["hold B", "the step before, at the same scale"],
  ["S", "the step before and this one side by side"],
  ["L", "lock scales, or fit them to each picture"],
  ["1 … 9, 0, G", "show or hide a figure; 0 is 3D, G the GNSS positions"],
  ["N, P", "next mistake or candidate, the one before: a candidate's predicted picture"],
  ["Enter", "mend the mistake, or add the candidate, that is chosen"],
  ["Del", "dismiss a step that failed or was cancelled"],
  ["Space", "what is known of that candidate"],
  ["W, M, C", "what may be missing, the model, the causes of a simulation"],
  ["[ ]", "show or hide the left, the right column"],
  [", .", "image before, next image"],
  ["R", "the brushed measurements one by one"],
  ["Esc", "clear the brush, close, back from a large figure"],
];

const READ = [
  ["Steps", "Each is a complete run, kept in a folder of its own, and never changed. A click goes to it; Ctrl+click "
    + "compares the chosen step with it. "
      + "Whatever you change on the right starts a new step under the one you look at."],
  ["Images", "With misclosure lab BLOCK --images FOLDER, One image shows the image under its residuals; a click "
    + "comes closer. A click on a surveyed point shows its marks side by side: a wrong one shows something else than "
    + "the others."],
  ["Figures", "Points and images say their names to the pointer. Drag a rectangle on any of them: the same "
    + "measurements stand out in all others. Drag the rectangle on to sweep through time or over the sensor. "
    + "Shift+drag takes what is in both. In 3D a drag turns the view; Ctrl+drag, or Brush, takes the points in the "
    + "rectangle. A double click on the head of a figure gives it all the room."],
  ["Mistakes", "What is recorded wrongly stands above the candidates, with what to do: feet for metres, two height "
    + "systems, names exchanged. Mend makes a step in which it is undone, and every step beneath goes on with the "
    + "mended block. Your files stay as they are; Export has the command that writes a mended copy."],
  ["Missing?", "Effects that the model does not have, the one that does most to the points first. Hover over one: "
    + "the figures show what the residuals would look like with it, before any adjustment. Add it: both solvers "
    + "adjust anew."],
  ["Where to begin", "Read the sentence at the top right, then add what shows most, and look whether the error "
    + "falls: at the check points where there are any, else at the held-out measurements or the GNSS positions. A "
    + "step that does not help is left by a click on the one before; one that failed can be dismissed. Do all does "
    + "this as misclosure improve would."],
  ["Words", "v'Pv: the weighted sum of squared residuals. Held-out: images predicted from the others, which no fit "
    + "of the cause has seen. sigma0: one where the stated precisions fit. p: how often chance alone would show as "
    + "much. Beyond what is possible: the estimate is larger than physics allows, so that it only looks like this "
    + "cause. Or …: effects that this block cannot tell apart."],
  ["Signs", "Residuals are observed minus computed, px. At control and check points it is computed minus surveyed, "
    + "at GNSS positions computed minus measured, m."],
];

export function help() {
  dialog("How to use this page", h("dl.help", {}, READ.flatMap(([name, text]) =>
    [h("dt", {}, name), h("dd", {}, text)])),
    h("h3", {}, "Keys"), h("table.keys", {}, h("tbody", {},
      KEYS.map(([key, what]) => h("tr", {}, h("th", { scope: "row" }, h("kbd", {}, key)), h("td", {}, what))))));
}
