// The causes of a simulated block: every kind of parameter has a field of its kind, and the program measures what was
// chosen.

import assert from "node:assert/strict";
import test from "node:test";
import { folder, openPage, startLab, STEP } from "./lab.mjs";

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
