// A simulated block: every kind of parameter has a field of its kind, what is chosen is measured, and the truth stands
// beside each estimate.

import assert from "node:assert/strict";
import test from "node:test";
import { arrivedAt, folder, openPage, startLab, STEP } from "./lab.mjs";

/** Numbers and lists that go with the words of a cause, by parameter; of the others any will do. */
const NUMBERS = {
  "homothety cx": "2500", "homothety cy": "1900", "earth-curvature height": "40", "forward-motion exposure": "0.002",
    "start seed": "7",
  "temperature-focal expansion": "20", "temperature-focal from": "15", "temperature-focal to": "20",
    "temperature-focal warm_up": "100", "temperature-focal reference": "17",
  "noise px": "0.3", "noise marks_px": "0.4",
};
/** Causes that are set smaller than usual: what is looked at is the words, not how the adjustment copes. */
const SMALL = { homothety: { lambda: "0.0005" }, "map-scale": { m: "0.00005" }, "control-blunder": { size: "0.05" },
  outliers: { fraction: "0.005" }, start: { position_m: "0.1", angle_deg: "0.1" } };

/** So many causes are measured together. */
const TOGETHER = 5;

async function api(url) {
  const { origin, searchParams } = new URL(url);
  const headers = { "x-token": searchParams.get("token") };
  return async (path) => (await fetch(`${origin}/api/${path}`, { headers })).json();
}

/** Sets every parameter of a cause that is no plain number to something else than its default; what was set, as the
 * program takes it. */
async function setWords(page, cause, flights) {
  const set = {};
  const field = (name) => page.getByLabel(`${cause.id} ${name}`, { exact: true });
  for (const [name, value] of Object.entries(SMALL[cause.id] ?? {})) {
    await field(name).fill(value);
    await field(name).press("Tab");
    set[name] = value;
  }
  for (const [i, p] of cause.parameters.entries()) {
    if (p.kind === "flag") {
      await field(p.name).setChecked(p.default !== 1);
      set[p.name] = String(1 - p.default);
    } else if (p.kind === "choice") {
      set[p.name] = p.choices.filter((word) => word !== p.default).at(-1);
      await field(p.name).selectOption(set[p.name]);
    } else if (p.kind === "name") {
      set[p.name] = p.choices[i % p.choices.length];
      await field(p.name).selectOption(set[p.name]);
    } else if (p.kind === "list") {
      set[p.name] = flights.map((_, k) => (k % 2 ? -1 : k)).join("/");
      await field(p.name).fill(set[p.name]);
      await field(p.name).press("Tab");
    } else if (p.kind === "optional") {
      await page.getByLabel(`${cause.id} ${p.name}, default`, { exact: true }).uncheck();
      set[p.name] = NUMBERS[`${cause.id} ${p.name}`];
      assert.ok(set[p.name], `${cause.id} ${p.name}: the test knows no number for it`);
      await field(p.name).fill(set[p.name]);
      await field(p.name).press("Tab");
    }
  }
  return set;
}

