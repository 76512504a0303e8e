// A mistake of a person: its card stands above the candidates, the headline says it, and a key mends it.

import assert from "node:assert/strict";
import { cpSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import test from "node:test";
import { arrivedAt, block, drawn, folder, headline, openPage, startLab, STEP } from "./lab.mjs";

const FOOT = 0.3048;

/** A copy of a block whose surveyed points somebody gave in feet. */
function inFeet(to) {
  const copy = join(to, "block");
  cpSync(block("data/hidden/received-1"), copy, { recursive: true });
  const [header, ...rows] = readFileSync(join(copy, "control.csv"), "utf8").trimEnd().split("\n");
  const feet = rows.map((row) => row.split(",").map((cell, k) =>
    (k > 0 && k < 4 ? (Number(cell) / FOOT).toFixed(6) : cell)).join(","));
  writeFileSync(join(copy, "control.csv"), `${[header, ...feet].join("\n")}\n`);
  return copy;
}

test("control points in feet: named, mended by a key, and taken back", { timeout: 5 * STEP }, async (t) => {
  const at = folder(t);
  const lab = await startLab(t, inFeet(at), "-o", join(at, "lab"));
  const page = await openPage(t, lab.url);
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  const card = page.locator("article.mistake").first();
  await card.waitFor({ timeout: STEP });
  await drawn(page, "sensor", "plan");
  assert.match(await card.textContent(), /feet/);
  assert.match(await card.textContent(), /Mend: control\.csv: x × 0\.3048/);
  assert.match(await page.locator("#headline .wrong").textContent(), /feet/);
  assert.equal(await page.locator("#headline .verdict.mistake").count(), 1);
  const first = await page.locator("article.mistake, article.candidate").first().getAttribute("class");
  assert.match(first, /mistake/, "mistakes stand above the candidates");
  const before = await headline(page);
  await page.picture("mistake-1-card");

  await page.locator("#steps h2").click();
  await page.keyboard.press("n");
  assert.ok(await card.evaluate((element) => element === document.activeElement), "N goes to the first card");
  await page.keyboard.press("Enter");
  await arrivedAt(page, "mended: scale");
  await drawn(page, "sensor", "plan");
  const after = await headline(page);
  assert.ok(before["check points"] > 10_000 && after["check points"] < 25,
    `${before["check points"]} and ${after["check points"]} mm`);
  assert.equal(await page.locator("#headline .wrong").count(), 0);
  await page.locator(".candidate").first().waitFor({ timeout: STEP });
  assert.equal(await page.locator("article.mistake").count(), 0);
  await page.picture("mistake-2-mended");

  await page.locator(".item").first().click();
  await card.waitFor();
  assert.ok(await card.getByRole("button", { name: "Mend" }).isVisible());
  assert.deepEqual(page.faults, []);
});
