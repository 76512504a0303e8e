// Whether a step made things better or worse: judged by what nothing was fitted to, the check points first.

/** A change of less than this part is neither better nor worse. */
const NOTABLE = 0.01;

/** `better`, `worse` or `same`, of a number that should be small. */
export function judged(was, is) {
  if (!Number.isFinite(was) || !Number.isFinite(is) || Math.abs(is - was) <= NOTABLE * was) return "same";
  return is < was ? "better" : "worse";
}

/** The same of two steps: by their check points, else by held-out measurements, else by GNSS positions. */
export function verdictOf(before, after) {
  for (const key of ["check_rms_m", "heldout_px", "gnss_rms_m"]) {
    if (Number.isFinite(before?.[key]) && Number.isFinite(after?.[key])) return judged(before[key], after[key]);
  }
  return "same";
}
