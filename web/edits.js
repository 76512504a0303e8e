// What `Mend` does to the tables of a block, in a few words.

import { significant } from "./numbers.js";

/** So many edits are told; the others are counted. */
const TOLD = 4;

/** So many digits at most, without zeros behind them. */
const number = (value, digits) => significant(Number(value.toPrecision(digits)), digits).replace(/(\.\d*?)0+$/, "$1")
  .replace(/\.$/, "");

const affine = ({ column, factor, offset }) => {
  const product = factor === 1 ? column : `${column} × ${number(factor, 7)}`;
  if (offset === 0) return product;
  return `${product} ${offset < 0 ? "−" : "+"} ${number(Math.abs(offset), 5)}`;
};

const WORDS = {
  affine,
  "exchange-columns": ({ columns }) => `${columns.join(" and ")} exchanged`,
  "exchange-values": ({ values }) => `${values.join(" and ")} exchanged`,
  clear: ({ columns }) => `${columns.join(", ")} emptied`,
  // A row takes the cells of the row `by` places before it.
  shift: ({ columns, by }) => `${columns.join(", ")} moved ${by < 0 ? "up" : "down"} by ${Math.abs(by)} `
    + `${Math.abs(by) === 1 ? "row" : "rows"}`,
  set: ({ column, value }) => `${column} = ${value}`,
  turn: () => "rotations converted",
  remove: () => "rows left out",
};

function words(edit) {
  const kind = Object.keys(WORDS).find((name) => name in edit);
  return kind ? WORDS[kind](edit[kind]) : "edited";
}

/** `control.csv: x × 0.3048, y × 0.3048, z × 0.3048` */
export function editsInWords(edits) {
  const files = [...new Set(edits.map((edit) => edit.file))];
  const of = (file) => {
    const own = [...new Set(edits.filter((edit) => edit.file === file).map(words))];
    const more = own.length > TOLD ? ` and ${own.length - TOLD} more` : "";
    return `${file}: ${own.slice(0, TOLD).join(", ")}${more}`;
  };
  return files.map(of).join("; ");
}
