// A laboratory on a block in a folder of its own, and a browser that looks at it.

import { spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const root = fileURLToPath(new URL("../..", import.meta.url));
const program = process.env.MISCLOSURE ?? join(root, "target/release/misclosure");
/** A step takes seconds on a machine that is free, and minutes on one that is not. */
export const STEP = 400_000;
export const pictures = join(root, "target/lab-screenshots");
export const block = (path) => join(root, path);

/** A folder that is gone when the test is over. */
export function folder(t) {
  const path = mkdtempSync(join(tmpdir(), "lab-page-"));
  t.after(() => rmSync(path, { recursive: true, force: true }));
  return path;
}

/** Runs the program to its end; its standard output. */
export function run(...words) {
  return new Promise((done, failed) => {
    const child = spawn(program, words, { stdio: ["ignore", "pipe", "inherit"] });
    let out = "";
    child.stdout.on("data", (text) => { out += text; });
    child.on("error", failed);
    child.on("exit", (code) => (code === 0 ? done(out)
      : failed(new Error(`misclosure ${words.join(" ")} ended with ${code}`))));
  });
}

/** Starts `misclosure lab` and waits for the address that it prints. */
export function startLab(t, ...words) {
  const child = spawn(program, ["lab", ...words, "--no-open", "--port", "0"], { stdio: ["ignore", "pipe", "pipe"] });
  const ended = new Promise((done) => child.on("exit", done));
  const kill = async (signal = "SIGKILL") => {
    child.kill(signal);
    await ended;
  };
  t.after(() => kill());
  return new Promise((done, failed) => {
    let said = "";
    const read = (text) => {
      said += text;
      const url = /http:\/\/127\.0\.0\.1:\d+\/\?token=[\w-]+/.exec(said)?.[0];
      if (url) done({ url, kill, said: () => said });
    };
    child.stdout.on("data", read);
    child.stderr.on("data", read);
    child.on("error", failed);
    ended.then((code) => failed(new Error(`misclosure lab ended with ${code} before it printed an address:\n${said}`)));
  });
}

/** A page of 1600 by 1000; what goes wrong in it fails the test. `before`: what is done with it before it has an
 * address. */
export async function openPage(t, url, { width = 1600, height = 1000, colorScheme = "light", before = async () => {} } =
  {}) {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"] });
  t.after(() => browser.close());
  const page = await browser.newPage({ viewport: { width, height }, colorScheme });
  page.setDefaultTimeout(STEP / 3);
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(error.stack));
  page.on("console", (message) => message.type() === "error" && page.faults.push(message.text()));
  mkdirSync(pictures, { recursive: true });
  page.picture = (name) => page.screenshot({ path: join(pictures, `${name}.png`) });
  await before(page);
  await page.goto(url);
  return page;
}

export const panel = (page, view) => page.locator(`.panel[data-view=${view}]`);
export const drawing = (page, view) => panel(page, view).locator(".side:last-child .paper > svg:not(.fading)");

/** Waits until a figure is there, and has no wish left. */
export async function drawn(page, ...views) {
  for (const view of views) await drawing(page, view).waitFor();
  await page.waitForFunction(() => !document.querySelector(".figure.loading, .fading"));
}

/** Waits for a step whose words match, done and chosen; its row in the tree. */
export async function arrivedAt(page, words, timeout = STEP) {
  const row = page.locator(".item.chosen.done", { hasText: words });
  await row.waitFor({ timeout });
  return row;
}

/** The figures of the headline by name, as numbers. */
export const headline = (page) => page.$$eval("#headline .numbers > div",
  (boxes) => Object.fromEntries(boxes.map((box) => [box.querySelector("dt").textContent,
  Number(box.querySelector("b").textContent.replace("−", "-"))])));

/** Drags over a figure, from and to as parts of its first plotting area. */
export async function drag(page, view, [x0, y0], [x1, y1], { hold = false, steps = 8 } = {}) {
  const plot = panel(page, view).locator(".side:last-child rect.plot[data-view]").first();
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
  await page.mouse.move(...at(x0, y0));
  await page.mouse.down();
  await page.mouse.move(...at(x1, y1), { steps });
  if (!hold) await page.mouse.up();
}
