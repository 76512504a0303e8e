// A plan on sliders: numbers follow a slider as a draft and settle where it rests; a refusal is said; all goes back.

import assert from "node:assert/strict";
import test from "node:test";
import { openPage, startLab, STEP } from "./lab.mjs";

const row = (page, name) => page.locator(".dial", { hasText: name });
/** The numbers of the summary, by name. */
const summary = (page) => page.$$eval("#summary > div",
  (boxes) => Object.fromEntries(boxes.map((box) => [box.querySelector("dt").textContent,
    box.querySelector("dd").textContent])));
const settled = (page, words) => page.waitForFunction((wanted) => {
  const state = document.getElementById("state");
  return state.textContent.includes(wanted) && state.textContent.startsWith("The whole block")
    && !state.classList.contains("busy");
}, words, { timeout: STEP });

test("a slider moves the numbers, its rest settles them, and a refusal is said", { timeout: 3 * STEP }, async (t) => {
  const lab = await startLab(t, "--plan", "dike");
  const page = await openPage(t, lab.url);
  await settled(page, "misclosure plan dike");
  const first = await summary(page);
  assert.equal(first.images, "113 ");
  await page.picture("plan-1-opened");

  await row(page, "tilt").locator("[type=range]").fill("0");
  await page.locator("#answer.draft").waitFor({ timeout: STEP });
  assert.match(await page.locator("#state").textContent(), /A draft: .* tie points stand for 14\u202f000/);
  await settled(page, "--set tilt_deg=0");
  assert.equal(await page.locator("#answer.draft").count(), 0);
  // Without a tilted flight the bowl is larger.
  const bowl = "bowl of the heights (1 sigma)";
  assert.ok(parseFloat((await summary(page))[bowl]) > 1.5 * parseFloat(first[bowl]));
  await page.locator(".change.worse").first().waitFor();
  await page.picture("plan-2-without-tilt");

  await page.locator("#dials select").selectOption("control");
  await settled(page, "--datum control");
  const number = page.getByRole("spinbutton", { name: "control", exact: true });
  await number.fill("0");
  await number.blur();
  await page.locator("#state .error").waitFor({ timeout: STEP });
  assert.match(await page.locator("#state .error").textContent(), /control/);

  await page.getByRole("button", { name: "As the scenario says" }).click();
  await page.locator("#dials select").selectOption("");
  await settled(page, "misclosure plan dike");
  assert.deepEqual(await summary(page), first);
  assert.deepEqual(page.faults.filter((fault) => !fault.includes("400")), []);
});
