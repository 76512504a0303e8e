// No dead ends: where nothing is missing the page says what came of it, what has nothing to do is no step, and a failed
// step can be dismissed.

import assert from "node:assert/strict";
import test from "node:test";
import { arrivedAt, folder, openPage, startLab, STEP } from "./lab.mjs";

/** Asks for a step behind the page's back, as another page would. */
async function ask(url, parent, change) {
  const { origin, searchParams } = new URL(url);
  const headers = { "x-token": searchParams.get("token"), "content-type": "application/json" };
  return (await fetch(`${origin}/api/steps`, { method: "POST", headers, body: JSON.stringify({ parent, change }) }))
    .json();
}

test("the end of a story: done, with both errors and the report; no button that leads nowhere", { timeout: 5 * STEP },
  async (t) => {
  const errors = ["noise:px=0.3", "rolling-shutter:readout=0.02"].flatMap((error) => ["--error", error]);
  const lab = await startLab(t, "--simulate", "dike", ...errors, "-o", `${folder(t)}/lab`);
  const page = await openPage(t, lab.url, { width: 1440, height: 900 });
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  const add = page.locator(".next button");
  await add.waitFor({ timeout: STEP });
  assert.equal(await add.textContent(), "Add rolling-shutter");
  assert.equal(await page.locator(".finished").count(), 0);
  await add.click();
  await arrivedAt(page, "rolling-shutter");
  const done = page.locator(".finished");
  await done.waitFor({ timeout: STEP });
  const [, was, is] = /Done: ([\d.]+) to ([\d.]+) mm \(3D RMS of the check points\)/.exec(await done.textContent());
  assert.ok(Number(was) > Number(is), `${was} to ${is} mm`);
  assert.equal(await page.locator(".next").count(), 0, "nothing is offered first");
  assert.equal(await page.locator("#side .body button.main").count(), 0, "no blue button stays");
  const report = done.getByRole("link", { name: "Export the report" });
  const answer = await page.request.get(new URL(await report.getAttribute("href"), page.url()).href);
  assert.equal(answer.status(), 200);
  assert.match(await answer.text(), /rolling-shutter/);
  await page.picture("done-1-card");

  await t.test("a failed step says why, and is dismissed by its button, by the headline and by a key", async () => {
    const items = await page.locator(".item").count();
    for (const how of ["row", "headline", "key"]) {
      const { id } = await ask(lab.url, 2, { kind: "remove", effect: "refraction" });
      const row = page.locator(`.item.failed[data-node="${id}"]`);
      await row.waitFor({ timeout: STEP });
      if (how === "row") {
        await page.picture("done-2-failed");
        await row.getByRole("button", { name: /Dismiss/ }).click();
      } else {
        await row.locator(".words").click();
        assert.match(await page.locator("#headline .error").textContent(), /refraction is not in the model/);
        if (how === "headline") await page.locator("#headline").getByRole("button", { name: "Dismiss" }).click();
        else await page.keyboard.press("Delete");
      }
      await row.waitFor({ state: "detached" });
      assert.equal(await page.locator(".item").count(), items);
      await page.locator(".item.chosen.done").waitFor();
    }
  });
  assert.deepEqual(page.faults, []);
});

test("a block to which nothing is missing: Do all makes no step, and says so", { timeout: 5 * STEP }, async (t) => {
  const lab = await startLab(t, "--simulate", "dike", "-o", `${folder(t)}/lab`);
  const page = await openPage(t, lab.url);
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  await page.locator(".finished").waitFor({ timeout: STEP });
  assert.match(await page.locator(".finished").textContent(), /^Done: [\d.]+ mm \(3D RMS of the check points\)/);
  const all = page.getByRole("button", { name: "Do all" });
  assert.ok(!(await all.getAttribute("class"))?.includes("main"), "Do all is not offered in blue");
  await all.click();
  await page.locator(".say.note").waitFor({ timeout: STEP });
  assert.match(await page.locator(".say.note").textContent(), /Nothing to do/);
  assert.equal(await page.locator(".item").count(), 1);
  await page.picture("done-3-nothing-to-do");

  // What the block could not have shown, with its size and unit.
  await page.locator(".unseen summary").click();
  const rows = await page.locator(".unseen tbody tr").allTextContents();
  assert.ok(rows.some((text) => /rolling-shutter[\d.e−⁻]+ s/.test(text)), rows.join(" | "));
  await page.picture("done-4-unseen");
  assert.deepEqual(page.faults, []);
});
