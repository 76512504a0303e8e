// A simulated block: the truth stands beside each estimate. Parameters that contradict each other are refused.

import assert from "node:assert/strict";
import test from "node:test";
import { arrivedAt, folder, openPage, startLab, STEP } from "./lab.mjs";

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
