// A figure as a file: SVG, or PNG.

import { h } from "./dom.js";
import { drawingText } from "./figure.js";
import { state } from "./state.js";

function download(blob, name) {
  const url = URL.createObjectURL(blob);
  h("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

const nameOf = (view, ending) => `${state.block.name}-step-${state.node}-${view}.${ending}`;

/** Saves the figure of a panel: its SVG as the server drew it, or that painted at twice its size. */
export async function savePicture(panel, kind) {
  if (panel.picture) return download(await panel.picture(), nameOf(panel.view, "png"));
  const text = await drawingText(panel.path());
  const blob = new Blob([text], { type: "image/svg+xml" });
  if (kind === "svg") return download(blob, nameOf(panel.view, "svg"));
  download(await paint(blob), nameOf(panel.view, "png"));
}

async function paint(blob) {
  const url = URL.createObjectURL(blob);
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = h("canvas", { width: 2 * image.width, height: 2 * image.height });
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise((done) => canvas.toBlob(done, "image/png"));
  } finally {
    URL.revokeObjectURL(url);
  }
}
