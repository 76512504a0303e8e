// Every view, in both colours and at both widths, kept as pictures to be looked at; and what a name with markup in it
// becomes.

import assert from "node:assert/strict";
import { cpSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import test from "node:test";
import { block, drag, drawing, drawn, folder, openPage, panel, pictures, startLab, STEP } from "./lab.mjs";

const VIEWS = { sensor: "1", plan: "2", height: "3", flights: "4", gnss: "g", profile: "5", images: "6", image: "7",
  histogram: "8", checks: "9", space: "0" };

test("every view has a figure with units at its axes", { timeout: 5 * STEP }, async (t) => {
  const at = folder(t);
  const named = join(at, "block");
  // An image with markup in its name, in every file that names it.
  cpSync(block("data/hidden/received-1"), named, { recursive: true });
  const first = readFileSync(join(named, "images.csv"), "utf8").split("\n")[1].split(",")[0];
  const evil = "<script>alert(1)</script>";
  for (const file of ["images.csv", "ties.csv", "marks.csv"]) {
    const path = join(named, file);
    writeFileSync(path, readFileSync(path, "utf8").split("\n")
      .map((line) => line.split(",").map((cell) => (cell === first ? evil : cell)).join(",")).join("\n"));
  }
  const lab = await startLab(t, named, "-o", join(at, "lab"));

  for (const [width, height, colorScheme] of [[1600, 1000, "light"], [1600, 1000, "dark"], [1024, 768, "light"],
    [1024, 768, "dark"]]) {
    await t.test(`${width} px, ${colorScheme}`, async (t) => {
      const page = await openPage(t, lab.url, { width, height, colorScheme });
      let dialogs = 0;
      page.on("dialog", (dialog) => { dialogs += 1; return dialog.dismiss(); });
      await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
      await drawn(page, "sensor", "plan", "profile", "images");
      await page.locator(".candidate").first().waitFor({ timeout: STEP });
      const name = (view) => `view-${view}-${width}-${colorScheme}`;
      await page.picture(name("start"));
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `the page is ${wide} px wide`);
      for (const [view, key] of Object.entries(VIEWS)) {
        if (!(await panel(page, view).count())) await page.keyboard.press(key);
        await panel(page, view).locator("header h3").dblclick();
        if (view === "space") await page.waitForFunction(() =>
          /enlarged/.test(document.querySelector(".legend")?.textContent ?? ""), null, { timeout: 30_000 });
        else {
          await drawn(page, view);
          const texts = await drawing(page, view).locator("text").allTextContents();
          assert.ok(texts.some((text) => /\((px|m|mm|s|°C|%)[^)]*\)|image/.test(text)),
            `${view}: an axis with its unit among ${texts.join(" | ")}`);
        }
        await page.waitForTimeout(300);
        await page.picture(name(view));
        if (view === "gnss") await gnss(page, name);
        await page.keyboard.press("Escape");
      }
      if (width === 1600 && colorScheme === "light") await sundries(page);
      assert.equal(dialogs, 0, "no script from a name is run");
      assert.deepEqual(page.faults, []);
    });
  }

  /** The GNSS positions in height, against time and against the heading: each with its unit. */
  async function gnss(page, name) {
    for (const show of ["height", "time", "heading"]) {
      await panel(page, "gnss").getByLabel("Shown").selectOption(show);
      await page.waitForFunction((wanted) => [...document.querySelectorAll(
        ".panel[data-view=gnss] .side:last-child svg text")].some((text) => text.textContent.includes(wanted)),
        { height: "residuals in height", time: "against time", heading: "against heading" }[show]);
      await drawn(page, "gnss");
      await page.picture(name(`gnss-${show}`));
    }
    const texts = await drawing(page, "gnss").locator("text").allTextContents();
    assert.ok(texts.some((text) => text === "computed − measured (m)"), texts.join(" | "));
    await panel(page, "gnss").getByLabel("Shown").selectOption("plan");
  }

  /** Side by side, the model, rows, help, and paper. */
  async function sundries(page) {
    await page.keyboard.press("m");
    await page.locator(".part").first().waitFor();
    await page.picture("view-model");
    await page.keyboard.press("w");
    await drag(page, "images", [0, 0.1], [0.012, 0.9]);
    await page.locator("#selection .mark").waitFor();
    await page.keyboard.press("r");
    await page.locator(".drawer tbody tr").first().waitFor();
    assert.ok((await page.locator(".drawer").textContent()).includes(evil), "the name is shown as text");
    await page.picture("view-rows");
    await page.keyboard.press("r");
    await page.keyboard.press("Escape");
    await page.keyboard.press("?");
    await page.locator("dialog[open]").waitFor();
    await page.picture("view-help");
    await page.keyboard.press("Escape");
    await page.emulateMedia({ media: "print" });
    await page.screenshot({ path: join(pictures, "view-print.png"), fullPage: true });
    await page.emulateMedia({ media: null });
  }
});

test("another step is compared at one scale, beside the chosen one and in its place", { timeout: 5 * STEP },
  async (t) => {
  const lab = await startLab(t, block("data/hidden/received-1"), "-o", `${folder(t)}/lab`);
  const page = await openPage(t, lab.url);
  await page.locator(".candidate .add").first().waitFor({ timeout: STEP });
  await page.locator(".candidate .add").first().click();
  await page.locator(".item.chosen.done").nth(0).waitFor();
  await page.waitForFunction(() => document.querySelectorAll(".item.done").length === 2
    && document.querySelector(".item.chosen").textContent.includes("rolling"), null, { timeout: STEP });
  await drawn(page, "sensor");
  const scale = () => drawing(page, "sensor").getAttribute("data-scale");
  const after = await scale();
  await page.keyboard.down("b");
  await page.locator(".panel.peek[data-view=sensor]").waitFor();
  await drawn(page, "sensor");
  assert.equal(await scale(), after, "the step before at the scale of this one");
  await page.picture("compare-before");
  await page.keyboard.up("b");
  await page.keyboard.press("s");
  await panel(page, "sensor").locator(".pair.two .side:first-child .paper > svg").waitFor();
  assert.equal(await panel(page, "sensor").locator(".pair.two .side:first-child .paper > svg")
    .getAttribute("data-scale"), after);
  await page.waitForTimeout(500);
  await page.picture("compare-beside");
  assert.deepEqual(page.faults, []);
});
