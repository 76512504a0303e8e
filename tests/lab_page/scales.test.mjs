// One scale for all steps, arrows within their axes, a colour of its own for what is brushed, names, and a bar of one
// line.

import assert from "node:assert/strict";
import test from "node:test";
import { arrivedAt, block, drag, drawing, drawn, folder, openPage, panel, startLab, STEP } from "./lab.mjs";

/** How far drawn lines reach beyond the first plotting area of a figure, px. */
const beyond = (page, view) => drawing(page, view).evaluate((figure) => {
  const area = figure.querySelector("rect.plot").getBoundingClientRect();
  const over = [...figure.querySelectorAll("path")].filter((path) => path.querySelector("title")
    || path.getAttribute("stroke-width") !== "1" && path.getAttribute("d").split("M").length > 20).map((path) => {
    const box = path.getBoundingClientRect();
    return Math.max(area.left - box.left, box.right - area.right, area.top - box.top, box.bottom - area.bottom);
  });
  return { n: over.length, most: Math.max(...over) };
});

/** Both pages have the same scales, up to the rounding of a step's own scale times its own longest arrow. */
const sameScales = (found, expected, message) => {
  assert.deepEqual(Object.keys(found), Object.keys(expected));
  for (const [view, scale] of Object.entries(expected))
    assert.ok(Math.abs(found[view] / scale - 1) < 1e-12, `${view}: ${found[view]} and not ${scale}. ${message ?? ""}`);
};

test("scales fit the largest of all steps, whichever is looked at first", { timeout: 5 * STEP }, async (t) => {
  const lab = await startLab(t, block("data/hidden/received-1"), "-o", `${folder(t)}/lab`);
  let page = await openPage(t, lab.url, { width: 1440, height: 900 });
  await page.locator(".candidate .add").first().waitFor({ timeout: STEP });
  const views = ["sensor", "plan", "height"];
  await page.keyboard.press("3");
  await drawn(page, ...views);
  const scales = async () => Object.fromEntries(await Promise.all(
    views.map(async (view) => [view, Number(await drawing(page, view).getAttribute("data-scale"))])));
  const base = await scales();
  await page.locator(".candidate .add").first().click();
  await arrivedAt(page, "rolling-shutter");
  await drawn(page, ...views);
  sameScales(await scales(), base, "the smaller errors of the second step are drawn at the same scale");

  await t.test("a page that is opened at the better step has the scale of the worse one, and no arrow leaves its axes",
    async () => {
    page = await openPage(t, `${lab.url}#step-2`, { width: 1440, height: 900 });
    await page.locator(".item.chosen.done", { hasText: "rolling-shutter" }).waitFor();
    await page.keyboard.press("3");
    await drawn(page, ...views);
    sameScales(await scales(), base);
    await page.picture("scales-1-second-step");
    await page.locator(".item").first().click();
    await page.locator(".item.chosen", { hasText: "base model" }).waitFor();
    await drawn(page, ...views);
    sameScales(await scales(), base);
    for (const view of views) {
      const { n, most } = await beyond(page, view);
      assert.ok(n > 0 && most < 1.5, `${view}: arrows reach ${most} px beyond the axes`);
    }
    await page.picture("scales-2-first-step");
    const fitted = page.getByRole("button", { name: "Lock scales" });
    await fitted.click();
    await page.locator(".item", { hasText: "rolling-shutter" }).click();
    await page.locator(".item.chosen", { hasText: "rolling-shutter" }).waitFor();
    await drawn(page, ...views);
    assert.ok((await scales()).plan > 1.5 * base.plan, "fitted: smaller errors are drawn larger");
    await fitted.click();
  });

  await t.test("the bar is one line at 1440 px", async () => {
    const { height } = await page.locator("#bar").boundingBox();
    assert.ok(height < 46, `${height} px high`);
  });

  await t.test("points and images say their names, and the panel of the plan is filled", async () => {
    const plan = panel(page, "plan");
    await plan.scrollIntoViewIfNeeded();
    const box = await plan.locator(".side:last-child rect.plot").boundingBox();
    const tip = plan.locator(".side:last-child .tip");
    let said = null;
    // Over the whole area until a point is met.
    for (let k = 0; k < 400 && !said; k++) {
      await page.mouse.move(box.x + ((k * 0.0813) % 1) * box.width, box.y + ((k * 0.377) % 1) * box.height);
      await page.waitForTimeout(20);
      if (await tip.isVisible()) said = await tip.textContent();
    }
    assert.match(said ?? "nothing", /^check point \S+: dE \S+, dN \S+, dH \S+ mm$/);
    const bar = drawing(page, "images").locator("[data-image]").nth(30);
    await bar.scrollIntoViewIfNeeded();
    await bar.hover();
    await page.waitForFunction(() => /^image \S+/.test(
      document.querySelector(".panel[data-view=images] .side:last-child .tip")?.textContent ?? ""));
    const [all, list] = [await plan.boundingBox(), await plan.locator(".worst").boundingBox()];
    assert.ok(all.y + all.height - list.y - list.height < 14, "the list reaches to the end of the panel");
    assert.ok((await plan.locator(".worst tbody tr").count()) > 3);
  });

  await t.test("what is brushed has a colour that nothing else has", async () => {
    const strokes = () => page.$$eval(".panel .side:last-child .paper svg *",
      (all) => all.flatMap((one) => [one.getAttribute("fill"), one.getAttribute("stroke")]));
    await page.keyboard.press("4");
    await drawn(page, "flights", ...views);
    assert.ok(!(await strokes()).includes("#C2007A"), "nothing is brushed yet");
    await drag(page, "sensor", [0.1, 0.05], [0.9, 0.4]);
    await page.locator("#selection .mark").waitFor();
    await page.waitForFunction(() => document.querySelector(
      ".panel[data-view=sensor] .side:last-child .paper svg [stroke='#C2007A']"));
    const colour = (selector, property) => page.locator(selector).first()
      .evaluate((element, name) => getComputedStyle(element)[name], property);
    assert.equal(await colour(".panel[data-view=sensor] .side:last-child .paper svg [stroke='#C2007A']", "stroke"),
      await colour("#selection .mark", "color"));
    // What is not brushed is pale, whatever else is called so.
    const pale = await colour(".panel[data-view=sensor] .side:last-child .paper svg [stroke='#B5B5B5']", "stroke");
    const [red, green, blue] = pale.match(/\d+/g).map(Number);
    assert.ok(Math.max(red, green, blue) - Math.min(red, green, blue) < 20, `${pale} is a grey`);
    await page.picture("scales-3-brushed");
    await page.keyboard.press("Escape");
  });
  assert.deepEqual(page.faults, []);
});
