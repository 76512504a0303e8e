// Mistakes of people in the block of a step: what is recorded wrongly, what to do, and a button where the program can
// undo it.

import { button, h } from "./dom.js";
import { editsInWords } from "./edits.js";
import { withSigma, unitText } from "./numbers.js";
import { change } from "./steps.js";

/** Those names are read at a glance; the others are counted. */
const NAMED = 6;

const canMend = (mistake) => (mistake.mend ?? []).length > 0;

/** The cards above the candidates; nothing where the block has no mistakes. */
export function mistakes(all) {
  if (!all.length) return null;
  const kinds = [...new Set(all.filter(canMend).map((mistake) => mistake.kind))];
  return h("section.mistakes", {}, h("h3", {}, "Mistakes", h("small", {}, ` ${all.length}`)),
    h("p.quiet", {}, "The adjustment leaves out control points and GNSS positions that are recorded wrongly. Mend "
      + "makes a step in which the mistake is undone; your files stay as they are."),
    all.map((mistake) => card(mistake, all)),
    kinds.length > 1 && h("div.row", {}, button("Mend all", () => change({ kind: "mend" }),
      { title: `A step in which all that can be undone is undone: ${kinds.join(", ")}` })));
}

function card(mistake, all) {
  const mend = () => change({ kind: "mend", only: [mistake.kind] });
  const about = `${mistake.kind} of ${mistake.subject}`;
  return h("article.mistake", {
    tabindex: "0", "aria-label": `Mistake: ${about}. ${mistake.sentence}`,
    onkeydown: (event) => event.target === event.currentTarget && event.key === "Enter" && canMend(mistake) && mend(),
  },
    h("div.top", {}, h("h4", {}, mistake.kind, h("small", {}, ` ${mistake.subject}`)),
      canMend(mistake) && button("Mend", mend, { title: `A step in which ${undone(mistake, all)} is undone`,
        key: "Enter", kind: "mend", "aria-label": `Mend ${about}` })),
    h("p", {}, mistake.sentence),
    h("div.size", {}, size(mistake)),
    h("p", {}, "What to do: ", mistake.remedy),
    canMend(mistake) && h("p.quiet", {}, "Mend: ", editsInWords(mistake.mend), "."));
}

/** One step undoes every mistake of a kind, as `misclosure mend --only KIND` does. */
function undone(mistake, all) {
  const subjects = new Set(all.filter((other) => canMend(other) && other.kind === mistake.kind)
    .map((other) => other.subject));
  return `${mistake.kind} of ${[...subjects].join(", ")}`;
}

function size(mistake) {
  const { value, sigma, unit, names = [] } = mistake;
  const of = names.length > NAMED ? `${names.slice(0, NAMED).join(", ")} and ${names.length - NAMED} more`
    : names.join(", ");
  const amount = value === null || value === undefined ? "" : `${withSigma(value, sigma)} ${unitText(unit)}`.trim();
  return [amount, of].filter(Boolean).join(" · ");
}
