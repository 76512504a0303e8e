// Start of the page: the block and the tree are asked for, the parts are put in their places, events are listened to.

import { json, listen, readTree, RequestError } from "./api.js";
import { fill, h } from "./dom.js";
import { startNotice } from "./notice.js";
import { nodeOf, on, set, state } from "./state.js";
import { startBar } from "./bar.js";
import { startTree } from "./tree.js";
import { startHeadline } from "./headline.js";
import { startProgress, progressEvents } from "./progress.js";
import { startPanels } from "./panels.js";
import { startSelection } from "./selection.js";
import { startSide } from "./side.js";
import { startSteps } from "./steps.js";
import { startKeyboard } from "./keyboard.js";

/** Takes the tree over; chooses the step that the address names, else the newest one that is done. */
async function takeTree() {
  const tree = await readTree();
  if (nodeOf(state.node)) return;
  const named = Number(/^#step-(\d+)$/.exec(location.hash)?.[1]);
  const done = tree.nodes.filter((node) => node.state === "done");
  const node = nodeOf(named) ?? done.at(-1) ?? tree.nodes[0];
  if (node) set({ node: node.id });
}

function theme() {
  if (state.theme === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = state.theme;
}

function columns() {
  document.body.classList.toggle("no-steps", !state.steps);
  document.body.classList.toggle("no-side", !state.side);
}

/** Another step: the address follows, so that a reload shows the same; what was hovered and held is over. */
function stepChosen() {
  history.replaceState(null, "", `#step-${state.node}`);
  set({ predicted: null, peek: false });
}

async function start() {
  startNotice("misclosure lab BLOCK", "Nothing is lost: every finished step is on disk.");
  on(["theme"], theme);
  on(["steps", "side"], columns);
  on(["node"], stepChosen);
  theme();
  columns();
  try {
    set({ block: await json("block") });
    document.title = `${state.block.name} · laboratory`;
    for (const part of [startBar, startTree, startHeadline, startProgress, startPanels, startSelection, startSide,
      startSteps, startKeyboard]) part();
    await takeTree();
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    if (state.connection === "open") fill(document.getElementById("panels"), h("p.error", {}, error.message));
    if (state.connection === "gone") setTimeout(() => location.reload(), 2000);
    return;
  }
  listen({
    ...progressEvents,
    tree: () => takeTree().catch(() => {}),
  });
}

start();
