// Asking for a step. What is asked for appears in the tree at once; the page goes to it when it is done, unless one
// went elsewhere meanwhile.

import { post } from "./api.js";
import { verdictOf } from "./judge.js";
import { nodeOf, on, set, state } from "./state.js";
import { say } from "./progress.js";

/** What is to be shown once it is done: a step by its id, or, of `improve`, whatever comes after the step `from`. */
let awaited = null;

/** So long a new result is marked, ms. */
const FRESH = 4000;

export function startSteps() {
  on(["tree"], arrive);
}

export async function change(what) {
  const from = state.node;
  try {
    const { id } = await post("steps", { parent: from, change: what });
    awaited = { id, from, follow: what.kind === "improve" };
    arrive();
  } catch (error) {
    say("error", error.message);
  }
}

/** Goes to the awaited step when the tree says that it is done. `improve` is followed from step to step. */
function arrive() {
  if (!awaited) return;
  const { id, from, follow } = awaited;
  const next = state.tree.nodes.find((node) => node.state === "done" && (id ? node.id === id : node.parent === from));
  if (!next) return;
  awaited = follow ? { id: null, from: next.id, follow } : null;
  if (state.node === from) show(next.id);
  else if (next.delta_words) say(verdictOf(nodeOf(next.parent)?.figures, next.figures),
    `${next.words}: ${next.delta_words}`);
  arrive();
}

/** Shows a step that has just been computed, and for a moment what it changed. */
function show(id) {
  set({ node: id, against: null, fresh: id });
  setTimeout(() => state.fresh === id && set({ fresh: null }), FRESH);
}

/** Whether a step can be taken out of the tree: it has no result, and it is not all that there is. */
export const canDismiss = (node) => ["failed", "cancelled"].includes(node?.state) && state.tree.nodes.length > 1;

/** Takes a step without a result out of the tree; the page goes back to the step that it came from. */
export async function dismiss(id) {
  const parent = nodeOf(id)?.parent ?? state.tree.nodes.find((node) => node.state === "done")?.id;
  if (state.node === id && parent) set({ node: parent, against: null });
  try {
    await post(`steps/${id}/dismiss`);
  } catch (error) {
    say("error", error.message);
  }
}
