// The images behind the residuals: under one image's arrows, close up, and in patches about the marks of a point, so
// that a wrong mark is seen.

import assert from "node:assert/strict";
import { cpSync, mkdirSync, readFileSync, symlinkSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import test from "node:test";
import { block, drawing, drawn, folder, openPage, panel, startLab, STEP } from "./lab.mjs";
import { png } from "./png.mjs";

const POINT = "gcp0001";
/** Images are a quarter of the size that the block says, as copies for the screen are. */
const SMALLER = 4;
const [WIDTH, HEIGHT] = [5120 / SMALLER, 3840 / SMALLER];

/** A block in which one mark of a point is off by 60 px, and a folder with its images, a black disc at each true mark.
 * */
function marked(at) {
  const named = join(at, "block");
  cpSync(block("data/hidden/received-1"), named, { recursive: true });
  const images = join(at, "images");
  mkdirSync(images);
  const lines = readFileSync(join(named, "marks.csv"), "utf8").trimEnd().split("\n").map((line) => line.split(","));
  const own = lines.filter(([, point]) => point === POINT).slice(0, 6);
  for (const [image, , x, y] of own) {
    const [cx, cy] = [x / SMALLER, y / SMALLER];
    writeFileSync(join(images, `${image}.png`), png(WIDTH, HEIGHT,
      (px, py) => (Math.hypot(px + 0.5 - cx, py + 0.5 - cy) < 6 ? 0 : 200 + ((px >> 5) + (py >> 5)) % 2 * 30)));
  }
  own[2][2] = String(Number(own[2][2]) + 60);
  writeFileSync(join(named, "marks.csv"), `${lines.map((line) => line.join(",")).join("\n")}\n`);
  return { named, images, wrong: own[2][0], right: own[0][0], with: own.map(([image]) => image) };
}

test("a wrong mark is seen beside the others, and an image behind its residuals", { timeout: 5 * STEP }, async (t) => {
  const at = folder(t);
  const { named, images, wrong, right, with: shown } = marked(at);
  const names = readFileSync(join(named, "images.csv"), "utf8").trimEnd().split("\n").slice(1)
    .map((line) => line.split(",")[0]);
  const linked = names.find((name) => !shown.includes(name));
  writeFileSync(join(at, "secret.png"), "secret");
  symlinkSync(join(at, "secret.png"), join(images, `${linked}.png`));
  const lab = await startLab(t, named, "--images", images, "-o", join(at, "lab"));
  const page = await openPage(t, lab.url);
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  await drawn(page, "sensor", "plan");
  assert.match(lab.said(), /6 of 113 images found/);

  await t.test("only images of the block in that folder are served", async () => {
    const { origin, searchParams } = new URL(lab.url);
    const get = (name, token = searchParams.get("token")) =>
      fetch(`${origin}/api/photos/${name}`, { headers: { "x-token": token } });
    const answer = await get(right);
    assert.equal(answer.headers.get("content-type"), "image/png");
    assert.deepEqual(Buffer.from(await answer.arrayBuffer()), readFileSync(join(images, `${right}.png`)));
    for (const name of ["secret", "..%2Fsecret.png", "%2Fetc%2Fpasswd", `${right}.png%00`,
      "..%2Fblock%2Fimages.csv"]) assert.equal((await get(name)).status, 404, name);
    const led = await get(linked);
    assert.ok(led.status >= 400, "a link out of the folder");
    assert.doesNotMatch(await led.text(), /^secret/);
    assert.equal((await get(right, "wrong")).status, 401);
  });

  const patch = (image) => page.locator(`.patch[data-image="${names.indexOf(image)}"]`);
  /** Grey about the middle of a patch, between the arms of the cross: the median of four places, of which the circle
   * may hide one. */
  const middle = (image) => patch(image).locator("canvas").evaluate((canvas) => {
    const at = (x, y) => canvas.getContext("2d").getImageData(canvas.width / 2 + x, canvas.height / 2 + y, 1,
      1).data[0];
    return [at(12, 12), at(-12, 12), at(12, -12), at(-12, -12)].sort((a, b) => a - b)[1];
  });
  await t.test("patches of the marks of a point, side by side", async () => {
    // A control point is not in the figure where there are check points: the figure of the flights has it.
    await page.keyboard.press("4");
    await drawn(page, "flights");
    const place = await page.evaluate(async (point) => {
      const { plotsOf } = await import("/plots.js");
      const { state } = await import("/state.js");
      const figure = document.querySelector(".panel[data-view=flights] .side:last-child .paper > svg:not(.fading)");
      figure.scrollIntoView({ block: "center" });
      const own = state.block.surveyed.find((one) => one.name === point);
      const plot = plotsOf(figure).find((one) => one.keys.x && one.keys.y);
      const box = figure.getBoundingClientRect();
      const [, , width] = figure.getAttribute("viewBox").split(" ").map(Number);
      return [box.left + (plot.x.pixel(own[plot.keys.x]) * box.width) / width,
        box.top + (plot.y.pixel(own[plot.keys.y]) * box.width) / width];
    }, POINT);
    await page.mouse.move(...place);
    const tip = panel(page, "flights").locator(".side:last-child .tip");
    await page.waitForFunction((point) => document.querySelector(
      ".panel[data-view=flights] .side:last-child .tip")?.textContent.includes(point), POINT);
    assert.match(await tip.textContent(), new RegExp(`control point ${POINT}: dE \\S+, dN \\S+, dH \\S+ mm`));
    await page.mouse.down();
    await page.mouse.up();
    await patch(wrong).waitFor();
    await page.waitForFunction(() => [...document.querySelectorAll(".patch canvas")]
      .filter((canvas) => canvas.getContext("2d").getImageData(20, 20, 1, 1).data[3] > 0).length >= 6);
    assert.ok((await middle(right)) < 60, "the mark is on the disc");
    assert.ok((await middle(wrong)) > 150, "the wrong mark is beside it");
    const absent = page.locator(".patch", { hasText: "no file of this image" });
    assert.equal(await absent.count() + shown.length, await page.locator(".patch").count(),
      "the others say that they have no file");
    await page.picture("images-1-marks");
    await page.keyboard.press("Escape");
  });

  await t.test("the image behind its residuals, and close up", async () => {
    await page.keyboard.press("7");
    await panel(page, "image").getByLabel("Image", { exact: true }).selectOption(String(names.indexOf(right)));
    const photo = drawing(page, "image").locator("image.photo");
    await photo.waitFor();
    // Its edges are those of the sensor on the axes.
    const area = drawing(page, "image").locator("rect.plot").first();
    const [inside, around, range] = [await photo.boundingBox(), await area.boundingBox(),
      (await area.getAttribute("data-x")).split(" ").map(Number)];
    const expected = (around.width * 5120) / (range[1] - range[0]);
    assert.ok(Math.abs(inside.width - expected) < 2, `${inside.width} px wide, expected ${expected}`);
    await panel(page, "image").scrollIntoViewIfNeeded();
    await page.picture("images-2-behind");
    await panel(page, "image").getByRole("button", { name: "Zoom" }).click();
    const canvas = page.locator("canvas.photo");
    await page.waitForFunction(() => /px of the screen per px/.test(document.querySelector("dialog")?.textContent
      ?? ""));
    const before = await canvas.evaluate((element) => element.toDataURL());
    await canvas.hover();
    await page.mouse.wheel(0, -600);
    await page.waitForFunction((was) => document.querySelector("canvas.photo").toDataURL() !== was, before);
    await page.picture("images-3-close");
    await page.keyboard.press("Escape");
  });
  assert.deepEqual(page.faults, []);
});

test("without images the marks of a point are a list, and a folder without images of the block is refused",
  { timeout: 5 * STEP }, async (t) => {
  const at = folder(t);
  const page = await openPage(t, (await startLab(t, block("data/hidden/received-1"), "-o", join(at, "lab"))).url);
  await page.locator(".item.chosen.done").waitFor({ timeout: STEP });
  const first = page.locator(".panel[data-view=plan] .worst tbody tr").first();
  await first.waitFor();
  await first.click();
  assert.match(await page.locator("dialog").textContent(), /check point \S+: dE .* --images FOLDER/);
  assert.ok((await page.locator(".patch").count()) > 2);
  assert.deepEqual(page.faults, []);
  await assert.rejects(startLab(t, block("data/hidden/received-1"), "--images", at, "-o", join(at, "other")),
    /no image of the block lies here/);
});
