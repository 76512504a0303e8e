// Brushing is linked: what is chosen in one figure stands out in the others, in 3D and at the GNSS positions too, and
// can be chosen there.

import assert from "node:assert/strict";
import test from "node:test";
import { block, drag, drawing, drawn, folder, openPage, panel, startLab, STEP } from "./lab.mjs";

test("3D and GNSS positions take part in brushing", { timeout: 5 * STEP }, async (t) => {
  const lab = await startLab(t, block("data/hidden/received-1"), "-o", `${folder(t)}/lab`);
  const page = await openPage(t, lab.url);
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  for (const key of ["4", "0", "g"]) await page.keyboard.press(key);
  await drawn(page, "sensor", "gnss", "flights");
  const legend = panel(page, "space").locator(".legend");
  await page.waitForFunction(() => /residual RMS/.test(document.querySelector(".legend")?.textContent ?? ""), null,
    { timeout: STEP / 10 });
  const canvas = panel(page, "space").locator("canvas");
  const picture = () => canvas.evaluate((element) => element.toDataURL());
  const settled = async () => {
    await drawn(page, "sensor", "gnss");
    await page.waitForTimeout(600);
  };
  const brushedTies = async () => {
    await page.waitForFunction(() => /tie points brushed/.test(document.querySelector(".legend").textContent));
    await settled();
    return (await legend.textContent()).replaceAll("\u202f", "").match(/(\d+) of (\d+) tie points brushed/).slice(1)
      .map(Number);
  };
  const marked = async () => (await page.locator("#selection .mark").textContent()).replaceAll("\u202f", "")
    .split(" of ").map(Number);
  await settled();
  const [before, sensor, gnss] = [await picture(), await drawing(page, "sensor").innerHTML(),
    await drawing(page, "gnss").innerHTML()];

  await t.test("a brush elsewhere stands out in 3D and at the GNSS positions", async () => {
    await drag(page, "flights", [0.02, 0.02], [0.5, 0.98]);
    const [part, all] = await brushedTies();
    assert.ok(part > 0 && part < all, `${part} of ${all} tie points`);
    assert.notEqual(await picture(), before, "the picture in space shows it");
    assert.notEqual(await drawing(page, "gnss").innerHTML(), gnss, "so do the GNSS positions");
    await panel(page, "space").scrollIntoViewIfNeeded();
    await page.picture("linked-1-flights");
    await page.keyboard.press("Escape");
    await settled();
    assert.equal(await picture(), before, "without it all is as before");
  });

  await t.test("a brush in 3D stands out elsewhere, and does not turn the view", async () => {
    await panel(page, "space").getByRole("button", { name: "Brush" }).click();
    await panel(page, "space").scrollIntoViewIfNeeded();
    const box = await canvas.boundingBox();
    const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
    await page.mouse.move(...at(0.05, 0.05));
    await page.mouse.down();
    await page.mouse.move(...at(0.5, 0.98), { steps: 6 });
    await page.mouse.up();
    const [part, all] = await brushedTies();
    const [n, total] = await marked();
    assert.ok(part > 0 && part < all && n > part && n < total,
      `${part} of ${all} tie points, ${n} of ${total} measurements`);
    assert.notEqual(await drawing(page, "sensor").innerHTML(), sensor, "the sensor shows it");
    await page.picture("linked-2-space");
    await panel(page, "space").getByRole("button", { name: "Brush" }).click();
    await page.keyboard.press("Escape");
    await settled();
    assert.equal(await picture(), before, "the view is where it was");
  });

  await t.test("a brush at the GNSS positions chooses their images", async () => {
    await panel(page, "gnss").getByLabel("Shown").selectOption("time");
    await page.waitForFunction(() => [...document.querySelectorAll(".panel[data-view=gnss] .side:last-child svg text")]
      .some((text) => text.textContent.includes("against time")));
    await drawn(page, "gnss");
    await drag(page, "gnss", [0.02, 0.1], [0.4, 0.9]);
    await page.locator("#selection .mark").waitFor();
    await settled();
    const [n, total] = await marked();
    assert.ok(n > 0 && n < total, `${n} of ${total}`);
    await page.picture("linked-3-gnss");
  });
  assert.deepEqual(page.faults, []);
});
