// Numbers as a surveyor reads them: rounded to what they mean, with a true minus sign, and a dash for what is not
// known.

const NONE = "–";
const known = (value) => value !== null && value !== undefined && Number.isFinite(value);
const minus = (text) => text.replaceAll("-", "−");

/** `digits` significant digits, without an exponent where it reads well. */
export function significant(value, digits = 3) {
  if (!known(value)) return NONE;
  const size = Math.abs(value);
  if (value !== 0 && (size < 1e-3 || size >= 1e6)) return minus(exponent(value, digits - 1));
  const text = value.toPrecision(digits);
  return minus(text.includes("e") ? String(Math.round(value)) : text);
}

/** A fixed number of decimals. */
export function fixed(value, decimals) {
  return known(value) ? minus(value.toFixed(decimals)) : NONE;
}

/** Metres as millimetres. */
export const mm = (metres) => (known(metres) ? significant(metres * 1000) : NONE);

/** Image residuals, px. */
export const px = (value) => (known(value) && Math.abs(value) >= 10 ? significant(value) : fixed(value, 3));

/** A whole number with thin spaces between thousands. */
export const count = (value) => (known(value) ? String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f") : NONE);

/** `5511.82 ± 0.10`, the value to the place of the second digit of sigma; a common exponent where either is far from
 * one. */
export function withSigma(value, sigma) {
  if (!known(value)) return NONE;
  if (!known(sigma) || sigma <= 0) return significant(value, 5);
  const power = Math.floor(Math.log10(Math.max(Math.abs(value), sigma)));
  const scale = power < -3 || power > 5 ? 10 ** power : 1;
  const decimals = Math.min(12, Math.max(0, 1 - Math.floor(Math.log10(sigma / scale))));
  const text = `${(value / scale).toFixed(decimals)} ± ${(sigma / scale).toFixed(decimals)}`;
  return minus(scale === 1 ? text : `(${text})e${power}`);
}

/** A probability, with the bound that the report has: the tail below it is not known. */
export function probability(p) {
  if (!known(p)) return NONE;
  if (p < 1e-300) return "p < 1e−300";
  return `p = ${p >= 0.001 ? significant(p, 2) : minus(p.toExponential(0))}`;
}

/** Units as written: powers raised, the unit of a pure number left out. */
export function unitText(unit) {
  if (!unit || unit === "1") return "";
  return unit.replace(/\^(-?\d+)/g, (_, digits) => [...digits].map((d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d] ?? "⁻").join(""));
}

function exponent(value, digits) {
  return value.toExponential(Math.max(0, digits)).replace("e+", "e");
}
