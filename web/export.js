// The menu of what can be taken away: figures, the report, the model, and the commands that do it again.

import { address, json } from "./api.js";
import { button, dialog, h } from "./dom.js";
import { chosen, state } from "./state.js";
import { visiblePanels } from "./panels.js";
import { savePicture } from "./save.js";

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