test("word parameters of every cause are set once and measured", { timeout: 20 * STEP }, async (t) => {
  const lab = await startLab(t, "--simulate", "dike", "-o", `${folder(t)}/lab`);
  const get = await api(lab.url);
  const page = await openPage(t, lab.url, { height: 1200 });
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  await page.keyboard.press("c");
  const box = (id) => page.getByLabel(id, { exact: true });
  await box("noise").waitFor();
  const [{ causes }, { flights }] = [await get("causes"), await get("block")];
  const units = await page.locator(".field .unit").allTextContents();
  assert.ok(units.includes("px"), `units in ${units}`);
  assert.match(await page.locator(".fields").first().textContent(), /default: as px/);
  const wordy = causes.filter((cause) => cause.parameters.some((p) => p.kind !== "number"));
  assert.ok(wordy.length > 12, `${wordy.length} causes have parameters that are no numbers`);
  for (let from = 0; from < wordy.length; from += TOGETHER) {
    const some = wordy.slice(from, from + TOGETHER);
    await t.test(some.map((cause) => cause.id).join(", "), async () => {
      const wanted = new Map();
      for (const cause of some) {
        await box(cause.id).check();
        wanted.set(cause.id, await setWords(page, cause, flights));
      }
      await page.picture(`simulate-words-${from / TOGETHER + 1}`);
      const before = await page.locator(".item").count();
      await page.getByRole("button", { name: "Measure anew" }).click();
      await page.waitForFunction((n) => document.querySelectorAll(".item").length > n
        || document.querySelector(".say.error"), before);
      assert.deepEqual(await page.locator(".say.error").allTextContents(), []);
      await page.waitForFunction(() => document.querySelector(".item.chosen:is(.done, .failed)")
        && !document.querySelector(".item:is(.running, .waiting)"), null, { timeout: STEP });
      const root = (await get("tree")).nodes.at(-1);
      assert.equal(root.state, "done", root.error);
      for (const [id, set] of wanted) {
        const given = root.change.errors.find((text) => text.split(":")[0] === id)?.split(":")[1].split(",") ?? [];
        for (const [name, value] of Object.entries(set)) assert.ok(given.includes(`${name}=${value}`),
          `${id}: ${name}=${value} in ${given}`);
        await box(id).setChecked(id === "noise");
      }
    });
  }
  assert.deepEqual(page.faults, []);
});

test("the truth stands beside each estimate, or the reason why there is none", { timeout: 10 * STEP }, async (t) => {
  const errors = ["noise:px=0.3", "rolling-shutter:readout=0.02", "unflatness:saddle=6", "focal-growth"]
    .flatMap((error) => ["--error", error]);
  const lab = await startLab(t, "--simulate", "dike", ...errors, "-o", `${folder(t)}/lab`);
  const page = await openPage(t, lab.url);
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  for (const effect of ["rolling-shutter", "unflatness", "focal-time"]) {
    await page.keyboard.press("m");
    await page.getByLabel("Effect to add").selectOption(effect);
    await page.locator(".part", { hasText: "Effects" }).getByRole("button", { name: "Add" }).click();
    await arrivedAt(page, `+ ${effect}`);
  }
  await page.keyboard.press("c");
  await page.locator("table.truth").waitFor();
  const rows = await page.$$eval("table.truth tbody tr",
    (all) => all.map((row) => [...row.cells].map((cell) => cell.textContent)));
  const of = (what) => rows.findIndex(([name]) => name === what);
  const shutter = rows[of("rolling-shutter t")];
  assert.equal(shutter[1], "0.02");
  const [estimate, sigma] = shutter[2].split(" ± ").map(Number);
  assert.ok(Math.abs(estimate - 0.02) < 5 * sigma, shutter.join(" "));
  const saddle = rows[of("unflatness c_11")];
  assert.equal(saddle[1], "6");
  const [height, its] = saddle[2].split(" ± ").map(Number);
  assert.ok(Math.abs(height - 6) < 5 * its, saddle.join(" "));
  assert.match(rows[of("focal-time a") + 1][0], /focal-growth acts here/);
  for (const [i, row] of rows.entries()) {
    if (row.length > 1 && row[1] === "–") assert.ok(rows[i + 1]?.length === 1 && rows[i + 1][0].length > 10,
      `${row[0]} has neither truth nor reason`);
  }
  await page.picture("simulate-truth");

  // Parameters that do not go together are refused before anything is measured.
  const items = await page.locator(".item").count();
  await page.getByLabel("homothety", { exact: true }).check();
  await page.getByLabel("homothety centre", { exact: true }).selectOption("xy");
  await page.getByRole("button", { name: "Measure anew" }).click();
  await page.locator(".say.error").waitFor();
  assert.match(await page.locator(".say.error").textContent(), /centre=xy needs `cx` and `cy`/);
  assert.equal(await page.locator(".item").count(), items);
  assert.deepEqual(page.faults.filter((text) => !/status of 400/.test(text)), []);
});
