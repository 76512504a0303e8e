// What can be taken away: figures as SVG and PNG, the report, the model, and the commands that do it again.

import { address, json } from "./api.js";
import { button, dialog, h } from "./dom.js";
import { drawingText } from "./figure.js";
import { chosen, state } from "./state.js";
import { visiblePanels } from "./panels.js";

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

async function commands() {
  const text = await json(`nodes/${state.node}/commands`)
    .then((answer) => answer.commands.join("\n"), (error) => error.message);
  const copy = button("Copy", () => navigator.clipboard.writeText(text).then(() => { copy.textContent = "Copied"; }));
  dialog("Commands that give this step again", h("pre", {}, text), copy);
}

/** The menu of everything that can be exported of the chosen step. */
export function exportMenu() {
  const done = chosen()?.state === "done";
  const close = () => { menu.open = false; };
  const item = (label, f) => h("button", { type: "button", role: "menuitem", onclick: () => { close(); f(); } }, label);
  const file = (label, name, save = name) => h("a", { role: "menuitem", href: address(`nodes/${state.node}/${name}`),
    onclick: close, ...(save ? { download: `${state.block.name}-step-${state.node}-${save}` }
    : { target: "_blank", rel: "noopener" }) }, label);
  const menu = h("details.menu", { onkeydown: (event) => event.key === "Escape" && close(),
    onfocusout: (event) => event.relatedTarget && !menu.contains(event.relatedTarget) && close() },
    h("summary", { title: "Report, model, figures, commands" }, "Export"),
    done && h("div.items", { role: "menu" },
      file("Report of this step", "report.html", null),
      file("model.toml", "model.toml"),
      file("outliers.csv", "outliers.csv"),
      item("Commands …", commands),
      item("All shown figures, SVG", () => visiblePanels().forEach((panel) => savePicture(panel, "svg"))),
      item("All shown figures, PNG", () => visiblePanels().forEach((panel) => savePicture(panel, "png"))),
      item("Print this page …", () => print())));
  return menu;
}
