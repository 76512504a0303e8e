// Where nothing is missing any more: what the steps did to the error, and the report to take away.

import { address } from "./api.js";
import { h } from "./dom.js";
import { mm, px, significant } from "./numbers.js";
import { nodeOf } from "./state.js";

/** What judges from outside, best first: nothing was fitted to check points, little to what was held out. */
const JUDGES = [
  [(f) => f.check_rms_m, mm, "mm", "3D RMS of the check points"],
  [(f) => f.heldout_px, px, "px", "RMS of held-out measurements"],
  [(f) => f.gnss_rms_m, (value) => significant(value, 3), "m", "3D RMS of the GNSS positions"],
];

function rootOf(node) {
  const parent = nodeOf(node.parent);
  return parent ? rootOf(parent) : node;
}

/** `17.1 to 3.4 mm (3D RMS of the check points)`: from the first step to this one, or of this one alone. */
export function cameTo(first, last) {
  const judge = JUDGES.find(([of]) => Number.isFinite(of(last)));
  if (!judge) return "";
  const [of, write, unit, what] = judge;
  const [was, is] = [of(first), of(last)];
  const from = Number.isFinite(was) && write(was) !== write(is) ? `${write(was)} to ` : "";
  return `${from}${write(is)} ${unit} (${what})`;
}

/** The card of a step to which nothing can be added that would explain more. */
export function done(node, verdict) {
  const says = verdict === "unexplained" ? "No effect of the catalogue explains the remaining patterns" : "Done";
  return h("div.finished", {}, h("p", {}, h("b", {}, `${says}: `), cameTo(rootOf(node).figures, node.figures), "."),
    h("a.main", { href: address(`nodes/${node.id}/report.html`), target: "_blank", rel: "noopener",
      title: "Opens the report of this step; save or print it there" }, "Export the report"));
}
