// Keys. None is taken from a field that is typed in, nor from the browser (Ctrl, Alt).

import { before, chosen, set, state } from "./state.js";
import { clearBrush } from "./brush.js";
import { help } from "./help.js";
import { canDismiss, dismiss } from "./steps.js";
import { show } from "./bar.js";
import { stepThroughTree } from "./tree.js";
import { toggleRows } from "./selection.js";
import { VIEWS } from "./views.js";

export function startKeyboard() {
  addEventListener("keydown", pressed);
  addEventListener("keyup", (event) => event.key.toLowerCase() === "b" && set({ peek: false }));
  addEventListener("blur", () => set({ peek: false }));
}

const KEYS = {
  b: () => before() && set({ peek: true }),
  s: () => before() && set({ beside: !state.beside }),
  l: () => set({ locked: !state.locked }),
  n: () => candidate(1),
  p: () => candidate(-1),
  w: () => set({ tab: "missing" }),
  m: () => set({ tab: "model" }),
  c: () => state.tree?.simulated && set({ tab: "causes" }),
  r: toggleRows,
  "[": () => set({ steps: !state.steps }),
  "]": () => set({ side: !state.side }),
  "?": help,
  ",": () => image(-1),
  ".": () => image(1),
  arrowup: () => stepThroughTree(-1),
  arrowdown: () => stepThroughTree(1),
  delete: () => canDismiss(chosen()) && dismiss(state.node),
  escape,
};

function pressed(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector("dialog[open]")) return;
  if (event.target.closest("input:not([type=checkbox]), select, textarea, canvas")) return event.key === "Escape"
    && event.target.blur();
  const key = event.key.toLowerCase();
  const view = VIEWS.find((one) => one.key === key);
  const action = view ? () => show(view.id) : KEYS[key];
  if (!action) return;
  event.preventDefault();
  action();
}

function escape() {
  if (state.large) return set({ large: null });
  if (state.brush) return clearBrush();
  document.activeElement?.blur();
  set({ predicted: null, against: null });
}

function image(by) {
  const n = state.block.images.length;
  set({ image: (state.image + by + n) % n });
}

/** Focus goes to the mistake or candidate `by` further on: focus shows the predicted picture of a candidate. */
function candidate(by) {
  if (chosen()?.state !== "done") return;
  const cards = [...document.querySelectorAll("article.mistake, article.candidate")]
    .filter((card) => card.checkVisibility());
  if (!cards.length) return;
  const at = cards.indexOf(document.activeElement);
  cards[at < 0 ? (by > 0 ? 0 : cards.length - 1) : (at + by + cards.length) % cards.length].focus();
}
